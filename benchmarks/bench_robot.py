"""The robot in the loop over five seeds, without a fault and with two: errors, punctuality; 25 minutes."""

import sys

import numpy as np

from contourslam.cli.run import DEFAULTS
from contourslam.experiments.loop_values import FAULTS, Fault, Firmware, LoopConfig, LoopResult
from contourslam.experiments.robot_in_the_loop import robot_in_the_loop
from contourslam.report.loop_page import TARGET, kept
from table import ROOT, Table, publish

SEEDS, SECONDS = 5, 80.0
NAMES: dict[Fault, str] = {
    "none": "none",
    "unplugged": "lidar unplugged for 3 s",
    "damaged": "5 % of serial bytes damaged",
}
COLUMNS = [
    "fault", "RMSE x / y / heading, m, m, rad", "worst seed", "target", "raw odometry", "revised at the end", "scans",
    "way, m", "steps late by 20 ms", "robot's computer", "world",
]  # fmt: skip


def main() -> None:
    firmware = Firmware.built_in(ROOT / "firmware" / "mega" / "build")
    rows, good = [], True
    for fault in FAULTS:
        results = [drive(fault, seed, firmware) for seed in range(1, SEEDS + 1)]
        rows.append(row(fault, results))
        good &= all(kept(result) for result in results)
    publish(Table("robot", COLUMNS, rows))
    if not good:
        raise SystemExit("a seed missed the target")


def drive(fault: Fault, seed: int, firmware: Firmware) -> LoopResult:
    result = robot_in_the_loop(LoopConfig(seed=seed, seconds=SECONDS, fault=fault, settings=DEFAULTS), firmware)
    online = " / ".join(f"{value:.4f}" for value in result.online.values())
    print(
        f"{fault}, seed {seed}: {online}, late {result.late:.2%}, latest {result.record.latest:.3f} s, "
        f"{result.counters}",
        file=sys.stderr, flush=True,
    )  # fmt: skip
    return result


def row(fault: Fault, results: list[LoopResult]) -> list[object]:
    online = np.array([list(result.online.values()) for result in results])
    revised = np.array([list(result.revised.values()) for result in results])
    raw = np.array([list(result.raw.values()) for result in results])
    return [
        NAMES[fault],
        _three(np.sqrt((online**2).mean(axis=0))),
        _three(online.max(axis=0)),
        " / ".join(str(most) for most in TARGET.values()),
        _three(np.sqrt((raw**2).mean(axis=0))),
        _three(np.sqrt((revised**2).mean(axis=0))),
        sum(len(result.run.stamps) for result in results),
        round(sum(result.travelled for result in results)),
        f"{np.mean([result.late for result in results]):.2%}",
        f"{np.mean([result.busy for result in results]):.0%} of a core",
        f"{np.mean([result.record.busy for result in results]):.0%}",
    ]


def _three(values: np.ndarray) -> str:
    return " / ".join(f"{value:.4f}" for value in values)


if __name__ == "__main__":
    main()
