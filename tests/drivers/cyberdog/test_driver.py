"""A simulated dog behind its gRPC door, a driver connected to it, and the text protocol in front.

gRPC has its own threads, which no virtual clock waits for: robot time passes a little faster than outside.
"""

import asyncio
import math
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest

from roboglot.clients.cyberdog import link as link_module
from roboglot.drivers.cyberdog.capabilities import APPROXIMATIONS
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.interaction.members import Members
from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.components.mapping.map_memory import MapMemory
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.components.motion.following import Following
from roboglot.model.components.motion.gaits import Gait
from roboglot.model.components.motion.legs import (
    BodyPose,
    FootLift,
    Legs,
    Posture,
)
from roboglot.model.components.motion.motions import Motion as Figure
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.motion.stair_alignment import AlignmentStage, StairAlignment, StairDirection
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.lease import Lease
from roboglot.model.components.system.ledger import Ledger
from roboglot.model.components.system.link import OTHERS, Link, LinkState
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import InvalidGoal, NotFound, Refused
from roboglot.model.events import LinkChanged
from roboglot.model.geometry import Orientation, Point, Pose, Twist
from roboglot.model.robot import Robot
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols.cyberdog.certificates import export_client
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.slamware.chapters.motion.speed_limits import SpeedLimits
from roboglot.simulation.world.world import World
from roboglot.testing import Forward, assert_pose
from roboglot.testing.addresses import free_port
from tests.drivers.clients import Drive, Open, Until
from tests.drivers.settling import settle

pytestmark = pytest.mark.world("office", body="cyberdog2")
STEP = 0.02  # robot s


@pytest.fixture
def until(forward: Forward) -> Until:
    """Robot time passes until the condition holds."""

    async def wait(condition: Callable[[], object], patience: float = 40.0) -> None:
        for _ in range(int(patience / STEP)):
            if condition():
                return
            await forward(seconds=STEP)
            await settle()
        raise AssertionError("it did not happen")

    return wait


@pytest.fixture
async def dog_door(robot: Robot, forward: Forward, tmp_path: Path) -> AsyncIterator[CyberDogDoor]:
    door = CyberDogDoor(robot, "127.0.0.1", CyberDogConfig(port=0, app_port=free_port()), tmp_path)
    export_client(tmp_path / "cyberdog", tmp_path / "phone")
    await door.start()
    yield door
    await door.close()
    stopping = asyncio.ensure_future(robot.actions.cancel())
    await forward(seconds=4)
    await stopping


@pytest.fixture
async def driven(
    dog_door: CyberDogDoor, drive: Drive, until: Until, forward: Forward, tmp_path: Path
) -> AsyncIterator[Robot]:
    await forward(seconds=2)
    url = f"cyberdog://127.0.0.1:{dog_door.port}?certs={tmp_path / 'phone'}&app={dog_door._config.app_port}"
    connecting = asyncio.ensure_future(drive(url))
    await until(connecting.done)
    robot = await connecting
    await until(lambda: robot[Link].state is LinkState.UP)
    await until(lambda: robot[Localization].enabled)
    yield robot
    for action in robot.actions.running():
        action.cancel()
    await until(lambda: not robot.actions.running())


async def done(action: Action, until: Until) -> None:
    await until(lambda: action.status.ended)
    assert action.status is ActionStatus.SUCCEEDED, action.reason


@pytest.mark.slow  # long; test_matrix.py drives one by this driver
async def test_it_drives_an_asymmetric_path(driven: Robot, until: Until, world: World) -> None:
    start = world.truth.pose_of("a")
    for offset in (Pose(0.6), Pose(yaw=math.pi / 2), Pose(0.3), Pose(0.0, -0.2)):
        await done(driven[Driving].move_by(offset, source="test"), until)
    await until(lambda: driven[Link].age("pose") < 0.1)
    here = world.truth.pose_of("a").relative_to(start)
    assert_pose(here, x=0.8, y=0.3, deg=90, within=0.08, within_deg=4)
    assert_pose(driven[Localization].pose, x=here.x, y=here.y, deg=math.degrees(here.yaw), within=0.05, within_deg=2)


@pytest.mark.slow  # in short: test_up_it_aligns_after_the_answer
@pytest.mark.world("stairs", body="cyberdog2")
async def test_it_stands_square_before_stairs(
    driven: Robot, robot: Robot, until: Until, forward: Forward, world: World
) -> None:
    alignment = driven[StairAlignment]
    world.stage.place("a", Pose(2.0, 2.0))
    await forward(seconds=0.3)
    nowhere = alignment.align(StairDirection.UP, source="test")
    await until(lambda: nowhere.status.ended)
    assert isinstance(nowhere.error, NotFound)
    world.stage.place("a", Pose(3.3, 4.0, 0.3))
    await forward(seconds=0.3)  # until its depth sensors have measured there
    action = alignment.align(StairDirection.UP, source="test")
    await until(lambda: action.feedback is AlignmentStage.ALIGNING)
    await done(action, until)
    assert_pose(world.truth.pose_of("a"), x=3.45, deg=0, within=0.03, within_deg=3)
    world.stage.place("a", Pose(3.3, 4.0, 0.3))
    await forward(seconds=0.3)  # until its depth sensors have measured there
    action = alignment.align(StairDirection.UP, source="test")
    await until(lambda: action.feedback is AlignmentStage.ALIGNING)
    action.cancel()
    await until(lambda: action.status.ended)
    assert action.status is ActionStatus.CANCELED
    assert not robot.actions.running(BASE)  # as ordered, and the dog stands
    assert world.truth.pose_of("a").x < 3.44


