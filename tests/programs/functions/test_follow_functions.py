"""cyberdog.follow: the robot stays behind a person it knows."""

from __future__ import annotations

import math

import pytest

from roboglot.model.components.interaction.members import Members
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.geometry import Pose, Twist
from roboglot.simulation.people.stage_people import Actor
from roboglot.simulation.world.world import World
from tests.programs.functions.calling import Caller, field

pytestmark = pytest.mark.world("playground")


@pytest.fixture
async def anna(caller: Caller, world: World) -> Actor:
    world.stage.place("a", Pose(1.5, 6.8))
    ben, anna = world.stage.person("ben"), world.stage.person("anna")
    ben.stand()
    ben.place(7.0, 1.0, 0)
    anna.stand()
    anna.place(5.4, 6.8, 180)  # closer, her face is above the picture
    await caller.robot[Members].add("Anna")
    await caller.robot[Members].set_face("Anna", anna.face)
    await caller.robot[Members].add("Ben")
    await caller.clock.advance(0.5)
    return anna


def code(state: object) -> int:
    return int(field(state, "code"))


@pytest.mark.slow
async def test_it_walks_after_member_and_keeps_its_distance(caller: Caller, world: World, anna: Actor) -> None:
    assert code(await caller("cyberdog.follow.add_personnel", "Anna")) == 0
    assert code(await caller("cyberdog.follow.follow_personnel", "Anna", 1.2)) == 0
    await caller.clock.advance(6.0)
    assert world.truth.pose_of("a").distance_to(Pose(5.4, 6.8)) == pytest.approx(1.2, abs=0.25)
    anna.walk_to(7.2, 5.9)
    await caller.clock.advance(10.0)
    assert world.truth.pose_of("a").distance_to(Pose(7.2, 5.9)) == pytest.approx(1.2, abs=0.3)
    assert code(await caller("cyberdog.follow.state")) == 0
    assert code(await caller("cyberdog.follow.cancel_follow", "Anna")) == 0
    await caller.clock.advance(1.0)
    assert not caller.robot.actions.running()
    assert caller.robot[Vision].people.latest is None


async def test_suspended_it_waits_and_at_end_it_stops(caller: Caller, world: World, anna: Actor) -> None:
    await caller("cyberdog.follow.add_personnel", "Anna")
    await caller("cyberdog.follow.follow_personnel", "Anna")
    await caller.clock.advance(1.5)
    caller.session.pause()
    await caller.clock.advance(1.0)
    held = world.truth.pose_of("a")
    await caller.clock.advance(3.0)
    assert world.truth.pose_of("a").distance_to(held) < 0.02
    caller.session.resume()
    await caller.clock.advance(3.0)
    assert world.truth.pose_of("a").distance_to(held) > 0.2
    caller.session.cancel("the end")
    await caller.clock.advance(1.0)
    assert not caller.robot.actions.running()
    assert caller.robot[Vision].faces.latest is None


async def test_another_clients_motion_ends_following(caller: Caller, anna: Actor) -> None:
    await caller("cyberdog.follow.add_personnel", "Anna")
    await caller("cyberdog.follow.follow_personnel", "Anna")
    await caller.clock.advance(1.5)
    caller.robot[Driving].drive(Twist(), lifetime=2.0, source="someone")
    await caller.clock.advance(1.0)
    assert field(await caller("cyberdog.follow.state"), "describe") == "another client moves the robot"
    assert [action.source for action in caller.robot.actions.running()] == ["someone"]


@pytest.mark.slow  # in short: test_it_walks_after_member_and_keeps_its_distance
async def test_it_goes_around_what_stands_between(caller: Caller, world: World, anna: Actor) -> None:
    world.stage.add_obstacle(Pose(3.2, 6.58), (0.2, 0.2, 1.0))  # standing aside to see her, and moving on
    await caller("cyberdog.follow.add_personnel", "Anna")
    await caller("cyberdog.follow.follow_personnel", "Anna", 1.2)
    await caller.clock.advance(15.0)
    assert world.truth.pose_of("a").distance_to(Pose(5.4, 6.8)) == pytest.approx(1.2, abs=0.3)


@pytest.mark.slow  # in short: test_another_clients_motion_ends_following
async def test_own_motion_of_the_program_comes_first(caller: Caller, world: World, anna: Actor) -> None:
    await caller("cyberdog.follow.add_personnel", "Anna")
    await caller("cyberdog.follow.follow_personnel", "Anna", 1.2)
    await caller.clock.advance(1.0)
    before = world.truth.pose_of("a")
    result = await caller("cyberdog.motion.go_straight", -0.3, 0.4)
    assert field(result, "state.code") == 0
    assert world.truth.pose_of("a").relative_to(before).x < 0.1
    await caller.clock.advance(8.0)
    assert world.truth.pose_of("a").distance_to(Pose(5.4, 6.8)) == pytest.approx(1.2, abs=0.25)


@pytest.mark.slow  # in short: test_without_anybody_it_gives_up
async def test_out_of_sight_it_gives_up(caller: Caller, world: World, anna: Actor) -> None:
    anna.place(1.5, 1.0, 0)
    await caller("cyberdog.follow.add_personnel", "Anna")
    await caller("cyberdog.follow.follow_personnel", "Anna")
    before = world.truth.pose_of("a")
    await caller.clock.advance(29.0)
    assert code(await caller("cyberdog.follow.state")) == 0
    await caller.clock.advance(2.0)
    assert field(await caller("cyberdog.follow.state"), "describe") == "Anna is out of sight"
    assert world.truth.pose_of("a").distance_to(before) < 0.01


@pytest.mark.parametrize(
    ("name", "args"),
    [
        ("add_personnel", ("Nobody",)),
        ("add_personnel", ("Ben",)),  # no face
        ("delete_personnel", ("Anna",)),
        ("follow_personnel", ("Anna",)),  # not added
        ("cancel_follow", ()),
    ],
)
async def test_unknown_people_cannot_be_followed(caller: Caller, anna: Actor, name: str, args: tuple[str, ...]) -> None:
    assert code(await caller(f"cyberdog.follow.{name}", *args)) == 1
    assert not caller.robot.actions.running()


async def test_removed_person_is_not_followed_any_more(caller: Caller, anna: Actor) -> None:
    await caller("cyberdog.follow.add_personnel", "Anna")
    assert code(await caller("cyberdog.follow.follow_personnel", "Anna", 6.0)) == 1
    assert code(await caller("cyberdog.follow.follow_personnel", "Anna", math.nan)) == 1
    await caller("cyberdog.follow.follow_personnel", "Anna")
    await caller.clock.advance(1.0)
    assert caller.robot.actions.running()
    assert code(await caller("cyberdog.follow.delete_personnel", "Anna")) == 0
    await caller.clock.advance(1.0)
    assert not caller.robot.actions.running()
    assert code(await caller("cyberdog.follow.cancel_follow", "Anna")) == 1
