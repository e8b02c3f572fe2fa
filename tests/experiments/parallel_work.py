"""Pieces of work for other processes, which must find them by name."""

import os
import time

from contourslam.errors import MissingExtraError


def count_to_three(item, step):
    done = 0
    for _ in range(3):
        done += 1
        if not step():
            break
    return item, done


def slow_steps(item, step):
    done = 0
    while done < 200:
        time.sleep(0.02)
        done += 1
        if not step():
            break
    return item, done


def fail(item, step):
    if item == 1:
        raise MissingExtraError("not installed")
    return item


def die(item, step):
    os._exit(1)


def interrupt(item, step):
    if item == 1:
        raise KeyboardInterrupt
    return item
