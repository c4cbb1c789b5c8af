"""Axes: in time, within their ends, without overshooting."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.simulation.bodies.axis_motors import SETTLED, Axis

TICK = 0.02


def ride(axis, goal, speed, ticks_max=100_000):
    for tick in range(ticks_max):
        if axis.position == goal and not axis.rate:
            return tick
        axis.approach(goal, speed, TICK)
    raise AssertionError("never there")


def test_a_way_takes_the_time_of_its_trapezoid():
    ticks = ride(Axis(-10, 10, acceleration=1.0), 4.0, 1.0)
    assert ticks * TICK == pytest.approx(4.0 / 1.0 + 1.0 / 1.0, abs=0.1)


@given(
    goal=st.floats(-5, 5),
    speed=st.floats(0.05, 20),
    acceleration=st.floats(0.5, 400),
    rate=st.floats(-3, 3),
)
def test_arrives_never_faster_than_it_can_stop(goal, speed, acceleration, rate):
    axis = Axis(-20, 20, acceleration, rate=rate)
    for _ in range(20_000):
        before, left = axis.rate, goal - axis.position
        axis.approach(goal, speed, TICK)
        if axis.position == goal:
            break
        towards = axis.rate * left > 0
        if towards and abs(axis.rate) > abs(before):
            assert abs(axis.rate) <= min(speed, math.sqrt(2 * acceleration * abs(left))) + 1e-9
            assert abs(axis.rate) - abs(before) <= acceleration * TICK + 1e-9
    assert axis.position == goal
    assert axis.rate == 0.0


def test_the_ends_stop_it():
    axis = Axis(-1.0, 1.0, acceleration=100.0)
    for _ in range(200):
        axis.run(2.0, TICK)
    assert (axis.position, axis.rate) == (1.0, 0.0)


def test_running_takes_up_speed_in_time():
    axis = Axis(-9.0, 9.0, acceleration=1.0)
    for _ in range(25):
        axis.run(5.0, TICK)
    assert axis.rate == pytest.approx(0.5)


@given(
    position=st.floats(-1.0, 1.0),
    rate=st.floats(-3.0, 3.0),
    way=st.floats(-0.5, 0.5),
    pull=st.floats(0.5, 10.0),
    top=st.floats(0.1, 3.0),
)
def test_trailing_is_shift_and_run_towards_the_middle(
    position: float, rate: float, way: float, pull: float, top: float
) -> None:
    one, other = (Axis(-1.0, 1.0, 20.0, position, rate) for _ in range(2))
    one.trail(way, pull, top, 0.02)
    other.shift(way)
    if abs(other.position) < SETTLED and abs(other.rate) < pull * SETTLED:
        other.position = other.rate = 0.0
    else:
        other.run(max(-top, min(top, -pull * other.position)), 0.02)
    assert (one.position, one.rate) == (other.position, other.rate)
