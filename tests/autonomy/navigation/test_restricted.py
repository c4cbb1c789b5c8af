"""Restricted areas: no more robots inside than may be, and those who wait go on by themselves."""

import pytest

from roboglot.model.components.logistics.traffic_radio import TrafficRadio
from roboglot.model.components.mapping.annotations import Area, AreaKind, MapAnnotations
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Pose

SOUTH, NORTH = 6.0, 8.0  # the area spans the room between these world coordinates


async def draw(robot, start, most):
    """The area on the map that the robot made from where it started."""
    ends = [Pose(5.0, y).relative_to(start).point for y in (SOUTH, NORTH)]
    area = Area(0, AreaKind.RESTRICTED, *ends, half_width=5.0, robots_max=most)
    await robot[MapAnnotations].change(lambda now: now.with_new(area))


async def cross(fleet, world, clock, most):
    """Both robots drive through the area from the south; how many hulls were inside at once, and who waited."""
    starts = {"a": Pose(3.0, 4.5), "b": Pose(7.0, 3.0)}
    for name, pose in starts.items():
        world.stage.place(name, pose)
    await clock.advance(0.5)
    frames = {}
    for name, robot in fleet.robots.items():
        robot[Mapping].clear()  # the map begins here
        frames[name] = world.truth.pose_of(name)
        await draw(robot, frames[name], most)
    await clock.advance(1.0)
    drives = {
        name: robot[Navigation].navigate_to(
            [Pose(starts[name].x, 9.2).relative_to(frames[name]).point], NavigationOptions(), source="test"
        )
        for name, robot in fleet.robots.items()
    }
    crowd, waited = 0, set()
    for _ in range(600):
        await clock.advance(0.1)
        inside = [name for name in drives if SOUTH < world.truth.pose_of(name).y < NORTH]
        crowd = max(crowd, len(inside))
        waited |= {name for name, drive in drives.items() if drive.paused}
        if all(drive.status.ended for drive in drives.values()):
            break
    assert [drive.reason for drive in drives.values()] == ["", ""]
    return crowd, waited


@pytest.mark.world("empty", robots=("a", "b"))
async def test_one_at_a_time(fleet, world, clock):
    crowd, waited = await cross(fleet, world, clock, 1)
    assert crowd == 1
    assert len(waited) == 1
    await clock.advance(6.0)
    assert all(robot[TrafficRadio].claims == frozenset() for robot in fleet.robots.values())


@pytest.mark.slow  # in short: test_one_at_a_time
@pytest.mark.world("empty", robots=("a", "b"))
async def test_two_may_enter(fleet, world, clock):
    crowd, waited = await cross(fleet, world, clock, 2)
    assert crowd == 2
    assert waited == set()


@pytest.mark.world("empty", robots=("a", "b"))
async def test_claims_are_heard_by_others_only(fleet):
    a, b = (fleet.robots[name][TrafficRadio] for name in "ab")
    a.claim({"x"})
    assert (a.others("x"), b.others("x"), b.others("y")) == (0, 1, 0)
    with pytest.raises(InvalidGoal):
        a.claim({"x" * 101})
