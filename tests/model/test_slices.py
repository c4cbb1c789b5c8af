"""Longer jobs and the loop's sockets take turns, on a machine whose time passes when the test says so."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from functools import partial

import pytest

from roboglot.model.clock import RealClock
from roboglot.model.inputs.slices import BEHIND_MAX, IDLE, SERVING, SLICE, TURN, Slices


class Machine:
    """Jobs that take the time that they are said to take, and turns of the loop in which sockets take some."""

    def __init__(self) -> None:
        self.now = 0.0
        self.done: list[str] = []
        self.slices = Slices()

    def job(self, name: str, seconds: float = SLICE) -> None:
        self.done.append(name)
        self.now += seconds

    def add(self, *names: str, seconds: float = SLICE) -> None:
        for name in names:
            self.slices.add(partial(self.job, name, seconds), first=False)

    async def turn(self, served: float = 0.0) -> str:
        """Let the loop serve its sockets for so long, then go on with its turn; return the jobs done in it."""
        before, self.now = len(self.done), self.now + served
        await asyncio.sleep(0)
        return "".join(self.done[before:])


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Machine:
    machine = Machine()
    monkeypatch.setattr("roboglot.model.inputs.slices.time.perf_counter", lambda: machine.now)
    return machine


@pytest.mark.parametrize(("seconds", "turns"), [(SLICE, 4), (0.6 * SLICE, 2), (0.0, 1)])
async def test_jobs_are_done_in_slices(machine: Machine, seconds: float, turns: int) -> None:
    machine.add("c", "d", seconds=seconds)
    clock = RealClock()
    clock._slices = machine.slices

    def steps() -> Iterator[None]:
        for name in "ab":
            machine.job(name, seconds)
            yield

    clock.in_turn(partial(clock.in_steps, steps()), first=True)
    taken = [await machine.turn() for _ in range(turns)]
    assert "".join(taken) == "abcd", "steps are taken to the end before other work"
    assert all(taken)


async def test_first_job_waits_for_no_socket(machine: Machine) -> None:
    machine.add("a")
    assert await machine.turn(served=SERVING) == "a"


async def test_sockets_are_served_before_the_next_slice(machine: Machine) -> None:
    machine.add("a", "b", "c")
    assert await machine.turn() == "a"
    assert await machine.turn(served=2 * TURN) == ""
    assert await machine.turn(served=0.5 * TURN) == "", "the next step of a request may be on its way"
    machine.now += IDLE  # in which nothing came
    machine.slices._armed = machine.now
    assert await machine.turn() == "b"


async def test_jobs_wait_for_busy_sockets_only_so_long(machine: Machine) -> None:
    machine.add("a", "b")
    assert await machine.turn() == "a"
    turns = 0
    while not await machine.turn(served=2 * TURN):
        turns += 1
    assert turns * 2 * TURN == pytest.approx(SERVING, abs=3 * TURN)


async def test_jobs_that_are_long_behind_wait_no_more(machine: Machine) -> None:
    names = [str(number % 10) for number in range(2 * round(BEHIND_MAX / SLICE))]
    machine.add(*names)
    while machine.now < BEHIND_MAX:
        await machine.turn(served=2 * TURN)
    assert 0.25 * BEHIND_MAX / SLICE < len(machine.done) < 0.5 * BEHIND_MAX / SLICE
    assert all([await machine.turn(served=2 * TURN) for _ in range(10)])


async def test_faster_clocks_jobs_wait_less(machine: Machine) -> None:
    clock = RealClock(speed=100.0)
    assert clock._slices.speed == 100.0
    machine.slices.speed = 100.0
    machine.add("a", "b")
    assert await machine.turn() == "a"
    assert await machine.turn(served=2 * TURN) == "b"