@pytest.mark.slow
async def test_a_script_in_front_drives_and_stops_it(
    driven: Robot, robot: Robot, text_door: Open, until: Until, forward: Forward, world: World
) -> None:
    client = await text_door(driven)
    assert await client.numbers("robot battery ?;") == [round(robot[Battery].state.percentage * 100)]
    start = world.truth.pose_of("a")
    assert await client.ask("chassis speed x 0.3 y 0.1 z 0;") == "ok"
    await until(lambda: world.truth.pose_of("a").relative_to(start).x > 0.5)
    assert world.truth.pose_of("a").relative_to(start).y < -0.05  # right is positive in the text protocol
    client.writer.transport.abort()
    await asyncio.sleep(0.02)
    for _ in range(50):
        await forward(seconds=STEP)
        await settle()
    before = world.truth.pose_of("a")
    await forward(seconds=1)
    assert world.truth.pose_of("a").distance_to(before) < 0.02


async def test_it_navigates_and_reports_map_and_pose(driven: Robot, robot: Robot, until: Until, world: World) -> None:
    start = world.truth.pose_of("a")
    assert driven[Mapping].grid.width == robot[Mapping].grid.width
    await done(driven[Navigation].navigate_to([Point(1.0, 0.4)], NavigationOptions(yaw=0.5), source="test"), until)
    assert_pose(
        world.truth.pose_of("a").relative_to(start), x=1.0, y=0.4, deg=math.degrees(0.5), within=0.1, within_deg=4
    )
    with pytest.raises(Refused):
        driven[Localization].set_pose(Pose())
    with pytest.raises(Refused, match="cannot drive by itself"):  # it was ignored
        driven[Localization].relocalize(may_move=True)


async def test_a_paused_dog_stands_until_resumed(driven: Robot, robot: Robot, until: Until) -> None:
    """It walked on, reported as paused: its own tasks know no pause."""
    action = driven[Navigation].navigate_to([Point(1.5, 0.0)], NavigationOptions(), source="test")
    await until(lambda: robot[Base].velocity.x > 0.1)
    action.pause()
    await until(lambda: not robot.actions.running(BASE))
    held = robot[Localization].pose
    await until(lambda: driven[Link].age("pose") < 0.1)
    assert (action.status, action.paused) == (ActionStatus.EXECUTING, True)
    assert robot[Localization].pose.distance_to(held) < 0.05
    action.resume()
    await done(action, until)
    assert robot[Localization].pose.x == pytest.approx(1.5, abs=0.15)


async def test_own_skills_keep_no_lower_limit(driven: Robot, robot: Robot, until: Until) -> None:
    """The dog's requests have no field for a speed."""
    limits = SpeedLimits(driven)
    goal = [Point(6.0, 0.0)]
    with pytest.raises(Refused, match="at its own speed"):
        driven[Navigation].navigate_to(goal, NavigationOptions(speed_ratio=0.5), source="test")
    limits.set(speed=0.2)
    for skill in (
        lambda: driven[Navigation].navigate_to(goal, NavigationOptions()),
        driven[Docking].dock,
        driven[Following].follow,
        lambda: driven[StairAlignment].align(StairDirection.UP),
    ):
        with pytest.raises(Refused, match=r"keep no speed limit below 0\.6 m/s and 1\.3 rad/s"):
            skill()
    limits.set(speed=0.6)
    going = driven[Navigation].navigate_to(goal, NavigationOptions(), source="test")
    await until(lambda: robot[Base].velocity.x > 0.1)
    with pytest.raises(Refused, match="keeps the speed that it began with"):
        limits.set(speed=0.2)
    going.cancel()
    await until(lambda: going.status.ended)
    limits.set(speed=0.2)


