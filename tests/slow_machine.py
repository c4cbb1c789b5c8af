"""Machine whose time passes only while it waits or computes, as slowly as a test says: the same on any machine.

Robots on it have a real clock, not a lockstep one; nothing depends on the machine that the test runs on.
"""

from __future__ import annotations

import asyncio
import selectors
import time
from collections.abc import Callable, Coroutine
from types import SimpleNamespace
from typing import Any, TypeVar

import pytest

from roboglot.model import clock
from roboglot.simulation.world.world import World

T = TypeVar("T")


class Hours:
    """Real time that passes only when a test sets it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 1000.0
        monkeypatch.setattr("roboglot.model.clock.time.monotonic", lambda: self.now)


class SlowMachine:
    """Machine on which a tick of a world takes ``tick`` real seconds, and a thread's job ``plan``.

    Time is the real machine's until ``begin``, since kernels are loaded by threads.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, tick: float, plan: float) -> None:
        self._tick, self._plan = tick, plan
        self._patch = monkeypatch
        self._now: float | None = None
        hours = SimpleNamespace(monotonic=self.time, perf_counter=self.time, time=time.time)
        monkeypatch.setattr(clock, "time", hours)

    def time(self) -> float:
        """Return the machine's time, s."""
        return time.monotonic() if self._now is None else self._now

    def begin(self) -> None:
        """Slow down from now on."""
        self._now = time.monotonic()
        tick = World._tick

        def slow_tick(world: World) -> Any:
            self.spend(self._tick)
            return tick(world)

        async def slow_thread(job: Callable[[], T]) -> T:
            result = job()
            await asyncio.sleep(self._plan)
            return result

        self._patch.setattr(World, "_tick", slow_tick)
        self._patch.setattr(asyncio, "to_thread", slow_thread)

    def spend(self, seconds: float) -> None:
        """Let time pass."""
        assert self._now is not None
        self._now += seconds

    def run(self, story: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """Run ``story`` on a loop of this machine."""
        with asyncio.Runner(loop_factory=lambda: _Loop(self)) as runner:
            return runner.run(story())

    def wait(self, seconds: float | None, events: Callable[[float | None], list[Any]]) -> list[Any]:
        """Return the loop's events; where it would sleep, time passes instead."""
        if self._now is None:
            return events(seconds)
        found = events(0)
        assert found or seconds is not None, "nothing will ever happen"
        if not found and seconds:
            self.spend(seconds + 1e-6)
        return found


class _Selector(selectors.DefaultSelector):
    machine: SlowMachine

    def select(self, timeout: float | None = None) -> list[Any]:
        return self.machine.wait(timeout, super().select)


class _Loop(asyncio.SelectorEventLoop):
    def __init__(self, machine: SlowMachine) -> None:
        selector = _Selector()
        selector.machine = machine
        self._machine = machine
        super().__init__(selector)

    def time(self) -> float:
        return self._machine.time()
