"""Recipes of a worker that warms up: what it did before its jobs. Worker processes import this module by name."""

import gc
import time

_done: list[str] = []


def first():
    _done.append("first")


def broken():
    _done.append("broken")
    raise RuntimeError("a warm-up that fails")


def slow():
    time.sleep(0.3)
    _done.append("slow")


def told(parents, settings, progress):
    return " ".join(_done).encode()


def passed_over(parents, settings, progress):
    return b"%d" % gc.get_freeze_count()


WARM_UPS = (first, broken, slow)
RECIPES = {"told": told, "passed_over": passed_over}
