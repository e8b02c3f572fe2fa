"""The document of the robot's hardware says what firmware and drivers say."""

import ast
import re
import runpy
from pathlib import Path

from contourslam.robot import device_errors

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


def texts(path: Path) -> list[tuple[str, bool]]:
    """Each text of a module, with … for what is put into it, and whether it is the message of a device's error."""

    def plain(node: ast.AST) -> str | None:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            return node.value
        if isinstance(node, ast.JoinedStr):
            return "".join(part.value if isinstance(part, ast.Constant) else "…" for part in node.values)
        return None

    found: dict[str, bool] = {}
    for node in ast.walk(ast.parse(path.read_text())):
        text = plain(node)
        if text is not None:
            found.setdefault(text, False)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in DEVICE_ERRORS:
            text = plain(node.args[0])
            if text is not None and re.search(r"\w", text):
                found[text] = True
    return list(found.items())


DEVICE_ERRORS = {name for name, kind in vars(device_errors).items() if isinstance(kind, type)}
TEXTS = [text for path in sorted((ROOT / "src" / "contourslam" / "robot").rglob("*.py")) for text in texts(path)]
QUOTED = re.findall(r"^\| `(.+?)` \|", (ROOT / "docs" / "robot.md").read_text(), re.MULTILINE)


def test_each_message_in_the_table_of_troubles_is_one_of_the_code() -> None:
    assert len(QUOTED) > 20
    assert [quote for quote in QUOTED if not any(quote in text for text, _ in TEXTS)] == []


def test_each_message_of_a_device_is_in_the_table_of_troubles() -> None:
    messages = [text for text, is_message in TEXTS if is_message]
    assert len(messages) > 20
    assert [message for message in messages if not any(quote in message for quote in QUOTED)] == []
