"""Draws docs/pictures/wiring.svg from the pins of firmware/mega/config.h: python docs/pictures/wiring.py."""

import re
from pathlib import Path
from xml.sax.saxutils import escape

HERE = Path(__file__).parent
CONFIG = HERE.parents[1] / "firmware" / "mega" / "config.h"
PICTURE = HERE / "wiring.svg"

BATTERY, FIVE, SIGNAL, USB, MOTOR = "#c62828", "#ef8f00", "#1565c0", "#2e7d32", "#6a1b9a"
MEANING = {
    BATTERY: "battery, 7.4 V",
    FIVE: "5 V and 3.3 V",
    SIGNAL: "signals",
    USB: "USB, CSI",
    MOTOR: "motor current",
}
PITCH = 26  # between two pins


def pins(config: str) -> dict[str, str]:
    """Give the plain numbers that a header defines, by name; the first definition counts."""
    found: dict[str, str] = {}
    for name, value in re.findall(r"^#define (\w+) (-?[\d.]+)", config, re.MULTILINE):
        found.setdefault(name, value)
    return found


class Drawing:
    """Boxes with pins at their sides, and lines between the pins."""

    def __init__(self) -> None:
        self.parts: list[str] = []
        self.places: dict[str, tuple[float, float]] = {}

    def text(
        self, x: float, y: float, words: str, anchor: str = "start", size: int = 13, weight: str = "normal"
    ) -> None:
        """Write."""
        self.parts.append(
            f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}" font-size="{size}" font-weight="{weight}">'
            f"{escape(words)}</text>"
        )

    def box(self, x: float, y: float, width: float, height: float, title: str, *under: str) -> None:
        """Draw a part with its name, and words under it."""
        self.parts.append(
            f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="8" fill="#f5f5f5" stroke="#333"/>'
        )
        self.text(x + width / 2, y + 20, title, "middle", 15, "bold")
        for line, words in enumerate(under):
            self.text(x + width / 2, y + 38 + 16 * line, words, "middle", 12)

    def pin(self, name: str, x: float, y: float, label: str, inside: int) -> None:
        """Draw a pin on a box's edge, its label to the right (1), to the left (-1) or above (2)."""
        self.places[name] = x, y
        self.parts.append(f'<circle cx="{x:g}" cy="{y:g}" r="4" fill="#333"/>')
        if inside == 2:
            self.text(x, y - 8, label, "middle", 12)
        else:
            self.text(x + 9 * inside, y + 4, label, "start" if inside == 1 else "end", 12)

    def column(self, part: str, x: float, y: float, inside: int, *labels: str) -> None:
        """Draw pins below each other; they are called part.label, and those called GND are earthed."""
        for row, label in enumerate(labels):
            at = y + PITCH * row
            self.pin(f"{part}.{label}", x, at, label, inside)
            if label == "GND":
                self.earth(x, at, -inside)

    def earth(self, x: float, y: float, side: int) -> None:
        """Draw the sign of ground beside a pin."""
        at = x + 16 * side
        self.parts.append(
            f'<path d="M{x:g} {y:g}H{at:g}M{at:g} {y - 8:g}v16M{at + 4 * side:g} {y - 5:g}v10'
            f'M{at + 8 * side:g} {y - 2:g}v4" stroke="#333" stroke-width="1.5" fill="none"/>'
        )

    def line(self, color: str, *points: "str | float", name: str = "") -> None:
        """Draw a line from pin to pin: numbers between the pins are turns, x and y by turns, beginning with x."""
        (x, y), (end_x, end_y) = self.places[str(points[0])], self.places[str(points[-1])]
        path, across = f"M{x:g} {y:g}", True
        for turn in points[1:-1]:
            path += f"{'H' if across else 'V'}{turn:g}"
            across = not across
        path += f"H{end_x:g}V{end_y:g}" if across else f"V{end_y:g}H{end_x:g}"
        title = escape(name or f"{points[0]} to {points[-1]}")
        self.parts.append(
            f'<path d="{path}" stroke="{color}" stroke-width="2.2" fill="none"><title>{title}</title></path>'
        )

    def dot(self, color: str, x: float, y: float) -> None:
        """Draw where lines are joined."""
        self.parts.append(f'<circle cx="{x:g}" cy="{y:g}" r="4.5" fill="{color}"/>')

    def svg(self, width: int, height: int) -> str:
        """Give the picture."""
        return "\n".join([
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif">',
            f'<rect width="{width}" height="{height}" fill="white"/>',
            *self.parts,
            "</svg>\n",
        ])  # fmt: skip


