"""Modules that a program can import: time, math, random and numbers.

``time`` runs on the robot's clock, so reading it and waiting are host calls; ``random`` starts from the run's seed.
Only public functions are copied: the real modules stay out of reach.
"""

from __future__ import annotations

import math
import numbers
import os
import random
import time
from collections.abc import Callable
from types import ModuleType
from typing import Any

HostCall = Callable[..., Any]


def build_modules(call: HostCall, seed: int, utc_offset: int) -> dict[str, ModuleType]:
    """Return the modules of one run; ``call(name, *arguments)`` calls the host."""
    return {
        "time": _module("time", _time_members(call, utc_offset)),
        "math": _module("math", _MATH),
        "numbers": _module("numbers", _NUMBERS),
        "random": _module("random", _random_members(seed)),
    }


def _module(name: str, members: dict[str, object]) -> ModuleType:
    module = ModuleType(name)
    module.__dict__.update(members)
    return module


def _public(module: object) -> dict[str, object]:
    return {name: getattr(module, name) for name in dir(module) if not name.startswith("_")}


# Collected once, in the process from which programs are forked.
_MATH = _public(math)
_NUMBERS = {name: getattr(numbers, name) for name in numbers.__all__}
_RANDOM = tuple(_public(random.Random()))


def _random_members(seed: int) -> dict[str, object]:
    generator = random.Random(seed)

    def reseed(a: Any = None) -> None:
        """Seed the generator; without a number from its own state, so that runs stay repeatable."""
        generator.seed(generator.getrandbits(64) if a is None else a)

    members = {name: getattr(generator, name) for name in _RANDOM}
    return {**members, "seed": reseed, "Random": random.Random}


def _time_members(call: HostCall, utc_offset: int) -> dict[str, object]:
    _set_zone(utc_offset)

    def sleep(seconds: float, /) -> None:
        if not isinstance(seconds, (int, float)):
            raise TypeError(f"'{type(seconds).__name__}' object cannot be interpreted as an integer")
        if seconds < 0:
            raise ValueError("sleep length must be non-negative")
        call("time.sleep", seconds)

    def now() -> float:
        return float(call("time.time"))

    def monotonic() -> float:
        return float(call("time.monotonic"))

    def at(convert: Callable[[float], object]) -> Callable[..., object]:
        return lambda seconds=None: convert(now() if seconds is None else seconds)

    def strftime(pattern: str, moment: Any = None, /) -> str:
        return time.strftime(pattern, time.localtime(now()) if moment is None else moment)

    def asctime(moment: Any = None, /) -> str:
        return time.asctime(time.localtime(now()) if moment is None else moment)

    return {
        "sleep": sleep,
        "time": now,
        "time_ns": lambda: int(now() * 1e9),
        "monotonic": monotonic,
        "monotonic_ns": lambda: int(monotonic() * 1e9),
        "perf_counter": monotonic,
        "perf_counter_ns": lambda: int(monotonic() * 1e9),
        "process_time": monotonic,
        "localtime": at(time.localtime),
        "gmtime": at(time.gmtime),
        "ctime": at(time.ctime),
        "strftime": strftime,
        "asctime": asctime,
        "mktime": time.mktime,
        "strptime": time.strptime,
        "struct_time": time.struct_time,
        "timezone": time.timezone,
        "altzone": time.altzone,
        "daylight": time.daylight,
        "tzname": time.tzname,
    }


def _set_zone(utc_offset: int) -> None:
    sign = "-" if utc_offset >= 0 else "+"  # POSIX counts west of UTC
    minutes = abs(utc_offset) // 60
    name = f"UTC{'+' if utc_offset >= 0 else '-'}{minutes // 60:02d}{minutes % 60 or '':>02}" if minutes else "UTC"
    os.environ["TZ"] = f"<{name}>{sign}{minutes // 60:02d}:{minutes % 60:02d}"
    time.tzset()
