"""Places from boxes in an EP's picture, and the numbers of people."""

import math
from typing import cast

import pytest

from roboglot.drivers.robomaster.chapters.ai.detections import (
    ACROSS,
    PERSON,
    Locator,
    PersonTracker,
    gesture_of,
    line_of,
)
from roboglot.drivers.robomaster.chapters.camera import FOV, HEIGHT, WIDTH
from roboglot.model.components.sensing.camera import Camera, Mount
from roboglot.model.perception import Box, Colour, Gesture
from roboglot.wire.robomaster.telemetry import LinePoint, Target

FOCAL = WIDTH / 2 / math.tan(FOV / 2)  # pixels


class _Camera:
    """Looks to the left, and stands 0.1 m ahead of base_link."""

    width, height, fov, mount = WIDTH, HEIGHT, FOV, Mount(0.1, 0.0, 0.2, yaw=math.pi / 2)


@pytest.fixture
def where() -> Locator:
    return Locator(cast(Camera, _Camera()))


def test_distance_of_a_whole_person_follows_box_bottom(where: Locator) -> None:
    height = PERSON * FOCAL / 4.0 / HEIGHT
    seen = where.person(Target(0.5, 0.5, 0.1, height), 3)
    assert (seen.distance, seen.number) == (pytest.approx(4.0), 3)
    assert (seen.place.x, seen.place.y) == pytest.approx((0.1, 4.0))


def test_cut_off_person_is_measured_by_width(where: Locator) -> None:
    seen = where.person(Target(0.75, 0.5, ACROSS * FOCAL / 2.0 / WIDTH, 1.0), 1)
    assert seen.distance == pytest.approx(2.0)
    assert seen.place.x > 0.5  # ahead of base_link: the camera looks to the left


def test_people_keep_their_numbers_while_they_stay_near() -> None:
    numbers = PersonTracker()
    assert numbers.number([Box(0.2, 0.5, 0.1, 0.5), Box(0.8, 0.5, 0.1, 0.5)]) == [1, 2]
    assert numbers.number([Box(0.75, 0.5, 0.1, 0.5), Box(0.25, 0.5, 0.1, 0.5)]) == [2, 1]
    assert numbers.number([Box(0.5, 0.1, 0.1, 0.1)]) == [3]


def test_words_and_signs() -> None:
    seen = gesture_of(Target(0.5, 0.5, 0.2, 0.5, 6), 1)
    assert seen
    assert seen.gesture is Gesture.PHOTO
    assert gesture_of(Target(0.5, 0.5, 0.2, 0.5, 99), 1) is None
    right = [LinePoint(0.5 + n / 20, 1 - n / 10, 5.0 * n, 2.0) for n in range(10)]
    assert {point.curvature for point in line_of(right, Colour.RED).points} == {-2.0}
    assert line_of(right, Colour.RED).points[9].angle == pytest.approx(math.radians(45))