def power(d: Drawing) -> None:
    """Battery, fuse, switch and regulator."""
    d.box(30, 40, 180, 100, "battery", "2 lithium cells, 7.4 V")
    d.box(260, 40, 130, 100, "fuse, switch", "5 A")
    d.box(500, 40, 210, 100, "regulator", "to 5.1 V, 5 A, step-down")
    d.pin("battery.+", 210, 90, "+", -1)
    d.column("battery", 210, 118, -1, "GND")
    d.pin("switch.in", 260, 90, "", 1)
    d.pin("switch.out", 390, 90, "", -1)
    d.pin("regulator.in", 500, 90, "in", 1)
    d.column("regulator", 500, 118, 1, "GND")
    d.pin("regulator.lidar", 560, 140, "5 V", 2)
    d.pin("regulator.pi", 650, 140, "5 V", 2)
    d.line(BATTERY, "battery.+", "switch.in")
    d.line(BATTERY, "switch.out", "regulator.in")


def computer(d: Drawing) -> None:
    """Lidar, Raspberry Pi and camera."""
    d.box(30, 230, 210, 120, "YDLidar X4")
    d.pin("lidar.power", 135, 230, "", 2)
    d.text(135, 276, "second USB socket:", "middle", 12)
    d.text(135, 292, "power, 5 V 1 A", "middle", 12)
    d.pin("lidar.data", 240, 325, "USB, data", -1)
    d.box(500, 230, 210, 120, "Raspberry Pi 4 (or 3)")
    d.pin("pi.power", 650, 230, "", 2)
    d.text(650, 270, "power", "middle", 12)
    d.pin("pi.lidar", 500, 325, "USB", 1)
    d.pin("pi.base", 605, 350, "USB", 2)
    d.pin("pi.camera", 710, 300, "CSI or USB", -1)
    d.box(900, 230, 190, 120, "fisheye camera", "220°, fixed focus")
    d.pin("camera.data", 900, 300, "CSI or USB", 1)
    d.line(FIVE, "regulator.lidar", 560, 185, 135, "lidar.power")
    d.line(FIVE, "regulator.pi", "pi.power")
    d.line(USB, "lidar.data", "pi.lidar")
    d.line(USB, "pi.camera", "camera.data")


def mega(d: Drawing, pin: dict[str, str]) -> None:
    """The Mega with what hangs on it."""
    left, right, top = 500, 710, 430
    d.box(left, top, right - left, 400, "Arduino Mega 2560")
    d.pin("mega.usb", 605, top, "", 2)
    d.text(605, top + 38, "USB, also its power", "middle", 12)
    d.line(USB, "pi.base", "mega.usb")
    motors = [pin[f"MOTOR_{side}_{what}"] for side in ("LEFT", "RIGHT") for what in ("PWM", "IN1", "IN2")]
    d.column("mega", right, top + 70, -1, *motors)
    d.pin("mega.driver 5V", right, top + 70 + 6 * PITCH, "5V", -1)
    encoders = [pin[f"ENCODER_{side}_{what}"] for side in ("LEFT", "RIGHT") for what in ("A", "B")]
    d.column("mega", right, top + 274, -1, *encoders)
    d.pin("mega.encoder 5V", right, top + 274 + 4 * PITCH, "5V", -1)
    d.pin("mega.battery", left, top + 70, f"A{pin['BATTERY_PIN']}", 1)
    for row, (name, label) in enumerate((("5V", "5V"), ("sda", "20 SDA"), ("scl", "21 SCL"), ("3.3V", "3.3V"))):
        d.pin(f"mega.{name}", left, top + 170 + PITCH * row, label, 1)
    d.column("mega", left, top + 170 + 4 * PITCH, 1, "GND")


def divider(d: Drawing, pin: dict[str, str]) -> None:
    """The battery's voltage, divided for the Mega's analogue pin."""
    d.places |= {"tap": (440, 90), "node": (440, 500), "foot": (440, 556)}
    d.line(BATTERY, "tap", "node", name="battery to divider")
    d.line(SIGNAL, "node", "mega.battery", name=f"divider to A{pin['BATTERY_PIN']}")
    d.line(SIGNAL, "node", "foot", name="divider to ground")
    for y, ohms in ((440, "20 kΩ"), (512, "10 kΩ")):
        d.parts.append(f'<rect x="432" y="{y}" width="16" height="36" fill="white" stroke="#333" stroke-width="1.5"/>')
        d.text(424, y + 23, ohms, "end", 12)
    d.parts.append(
        '<path d="M440 556v6M430 562h20M434 566h12M438 570h4" stroke="#333" stroke-width="1.5" fill="none"/>'
    )
    d.dot(BATTERY, 440, 90)
    d.dot(SIGNAL, 440, 500)


