"""Whether maps are joined that overlap, and only those: pairs that are related and pairs that are not.

The maps are made once and kept in the folder that --maps names, so that a rerun only judges the pairs anew.
"""

import argparse
from collections.abc import Iterable, Sequence
from itertools import combinations, pairwise, product
from pathlib import Path

import numpy as np

from contourslam.experiments.joinable_maps import (
    CONFIG,
    DOORS,
    PITCH,
    Drive,
    Mapped,
    corridor,
    mapped,
    mirrored,
    part_of,
    parts_of_log,
    room_drive,
    touring,
)
from contourslam.experiments.joining import Verdict, judge, piece
from contourslam.experiments.relocalisation import OFFICE_WAY, refurnished
from contourslam.replay import replay
from contourslam.simulation.buildings import office_building
from contourslam.simulation.rooms import FURNISHED_ROOM, OFFICE_CORRIDOR
from logs import Log, find_logs
from table import ROOT, Table, publish

CORRIDORS, BUILDINGS, DAYS = 10, 8, 4
PARTS = {"intel": 3, "mit_csail": 2, "aces": 2, "acapulco": 2}
PIECES = ((0.0, 25.0), (12.5, 37.5), (25.0, 50.0), (50.0, 75.0))  # m of way
SHORT, SEED = 300, 1  # pairs of pieces of different buildings; of which they are
SHARES = (0.0, 3.0, 6.0, 10.0, 15.0, 25.0)  # m of way that two pieces share

Pair = tuple[Mapped, Mapped]
UNRELATED = ("unrelated maps", "pairs", "joined", "closest call", "its doubt", "CPU s, mean / most")
RELATED = ("maps of one building", "pairs", "joined", "joined wrongly", "apart", "ties off, median / 99 % (m)", "CPU s")


