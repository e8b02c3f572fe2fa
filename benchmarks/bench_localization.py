"""Finding a robot in a known map from one scan, without a first guess."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.experiments.relocalisation import (
    MOUNT,
    OFFICE_WAY,
    Query,
    Score,
    drive_through,
    judge,
    map_of,
    refurnished,
    scans_at_random,
)
from contourslam.geometry.poses import between_one, compose_one
from contourslam.localization.known_map import KnownMap
from contourslam.localization.locate import Locator
from contourslam.recordings import Message
from contourslam.replay import replay
from contourslam.scan import LaserScan
from contourslam.simulation.rooms import FURNISHED_ROOM, LARGE_HALL, OFFICE_CORRIDOR
from logs import Log, find_logs
from table import Table, publish

Floats = NDArray[np.float64]

CONFIG = Config(back_end="graph")
COUNT, SEED = 200, 7
MAPPED = 0.6  # of intel's scans; the later ones are looked for ...
ON_THE_WAY = 0.5  # ... where the robot has been this near before, m
WAYS = (
    (FURNISHED_ROOM, FURNISHED_ROOM.route * 2),
    (OFFICE_CORRIDOR, OFFICE_WAY),
    (LARGE_HALL, LARGE_HALL.route * 2),
)
STILL = np.zeros(3)
COLUMNS = (
    "scans looked for",
    "in the map of",
    "scans",
    "found within 0.10 m and 2°",
    "sure",
    "sure and wrong",
    "CPU ms, median / 99 %",
)


@dataclass(frozen=True)
class Place:
    """A map with the mount of the lidar that its own scans have."""

    name: str
    locator: Locator
    own: dict[str, list[Query]]
    mount: Floats


def simulated() -> list[Place]:
    places = []
    for room, way in WAYS:
        saved = map_of(drive_through(room, way, SEED), CONFIG, MOUNT)
        changed = [refurnished(room, seed) for seed in range(5)]
        own = {}
        for degrees in (360.0, 180.0):
            lidar = f"{degrees:.0f}°"
            own[f"{room.name}, {lidar}"] = scans_at_random(room, COUNT, SEED, field_of_view_deg=degrees)
            own[f"{room.name}, refurnished, {lidar}"] = [
                query
                for seed, other in enumerate(changed)
                for query in scans_at_random(other, COUNT // 5, seed, mapped=room, field_of_view_deg=degrees)
            ]
        places.append(Place(room.name, Locator(KnownMap(saved)), own, MOUNT))
    return places


def later_scans(log: Log) -> Place:
    """The beginning of a log as the map, its later scans to be found; the truth is the refined run over all of it."""
    scans = [message for message in log.messages if isinstance(message, LaserScan)]
    count = int(MAPPED * len(scans))
    beginning = _until(log.messages, count)
    saved = map_of(beginning, CONFIG, None)
    first, whole = replay(beginning, CONFIG).poses, replay(log.messages, CONFIG).poses
    queries: list[Query] = []
    for index in np.random.default_rng(SEED).permutation(np.arange(count, len(scans))).tolist():
        away = np.hypot(*(whole[:count, :2] - whole[index, :2]).T)
        near = int(away.argmin())
        if away[near] < ON_THE_WAY:
            queries.append(Query(scans[index], compose_one(first[near], between_one(whole[near], whole[index]))))
        if len(queries) == COUNT:
            break
    return Place(log.name, Locator(KnownMap(saved)), {f"{log.name}, later scans, 180°": queries}, STILL)


def _until(messages: list[Message], scans: int) -> list[Message]:
    ends = [i for i, message in enumerate(messages) if isinstance(message, LaserScan)]
    return messages[: ends[scans - 1] + 1]


def row(what: str, where: str, score: Score, *, elsewhere: bool = False) -> list[object]:
    times = np.percentile(score.milliseconds, (50, 99))
    share = "-" if elsewhere else f"{100 * score.found / score.queries:.1f} %"
    sure, wrong = (f"{100 * n / score.queries:.1f} %" for n in (score.confident, score.wrong))
    return [what, where, score.queries, share, sure, wrong, f"{times[0]:.0f} / {times[1]:.0f}"]


def main() -> None:
    places, rows = simulated(), []
    logs = {log.name: log for log in find_logs()}
    if "intel" in logs:
        places.append(later_scans(logs["intel"]))
    for place in places:
        own = next(iter(place.own.values()))
        judge(place.locator, own[:3], CONFIG, place.mount)  # what is made ready at the first call
        for name, queries in place.own.items():
            rows.append(row(name, place.name, judge(place.locator, queries, CONFIG, place.mount)))
            print(*rows[-1], flush=True)
    for place in places:
        total: list[Score] = []
        for other in places:
            if other is not place:
                strange = [Query(q.scan, None) for queries in other.own.values() for q in queries[::5]]
                total.append(judge(place.locator, strange, CONFIG, other.mount))
        together = Score(
            sum(s.queries for s in total), 0, sum(s.confident for s in total), sum(s.wrong for s in total),
            np.concatenate([s.milliseconds for s in total]),
        )  # fmt: skip
        rows.append(row("all of the others", place.name, together, elsewhere=True))
    publish(Table("localization", COLUMNS, rows))


if __name__ == "__main__":
    main()
