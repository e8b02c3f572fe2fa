"""Whether maps are joined that overlap, and only those: pairs that are related and pairs that are not.

The maps are made once and kept in the folder that --maps names, so that a rerun only judges the pairs anew. The limits
of a verdict were set on seed 0. With any other seed all buildings, drives and furniture are others and the logs are cut
at other times: pairs that were held out. Of these nothing is written into documents.
"""

import argparse
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
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
from contourslam.experiments.look_alike_rooms import bare_room, furnished_anew, half_turn_room
from contourslam.experiments.relocalisation import OFFICE_WAY, refurnished
from contourslam.replay import replay
from contourslam.simulation.buildings import office_building
from contourslam.simulation.rooms import FURNISHED_ROOM, OFFICE_CORRIDOR
from logs import Log, find_logs
from table import ROOT, Table, publish

CORRIDORS, BUILDINGS, DAYS = 10, 8, 4
PARTS = {"intel": 3, "mit_csail": 2, "aces": 2, "acapulco": 2}
PIECES = ((0.0, 25.0), (12.5, 37.5), (25.0, 50.0), (50.0, 75.0))  # m of way
FURTHER, CUT = 1000, 0.1  # between the seeds of two runs of all this; by which cuts of logs move, of the whole
SHORT, SEED = 300, 1  # pairs of pieces of different buildings; of which they are
TOWERS, COUNTS = 6, (8, 6, 5, 4)  # pairs of storeys, flats or turned rooms; doors a side
BEGUN = (8.0, 12.0, 16.0, 20.0)  # m of way
SHARES = (0.0, 3.0, 6.0, 10.0, 15.0, 25.0)  # m of way that two pieces share
PIECES_OF_ONE = "pieces of 25 m that share"

Pair = tuple[Mapped, Mapped]
UNRELATED = ("unrelated maps", "pairs", "joined", "closest call", "its doubt", "CPU s, mean / most")
ALIKE = ("built to one plan", "pairs", "joined", "apart", "contradicted, least / most (%)", "its doubt, least / most")
VIEW = 8.0  # m of way; two drives that share less have seen little of each other's
RELATED = (
    "maps of one building",
    "pairs",
    f"share {VIEW:.0f} m of way",
    "joined",
    "joined wrongly",
    "apart",
    "ties off, median / 99 % (m)",
    "CPU s",
)


