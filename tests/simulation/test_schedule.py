"""Schedule of a robot's parts."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from roboglot.simulation.bodies.schedule import Duty, Job, Schedule

TICK = 0.02
Calls = list[tuple[int, str, float]]


def recorder(calls: Calls, name: str) -> Callable[[int, float], None]:
    return lambda tick, seconds: calls.append((tick, name, seconds))


def run(schedule: Schedule, ticks: range) -> None:
    for tick in ticks:
        schedule.run_at(tick, tick)


@given(st.lists(st.tuples(st.integers(1, 13), st.integers(1, 13)), min_size=1, max_size=5))
def test_each_runs_in_order_with_its_elapsed_time(periods: list[tuple[int, int]]) -> None:
    calls: Calls = []
    schedule = Schedule([Job(recorder(calls, str(n)), *period) for n, period in enumerate(periods)], TICK)
    run(schedule, range(1, 301))
    expected = []
    for tick in range(1, 301):
        for n, (every, first) in enumerate(periods):
            if tick >= first and (tick - first) % every == 0:
                expected.append((tick, str(n), sum([TICK] * (first if tick == first else every))))
    assert [call[:2] for call in calls] == [call[:2] for call in expected]
    assert all(abs(a[2] - b[2]) < 1e-12 for a, b in zip(calls, expected, strict=True))


def test_a_part_without_a_duty_is_not_called() -> None:
    calls: Calls = []
    duty = Duty()
    schedule = Schedule([Job(recorder(calls, "a")), Job(recorder(calls, "b"), duty=duty)], TICK)
    run(schedule, range(1, 3))
    duty.begin()
    run(schedule, range(3, 5))
    duty.end()
    run(schedule, range(5, 7))
    assert [tick for tick, name, _ in calls if name == "b"] == [3, 4]
    assert [tick for tick, name, _ in calls if name == "a"] == [1, 2, 3, 4, 5, 6]


def test_duty_begun_during_a_tick_counts_by_turn() -> None:
    calls: Calls = []
    before, after = Duty(), Duty()

    def wake(tick: int, _seconds: float) -> None:
        calls.append((tick, "waker", 0.0))
        if tick == 2:
            before.begin()
            after.begin()

    jobs = [Job(recorder(calls, "before"), duty=before), Job(wake), Job(recorder(calls, "after"), duty=after)]
    run(Schedule([*jobs, Job(recorder(calls, "last"))], TICK), range(1, 4))
    names = [(tick, name) for tick, name, _ in calls]
    assert names == [
        (1, "waker"),
        (1, "last"),
        (2, "waker"),
        (2, "after"),
        (2, "last"),
        (3, "before"),
        (3, "waker"),
        (3, "after"),
        (3, "last"),
    ]


def test_duty_that_ends_during_a_tick_spares_others() -> None:
    calls: Calls = []
    duty = Duty(on=True)

    def once(tick: int, _seconds: float) -> None:
        calls.append((tick, "once", 0.0))
        duty.end()

    run(Schedule([Job(once, duty=duty), Job(recorder(calls, "a")), Job(recorder(calls, "b"))], TICK), range(1, 3))
    assert [(tick, name) for tick, name, _ in calls] == [(1, "once"), (1, "a"), (1, "b"), (2, "a"), (2, "b")]
