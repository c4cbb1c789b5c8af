"""The door's words and units, and the table of motions."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.components.motion.gaits import FOOT_LIFT_MAX, FOOT_LIFT_MIN, GAITS
from roboglot.model.components.motion.motions import MOTIONS
from roboglot.protocols.cyberdog.chapters.motion.motion_table import (
    FIGURES,
    FIXED_TIME,
    MAY_LAST,
    NUMBERS,
    WALKS,
)
from roboglot.protocols.cyberdog.vocabulary import body_of, lift_of, twist_of

ANY = st.floats(-100, 100)


@given(st.sampled_from(sorted(WALKS)), *[ANY] * 3)
def test_walk_s_velocity_is_never_above_its_top(motion: int, x: float, y: float, yaw: float) -> None:
    gait, twist = GAITS[WALKS[motion]], twist_of(motion, [x, y, yaw])
    assert gait.lowest.x <= twist.x <= gait.highest.x
    assert gait.lowest.y <= twist.y <= gait.highest.y
    assert gait.lowest.yaw <= twist.yaw <= gait.highest.yaw


@given(st.lists(ANY, max_size=4))
def test_feet_are_lifted_by_what_legs_can_do(heights: list[float]) -> None:
    lift = lift_of(heights)
    wanted = len(heights) >= 2 and min(heights[:2]) > 0
    assert (lift is not None) == wanted
    assert lift is None or all(FOOT_LIFT_MIN <= height <= FOOT_LIFT_MAX for height in (lift.front, lift.rear))


def test_a_height_of_zero_keeps_the_height() -> None:
    assert body_of([0, 0, 0], [0, 0.1, 0]).height is None
    assert body_of([0.01, 0, 0.25], []).height == 0.25


def test_every_figure_of_the_model_has_its_number() -> None:
    assert set(FIGURES.values()) == set(MOTIONS)
    assert len(NUMBERS) == len(FIGURES)
    assert {125} == FIXED_TIME & MAY_LAST  # passive trot: a walk with its own duration