class Maps:
    """All maps by name, made when first asked for."""

    def __init__(self, folder: Path, seed: int = 0) -> None:
        self.folder, self.seed = (folder / f"seed_{seed}" if seed else folder), seed
        self.first = FURTHER * seed  # of the seeds of all that is drawn
        self.logs = {log.name: log for log in find_logs() if log.name in PARTS}
        self._made: dict[str, Mapped] = {}

    def of(self, drives: Iterable[Drive]) -> list[Mapped]:
        """Give the maps of drives."""
        return [self._made.setdefault(drive.name, mapped(drive, self.folder)) for drive in drives]

    def corridors(self, *, again: bool = False) -> list[Mapped]:
        """Ten corridors of one kind; half of them with half of the doors open, the others with a quarter."""
        end, drives = DOORS * PITCH, []
        for seed in range(CORRIDORS):
            room = corridor(self.first + seed, opened=0.5 if seed < CORRIDORS // 2 else 0.25)
            ways = ((1.0, 0.0), (end - 1.0, 0.1), (3.0, -0.1)), ((end - 4.0, 0.0), (1.5, 0.1), (end - 2.0, -0.1))
            name = f"corridor_{seed}_again" if again else f"corridor_{seed}"
            drives.append(room_drive(name, f"corridor {seed}", room, ways[again], self.first + seed + 100 * again))
        return self.of(drives)

    def offices(self, which: str, *, mirror: bool = False) -> list[Mapped]:
        """100 m through each of eight office floors: `a` from the first junction on, `b` elsewhere and later."""
        seeds, start = (range(BUILDINGS), 0.0) if which == "a" else (range(50, 50 + BUILDINGS), 30.0)
        drives = []
        for number, seed in enumerate(seeds):
            building = office_building(4, self.first + number)
            way = part_of(touring(building, self.first + seed), start, start + 100.0)
            name = f"office_{number}_{which}"
            drive = room_drive(name, f"office {number}", building.room, way, self.first + seed)
            drives.append(mirrored(drive) if mirror else drive)
        return self.of(drives)

    def parts(self, log: Log) -> list[Drive]:
        """Parts of a log, with the poses of a run over all of it for the truth."""
        kept = self.folder / f"{log.name}_whole.npz"
        if not kept.exists():
            whole = replay(log.messages, CONFIG)
            np.savez(kept, stamps=whole.stamps, poses=whole.poses)
        edges = np.linspace(0.0, 1.0, PARTS[log.name] + 1)
        if self.seed:
            edges[1:-1] += np.random.default_rng(self.seed).uniform(-CUT, CUT, len(edges) - 2)
        with np.load(kept) as whole:
            return parts_of_log(log.name, log.messages, whole["stamps"], whole["poses"], edges)


def images(maps: Maps) -> list[Pair]:
    pairs = list(zip(maps.offices("a"), maps.offices("a", mirror=True), strict=True))
    firsts = [maps.parts(log)[0] for log in maps.logs.values()]
    return pairs + [(maps.of([part])[0], maps.of([mirrored(part)])[0]) for part in firsts]


def different_logs(maps: Maps) -> list[Pair]:
    logs = [maps.of(maps.parts(log)) for log in maps.logs.values()]
    return [pair for one, other in combinations(logs, 2) for pair in product(one, other)]


def short_pieces(maps: Maps) -> list[Pair]:
    pieces = [piece(whole, *part) for whole in (*maps.offices("a"), *maps.offices("b")) for part in PIECES]
    others = [pair for pair in combinations(pieces, 2) if pair[0].building != pair[1].building]
    chosen = np.random.default_rng(SEED + maps.first).choice(len(others), SHORT, replace=False)
    return [others[k] for k in sorted(chosen.tolist())]


def beginnings(maps: Maps, length: float) -> list[Pair]:
    """Maps of robots that have just begun, as a fleet's server holds them against each other."""
    wholes = [*maps.corridors(), *maps.offices("a")]
    return list(combinations([piece(whole, 0.0, length) for whole in wholes], 2))


def tower(maps: Maps, opened: float) -> list[Pair]:
    """Corridors of two storeys each, alike but for the furniture behind the doors that are open."""
    end, pairs = DOORS * PITCH, []
    ways = (((1.0, 0.0), (end - 1.0, 0.1), (3.0, -0.1)), ((end - 4.0, 0.0), (1.5, 0.1), (end - 2.0, -0.1)))
    for number in range(TOWERS):
        drives = []
        for storey, way in enumerate(ways):
            seed, name = maps.first + number, f"tower_{number}_{opened:.0%}_storey_{storey}"
            drives.append(
                room_drive(name, name, corridor(seed, opened=opened, storey=storey), way, seed + 500 * storey)
            )
        one, other = maps.of(drives)
        pairs.append((one, other))
    return pairs


def other_counts(maps: Maps) -> list[Pair]:
    """Corridors whose doors are as far apart and all closed, but fewer: all that tells them apart is where they end."""
    drives = []
    for doors in COUNTS:
        end, seed = doors * PITCH, maps.first + doors
        way = ((1.0, 0.0), (end - 1.0, 0.1), (3.0, -0.1))
        room = corridor(seed, opened=0.0, doors=doors, storey=0)
        drives.append(room_drive(f"doors_{doors}", f"doors {doors}", room, way, seed))
    return list(combinations(maps.of(drives), 2))


def two_of(maps: Maps, name: str) -> list[Pair]:
    """Two drives each through rooms that are their own half turn."""
    drives = []
    for number in range(1 if name == "bare" else TOWERS):
        room = bare_room() if name == "bare" else half_turn_room(maps.first + number)
        back = tuple(room.route[0:1] + room.route[:0:-1])
        ways = (room.route + room.route[:2], back + back[:1])
        drives += [
            room_drive(f"{name}_{number}_{day}", f"{name} {number}", room, way, maps.first + 10 * number + day)
            for day, way in enumerate(ways)
        ]
    made = maps.of(drives)
    return list(zip(made[::2], made[1::2], strict=True))


def furnished_twice(maps: Maps, share: float) -> list[Pair]:
    """Rooms of one plan of which so many pieces of furniture are others: what people would call another flat."""
    room = FURNISHED_ROOM
    drives = [
        room_drive(
            f"furnished_{share:.0%}_{number}", f"flat {number}",
            furnished_anew(room, share if number else 0.0, maps.first + number), room.route, maps.first + 70 + number,
        )
        for number in range(1 + TOWERS)
    ]  # fmt: skip
    base, *others = maps.of(drives)
    return [(base, other) for other in others]


ALIKE_SETS: Mapping[str, Callable[[Maps], list[Pair]]] = {
    **{
        f"two storeys of one plan, {opened:.0%} of the doors open": partial(tower, opened=opened)
        for opened in (1.0, 0.5, 0.25, 0.0)
    },
    "corridors with as many doors a metre, but fewer": other_counts,
    **{
        f"flats of one plan, {share:.0%} of the furniture other": partial(furnished_twice, share=share)
        for share in (1.0, 0.7, 0.4)
    },
    "a bare room, twice": partial(two_of, name="bare"),
    "rooms that are their own half turn, twice": partial(two_of, name="half_turn"),
}

UNRELATED_SETS: Mapping[str, Callable[[Maps], list[Pair]]] = {
    "corridors that look alike": lambda maps: list(combinations(maps.corridors(), 2)),
    "office floors that look alike, 100 m of way": lambda maps: list(combinations(maps.offices("a"), 2)),
    "maps and their mirror images": images,
    "parts of different logs": different_logs,
    "pieces of 25 m of different office floors": short_pieces,
    **{
        f"the first {length:.0f} m in different corridors and offices": partial(beginnings, length=length)
        for length in BEGUN
    },
}


def moved_furniture(maps: Maps) -> list[Pair]:
    pairs: list[Pair] = []
    for room, way in ((OFFICE_CORRIDOR, OFFICE_WAY), (FURNISHED_ROOM, FURNISHED_ROOM.route)):
        base = room_drive(f"{room.name}_0", room.name, room, way, maps.first)
        later = [
            room_drive(
                f"{room.name}_refurnished_{day}", room.name, refurnished(room, maps.first + day), way[::-1],
                maps.first + day + 1,
            )
            for day in range(DAYS)
        ]  # fmt: skip
        pairs += list(product(maps.of([base]), maps.of(later)))
    return pairs


def parts_of_one(maps: Maps, name: str) -> list[Pair]:
    return list(combinations(maps.of(maps.parts(maps.logs[name])), 2)) if name in maps.logs else []


RELATED_SETS: Mapping[str, Callable[[Maps], list[Pair]]] = {
    **{f"{name}, {parts} parts by time": partial(parts_of_one, name=name) for name, parts in PARTS.items()},
    "corridors, driven from either end": lambda maps: list(
        zip(maps.corridors(), maps.corridors(again=True), strict=True)
    ),
    "office floors, two drives of 100 m": lambda maps: list(zip(maps.offices("a"), maps.offices("b"), strict=True)),
    "rooms with 2 in 5 pieces of furniture moved": moved_furniture,
}


def pieces_of_one(maps: Maps) -> dict[str, list[Verdict]]:
    """Pieces of two drives in one office floor, by the way that they share."""
    verdicts = [
        judge(piece(one, *part), piece(other, *another))
        for one, other in zip(maps.offices("a"), maps.offices("b"), strict=True)
        for part, another in product(PIECES, PIECES)
    ]
    found = {f"{PIECES_OF_ONE} no way": [v for v in verdicts if v.shared == 0.0]}
    for low, high in pairwise(SHARES):
        found[f"{PIECES_OF_ONE} {low:.0f} to {high:.0f} m"] = [v for v in verdicts if low < v.shared <= high]
    return found


def apart(verdicts: Sequence[Verdict]) -> list[object]:
    nearest = min(verdicts, key=lambda verdict: verdict.hurdle)
    seconds = [verdict.seconds for verdict in verdicts]
    return [
        len(verdicts), sum(verdict.joined for verdict in verdicts), f"{nearest.first}, {nearest.second}",
        f"{nearest.hurdle:.2f}", f"{np.mean(seconds):.1f} / {max(seconds):.1f}",
    ]  # fmt: skip


def told_apart(verdicts: Sequence[Verdict]) -> list[object]:
    through = [100.0 * v.evidence.contradicted for v in verdicts if v.evidence is not None] or [math.nan]
    hurdles = [verdict.hurdle for verdict in verdicts]
    return [
        len(verdicts), sum(verdict.joined for verdict in verdicts), _why(verdicts),
        f"{min(through):.1f} / {max(through):.1f}", f"{min(hurdles):.2f} / {max(hurdles):.2f}",
    ]  # fmt: skip


def _why(verdicts: Sequence[Verdict]) -> str:
    reasons = [verdict.reason for verdict in verdicts if not verdict.joined]
    return ", ".join(f"{reasons.count(reason)} {reason}" for reason in sorted(set(reasons))) or "-"


def together(verdicts: Sequence[Verdict]) -> list[object]:
    right = [verdict for verdict in verdicts if verdict.joined and not verdict.false]
    errors = np.concatenate([verdict.errors for verdict in right]) if right else np.full(1, np.nan)
    off = f"{np.median(errors):.3f} / {np.percentile(errors, 99):.3f}" if right else "-"
    wrong = sum(verdict.false for verdict in verdicts)
    return [
        len(verdicts),
        sum(verdict.shared >= VIEW for verdict in verdicts),
        len(right),
        wrong,
        _why(verdicts),
        off,
        f"{np.mean([verdict.seconds for verdict in verdicts]):.1f}",
    ]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--maps", type=Path, default=ROOT / "out" / "joinable_maps", help="folder for the maps")
    options.add_argument("--seed", type=int, default=0, help="of all that is drawn; 0 are the pairs of the documents")
    options.add_argument("--only", default="", metavar="TEXT", help="only sets of pairs whose names hold this")
    options.add_argument("--write", action="store_true", help="put the tables into the documents")
    chosen = options.parse_args()
    if chosen.write and (chosen.seed or chosen.only):
        options.error("--write is for all pairs of seed 0")
    maps = Maps(chosen.maps, chosen.seed)
    maps.folder.mkdir(parents=True, exist_ok=True)
    judge(*maps.corridors()[:2])  # what is compiled at the first call
    rows: list[list[object]] = []
    alike: list[list[object]] = []
    for name, pairs_of in UNRELATED_SETS.items():
        pairs = pairs_of(maps) if chosen.only in name else []
        if pairs:
            rows.append([name, *apart([judge(*pair) for pair in pairs])])
            print(*rows[-1], flush=True)
    for name, pairs_of in ALIKE_SETS.items():
        pairs = pairs_of(maps) if chosen.only in name else []
        if pairs:
            alike.append([name, *told_apart([judge(*pair) for pair in pairs])])
            print(*alike[-1], flush=True)
    further: list[list[object]] = []
    for name, pairs_of in RELATED_SETS.items():
        pairs = pairs_of(maps) if chosen.only in name else []
        if pairs:
            further.append([name, *together([judge(*pair) for pair in pairs])])
            print(*further[-1], flush=True)
    for name, verdicts in pieces_of_one(maps).items() if chosen.only in PIECES_OF_ONE else ():
        if not verdicts:  # no two pieces happen to share so much
            continue
        further.append([name, *together(verdicts)])
        print(*further[-1], flush=True)
    if not (chosen.seed or chosen.only):
        publish(Table("joining", UNRELATED, rows))
        publish(Table("joining_alike", ALIKE, alike))
        publish(Table("joining_related", RELATED, further))


if __name__ == "__main__":
    main()