@pytest.mark.slow
async def test_postures_figures_and_gaits_are_the_dogs(driven: Robot, robot: Robot, until: Until, world: World) -> None:
    await done(driven[Legs].lie_down(source="test"), until)
    assert robot[Legs].posture is Posture.LYING
    await until(lambda: driven[Legs].posture is Posture.LYING)
    with pytest.raises(Refused):
        driven[Legs].dance([])
    await done(driven[Legs].stand(source="test"), until)
    assert driven[Legs].posture is Posture.STANDING
    held = BodyPose(0.16, Orientation(roll=0.2), Point(0.02, 0.0))
    await done(driven[Legs].hold(held, duration=0.3, source="test"), until)
    assert robot[Legs].attitude.roll == pytest.approx(0.2, abs=0.02)
    assert robot[Legs].body_height == pytest.approx(0.16, abs=0.02)
    assert driven[Legs].attitude == held.attitude
    jumping = driven[Legs].perform(Figure.JUMP_UP_30, source="test")
    await until(lambda: robot[Legs].performing is Figure.JUMP_UP_30)
    await done(jumping, until)
    driven[Legs].walk(Gait.TROT_FAST, FootLift(0.03, 0.03))
    driven[Driving].drive(Twist(x=1.4), source="test")
    await until(lambda: robot[Base].velocity.x > 1.0)
    assert robot[Legs].gait is Gait.TROT_FAST
    driven[Legs].go_limp()
    await until(lambda: robot[Legs].posture is Posture.LIMP)
    await until(lambda: not driven.actions.running())
    await until(lambda: driven[Legs].posture is Posture.LIMP)
    await done(driven[Legs].stand(source="test"), until)


@pytest.mark.slow  # a long story
@pytest.mark.world("playground", body="cyberdog2")
async def test_follows_and_docks_by_own_skills_when_localized(
    driven: Robot, robot: Robot, until: Until, world: World
) -> None:
    start = world.truth.pose_of("a")  # at its localized place: it is not carried away
    anna = start.compose(Pose(3.0))
    world.stage.person("anna").place(anna.x, anna.y, math.degrees(start.yaw) + 180.0)
    following = driven[Following].follow(distance=1.2, source="test")
    await until(lambda: 0.8 < world.truth.pose_of("a").distance_to(anna) < 1.6)
    following.cancel()
    await until(lambda: following.status.ended)
    assert following.status is ActionStatus.CANCELED
    await until(lambda: not robot.actions.running())
    await until(lambda: driven[Localization].enabled)  # it localized itself again
    with pytest.raises(InvalidGoal):
        driven[Following].follow(distance=9.0)
    tagged = driven[Following].follow_tag(source="test")
    await until(lambda: tagged.status.ended)  # it wears none
    assert tagged.status is ActionStatus.ABORTED
    docking = driven[Docking].dock(source="test")
    await until(lambda: robot.actions.running(), patience=10)
    docking.cancel()
    await until(lambda: docking.status.ended)


@pytest.mark.slow  # in short: test_task_begun_with_lost_answer_is_stopped_too
async def test_unowned_task_is_stopped_when_the_link_returns(
    driven: Robot, robot: Robot, until: Until, monkeypatch: pytest.MonkeyPatch
) -> None:
    going = driven[Navigation].navigate_to([Point(6.0, 0.0)], NavigationOptions(), source="test")
    await until(lambda: robot[Base].velocity.x > 0.1)
    (skill,) = robot.actions.running(BASE)
    with monkeypatch.context() as broken:
        broken.delattr(link_module, "_heartbeat")  # the dog's heartbeats are lost
        await until(lambda: going.status.ended)
    assert not skill.status.ended  # the dog stops on its own
    reported = driven.events.subscribe(LinkChanged)
    await until(lambda: driven[Link].state is LinkState.UP, patience=60)
    await until(lambda: skill.status.ended, patience=2)
    assert skill.status is ActionStatus.CANCELED
    begun = driven.clock.time()
    await until(lambda: driven.clock.time() - begun > 1.5)  # heartbeats later
    assert OTHERS not in {event.holder for event in reported.drain()}  # ours all the time
    reported.close()


async def test_it_announces_what_it_adds(driven: Robot, until: Until) -> None:
    await until(lambda: driven[Link].age("scan") < 1)
    kept_here = {Lease, Places, MapAnnotations, MapMemory, MapLibrary, FileStore, Settings, Ledger, Members}
    assert set(driven.interfaces) - kept_here == APPROXIMATIONS.keys()


@pytest.mark.slow  # in short: test_both_ends_of_text_note_the_same
async def test_drivers_tap_equals_the_dogs_tap(driven: Robot, robot: Robot, until: Until) -> None:
    here: list[Exchange] = []
    there: list[Exchange] = []
    leave = driven.tap.listen(here.append), robot.tap.listen(there.append)

    def told(exchanges: list[Exchange], way: Direction) -> set[tuple[str, bytes]]:
        return {(found.operation, found.payload) for found in exchanges if found.direction is way}

    await until(lambda: len(told(here, Direction.REPLY)) > 2)
    assert {found.door for found in here} == {"driver/cyberdog"}
    await until(lambda: told(here, Direction.REQUEST) <= told(there, Direction.REQUEST))
    assert told(here, Direction.REPLY) & told(there, Direction.REPLY)
    for end in leave:
        end()
    assert not driven.tap.watched