def imu(d: Drawing) -> None:
    """The IMU behind its level shifter."""
    row = 430 + 170  # the Mega's 5V
    d.box(30, row - 40, 130, 180, "MPU-9250")
    d.box(240, row - 40, 150, 150, "level shifter")
    names = ("power", "sda", "scl")
    for place, (name, imu, low, high) in enumerate(
        zip(names, ("VCC", "SDA", "SCL"), ("LV", "LV1", "LV2"), ("HV", "HV1", "HV2"), strict=True)
    ):
        y, color = row + PITCH * place, FIVE if name == "power" else SIGNAL
        d.pin(f"imu.{name}", 160, y, imu, -1)
        d.pin(f"low.{name}", 240, y, low, 1)
        d.pin(f"high.{name}", 390, y, high, -1)
        d.line(color, f"imu.{name}", f"low.{name}")
        d.line(color, f"high.{name}", f"mega.{'5V' if name == 'power' else name}")
    d.column("imu", 160, row + 3 * PITCH, -1, "GND")
    d.pin("imu.ad0", 160, row + 4 * PITCH, "AD0", -1)
    d.earth(160, row + 4 * PITCH, 1)
    d.column("low", 240, row + 3 * PITCH, 1, "GND")
    d.places["joint"] = 205, row
    d.line(FIVE, "mega.3.3V", 445, 770, 205, "joint", name="3.3 V to level shifter and IMU")
    d.dot(FIVE, 205, row)


def wheels(d: Drawing, pin: dict[str, str]) -> None:
    """Motor driver and motors with their encoders."""
    left, right, top = 860, 1030, 430
    d.box(left, top, right - left, 260, "motor driver", "TB6612FNG")
    labels = ("PWMA", "AIN1", "AIN2", "PWMB", "BIN1", "BIN2", "VCC, STBY")
    d.column("driver", left, top + 70, 1, *labels)
    d.column("driver", left, top + 70 + 7 * PITCH - 8, 1, "GND")
    motors = [pin[f"MOTOR_{side}_{what}"] for side in ("LEFT", "RIGHT") for what in ("PWM", "IN1", "IN2")]
    for number, label in zip(motors, labels, strict=False):
        d.line(SIGNAL, f"mega.{number}", f"driver.{label}")
    d.line(FIVE, "mega.driver 5V", "driver.VCC, STBY")
    d.pin("driver.vm", 945, top, "", 2)
    d.text(955, top - 8, "VM", size=12)
    d.line(BATTERY, "tap", 440, 20, 800, 395, 945, "driver.vm", name="battery to motor driver")
    d.column("driver", right, top + 70, -1, "AO1", "AO2")
    d.column("driver", right, top + 148, -1, "BO1", "BO2")
    for side, y, outs in (("left", 430, ("AO1", "AO2")), ("right", 670, ("BO1", "BO2"))):
        d.box(1180, y, 190, 214, f"{side} motor", "with encoder")
        d.column(f"{side} motor", 1180, y + 70, 1, "M1", "M2", "A", "B", "5V", "GND")
        for row, (out, end) in enumerate(zip(outs, ("M1", "M2"), strict=True)):
            d.line(MOTOR, f"driver.{out}", 1070 - 15 * row, f"{side} motor.{end}")
    for row, (side, channel) in enumerate((s, c) for s in ("left", "right") for c in "AB"):
        number = pin[f"ENCODER_{side.upper()}_{channel}"]
        turn = 1105 + 15 * row if side == "left" else 1150 - 15 * row
        d.line(SIGNAL, f"mega.{number}", turn, f"{side} motor.{channel}")
    d.line(FIVE, "mega.encoder 5V", 1150, "left motor.5V")
    d.line(FIVE, "mega.encoder 5V", 1150, "right motor.5V")
    d.dot(FIVE, 1150, d.places["mega.encoder 5V"][1])


def draw(config: str) -> str:
    """Give the picture for a header's text."""
    pin, d = pins(config), Drawing()
    power(d)
    computer(d)
    mega(d, pin)
    divider(d, pin)
    imu(d)
    wheels(d, pin)
    for row, (color, meaning) in enumerate(MEANING.items()):
        y = 860 - 18 * len(MEANING) + 18 * row
        d.parts.append(f'<path d="M40 {y}h40" stroke="{color}" stroke-width="2.2"/>')
        d.text(90, y + 4, meaning, size=12)
    d.text(
        500, 868, "The grounds of all parts are joined; those of the Raspberry Pi, the X4 and the Mega by USB.", size=12
    )
    return d.svg(1400, 900)


if __name__ == "__main__":
    PICTURE.write_text(draw(CONFIG.read_text()))
