"""Save two maps in turn and be killed, so many times: argv are a folder, how many times, and a seed.

A process that has loaded everything makes a child that saves, kills it at a moment of chance, and reads what is there.
"""

import json
import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from contourslam.maps import Contoured, SavedMap, load_map, save_map
from contourslam.slam.landmark_map import CornerMap, WallMap


def a_map(seed: int) -> SavedMap:
    rng = np.random.default_rng(seed)
    none, whole = np.zeros(0), np.zeros(0, np.int64)
    corners = CornerMap(whole, none.reshape(0, 2), none.reshape(0, 2, 2), none, none, whole > 0, whole, whole)
    walls = WallMap(whole, none.reshape(0, 2, 2), none.reshape(0, 2, 2, 2), none, none.reshape(0, 2, 2), whole, whole)
    k, n = 200, 20_000
    keyframes = Contoured(
        np.arange(k, dtype=float), rng.normal(size=(k, 3)), np.tile(np.eye(3), (k, 1, 1)), np.zeros(k),
        np.linspace(0, n, k + 1).astype(np.int64), rng.normal(size=(n, 4)).astype(np.float32), np.zeros(k, np.int64),
    )  # fmt: skip
    return SavedMap(corners, walls, keyframes)


def save_for_ever(path: Path, maps: list[SavedMap], number: int) -> None:
    while True:
        number += 1
        save_map(path, replace(maps[number % 2], about={"number": str(number)}))


def main(folder: Path, kills: int, seed: int) -> None:
    path, rng = folder / "map.cmap", np.random.default_rng(seed)
    maps = [a_map(0), a_map(1)]
    save_map(path, replace(maps[0], about={"number": "0"}))
    numbers, longest = [0], 0.02
    for _ in range(kills):
        child = os.fork()
        if child == 0:
            save_for_ever(path, maps, numbers[-1])
        time.sleep(rng.uniform(0.0, longest))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        found = load_map(path)
        number = int(found.about["number"])
        if number < numbers[-1]:
            raise AssertionError(f"map {number} came after map {numbers[-1]}")
        is_, was = found.keyframes, maps[number % 2].keyframes
        if is_ is None or was is None or not np.array_equal(is_.points, was.points):
            raise AssertionError(f"map {number} is mixed")
        longest *= 1.1 if number == numbers[-1] else 0.9  # so that about every other one gets done
        numbers.append(number)
    left = len([entry for entry in folder.iterdir() if entry != path])
    sys.stdout.write(json.dumps({"kills": kills, "saves": numbers[-1], "left": left}))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
