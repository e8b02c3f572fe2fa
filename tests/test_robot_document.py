"""The document of the robot's hardware says what firmware and drivers say."""

import re
import runpy
from pathlib import Path

ROOT = Path(__file__).parents[1]
CONFIG = ROOT / "firmware" / "mega" / "config.h"
PICTURES = ROOT / "docs" / "pictures"


def test_the_picture_of_the_wiring_shows_the_pins_of_the_firmware() -> None:
    drawn = runpy.run_path(str(PICTURES / "wiring.py"))["draw"](CONFIG.read_text())
    assert drawn == (PICTURES / "wiring.svg").read_text(), "python docs/pictures/wiring.py"


def test_each_pin_of_the_firmware_leads_to_its_part_in_the_picture() -> None:
    config = CONFIG.read_text()
    ends = dict(re.findall(r"<title>mega\.(\S+) to (.+?)</title>", (PICTURES / "wiring.svg").read_text()))
    wanted = {
        "MOTOR_LEFT_PWM": "driver.PWMA",
        "MOTOR_LEFT_IN1": "driver.AIN1",
        "MOTOR_LEFT_IN2": "driver.AIN2",
        "MOTOR_RIGHT_PWM": "driver.PWMB",
        "MOTOR_RIGHT_IN1": "driver.BIN1",
        "MOTOR_RIGHT_IN2": "driver.BIN2",
        "ENCODER_LEFT_A": "left motor.A",
        "ENCODER_LEFT_B": "left motor.B",
        "ENCODER_RIGHT_A": "right motor.A",
        "ENCODER_RIGHT_B": "right motor.B",
    }
    for name, end in wanted.items():
        (number,) = re.findall(rf"^#define {name} (\d+)$", config, re.MULTILINE)
        assert ends[number] == end