class Maps:
    """All maps by name, made when first asked for."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.logs = {log.name: log for log in find_logs() if log.name in PARTS}
        self._made: dict[str, Mapped] = {}

    def of(self, drives: Iterable[Drive]) -> list[Mapped]:
        """Give the maps of drives."""
        return [self._made.setdefault(drive.name, mapped(drive, self.folder)) for drive in drives]

    def corridors(self, *, again: bool = False) -> list[Mapped]:
        """Ten corridors of one kind; half of them with half of the doors open, the others with a quarter."""
        end, drives = DOORS * PITCH, []
        for seed in range(CORRIDORS):
            room = corridor(seed, opened=0.5 if seed < CORRIDORS // 2 else 0.25)
            ways = ((1.0, 0.0), (end - 1.0, 0.1), (3.0, -0.1)), ((end - 4.0, 0.0), (1.5, 0.1), (end - 2.0, -0.1))
            name = f"corridor_{seed}_again" if again else f"corridor_{seed}"
            drives.append(room_drive(name, f"corridor {seed}", room, ways[again], seed + 100 * again))
        return self.of(drives)

    def offices(self, which: str, *, mirror: bool = False) -> list[Mapped]:
        """100 m through each of eight office floors: `a` from the first junction on, `b` elsewhere and later."""
        seeds, start = (range(BUILDINGS), 0.0) if which == "a" else (range(50, 50 + BUILDINGS), 30.0)
        drives = []
        for number, seed in enumerate(seeds):
            building = office_building(4, number)
            way = part_of(touring(building, seed), start, start + 100.0)
            drive = room_drive(f"office_{number}_{which}", f"office {number}", building.room, way, seed)
            drives.append(mirrored(drive) if mirror else drive)
        return self.of(drives)

    def parts(self, log: Log) -> list[Drive]:
        """Parts of a log, with the poses of a run over all of it for the truth."""
        kept = self.folder / f"{log.name}_whole.npz"
        if not kept.exists():
            whole = replay(log.messages, CONFIG)
            np.savez(kept, stamps=whole.stamps, poses=whole.poses)
        with np.load(kept) as whole:
            return parts_of_log(log.name, log.messages, whole["stamps"], whole["poses"], PARTS[log.name])


def unrelated(maps: Maps) -> dict[str, list[Pair]]:
    offices = maps.offices("a")
    logs = {name: maps.parts(log) for name, log in maps.logs.items()}
    images = list(zip(offices, maps.offices("a", mirror=True), strict=True))
    images += [(maps.of(parts[:1])[0], maps.of([mirrored(parts[0])])[0]) for parts in logs.values()]
    pieces = [piece(whole, *part) for whole in (*offices, *maps.offices("b")) for part in PIECES]
    others = [pair for pair in combinations(pieces, 2) if pair[0].building != pair[1].building]
    chosen = np.random.default_rng(SEED).choice(len(others), SHORT, replace=False)
    return {
        "corridors that look alike": list(combinations(maps.corridors(), 2)),
        "office floors that look alike, 100 m of way": list(combinations(offices, 2)),
        "maps and their mirror images": images,
        "parts of different logs": [
            pair for one, other in combinations(logs.values(), 2) for pair in product(maps.of(one), maps.of(other))
        ],
        "pieces of 25 m of different office floors": [others[k] for k in sorted(chosen.tolist())],
    }


def related(maps: Maps) -> dict[str, list[Pair]]:
    found: dict[str, list[Pair]] = {}
    for name, log in maps.logs.items():
        found[f"{name}, {PARTS[name]} parts by time"] = list(combinations(maps.of(maps.parts(log)), 2))
    found["corridors, driven from either end"] = list(zip(maps.corridors(), maps.corridors(again=True), strict=True))
    found["office floors, two drives of 100 m"] = list(zip(maps.offices("a"), maps.offices("b"), strict=True))
    days: list[Pair] = []
    for room, way in ((OFFICE_CORRIDOR, OFFICE_WAY), (FURNISHED_ROOM, FURNISHED_ROOM.route)):
        base = room_drive(f"{room.name}_0", room.name, room, way, 0)
        later = [
            room_drive(f"{room.name}_refurnished_{day}", room.name, refurnished(room, day), way[::-1], day + 1)
            for day in range(DAYS)
        ]
        days += list(product(maps.of([base]), maps.of(later)))
    found["rooms with 2 in 5 pieces of furniture moved"] = days
    return found


def pieces_of_one(maps: Maps) -> dict[str, list[Verdict]]:
    """Pieces of two drives in one office floor, by the way that they share."""
    verdicts = [
        judge(piece(one, *part), piece(other, *another))
        for one, other in zip(maps.offices("a"), maps.offices("b"), strict=True)
        for part, another in product(PIECES, PIECES)
    ]
    found = {"pieces of 25 m that share no way": [v for v in verdicts if v.shared == 0.0]}
    for low, high in pairwise(SHARES):
        found[f"pieces of 25 m that share {low:.0f} to {high:.0f} m"] = [v for v in verdicts if low < v.shared <= high]
    return found


def apart(verdicts: Sequence[Verdict]) -> list[object]:
    nearest = min(verdicts, key=lambda verdict: verdict.hurdle)
    seconds = [verdict.seconds for verdict in verdicts]
    return [
        len(verdicts), sum(verdict.joined for verdict in verdicts), f"{nearest.first}, {nearest.second}",
        f"{nearest.hurdle:.2f}", f"{np.mean(seconds):.1f} / {max(seconds):.1f}",
    ]  # fmt: skip


def together(verdicts: Sequence[Verdict]) -> list[object]:
    right = [verdict for verdict in verdicts if verdict.joined and not verdict.false]
    errors = np.concatenate([verdict.errors for verdict in right]) if right else np.full(1, np.nan)
    reasons = [verdict.reason for verdict in verdicts if not verdict.joined]
    why = ", ".join(f"{reasons.count(reason)} {reason}" for reason in sorted(set(reasons))) or "-"
    off = f"{np.median(errors):.3f} / {np.percentile(errors, 99):.3f}" if right else "-"
    wrong = sum(verdict.false for verdict in verdicts)
    return [len(verdicts), len(right), wrong, why, off, f"{np.mean([verdict.seconds for verdict in verdicts]):.1f}"]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--maps", type=Path, default=ROOT / "out" / "joinable_maps", help="folder for the maps")
    options.add_argument("--write", action="store_true", help="put the tables into the documents")
    maps = Maps(options.parse_args().maps)
    maps.folder.mkdir(parents=True, exist_ok=True)
    judge(*maps.corridors()[:2])  # what is compiled at the first call
    rows: list[list[object]] = []
    for name, pairs in unrelated(maps).items():
        rows.append([name, *apart([judge(*pair) for pair in pairs])])
        print(*rows[-1], flush=True)
    publish(Table("joining", UNRELATED, rows))
    rows = []
    for name, pairs in related(maps).items():
        rows.append([name, *together([judge(*pair) for pair in pairs])])
        print(*rows[-1], flush=True)
    for name, verdicts in pieces_of_one(maps).items():
        rows.append([name, *together(verdicts)])
        print(*rows[-1], flush=True)
    publish(Table("joining_related", RELATED, rows))


if __name__ == "__main__":
    main()
