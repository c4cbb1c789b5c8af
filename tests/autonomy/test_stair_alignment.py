"""A dog before real flights, with the noise of its sensors and no map: where it ends, in truth."""

import math
from collections.abc import AsyncIterator, Awaitable, Callable

import pytest

from roboglot.autonomy.navigation.driving import OdometryDriving
from roboglot.autonomy.stairs.alignment import SeenStairAlignment
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.legs import BodyPose, Legs, Posture
from roboglot.model.components.motion.stair_alignment import AlignmentStage, StairDirection
from roboglot.model.errors import EmergencyStopped, Expired, NotFound, Refused
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world
from roboglot.testing import assert_pose
from tests.narrowing import of_kind

FOOT, TOP, MIDDLE = 4.0, 4.9, 4.0  # m: x of the first riser and of the landing's edge, y of the flight's middle
BEFORE = 0.55  # m from base_link to the edge
UP, DOWN = StairDirection.UP, StairDirection.DOWN


class Stand:
    """A dog in the world ``stairs``, without the lidar's skills: quick to make."""

    def __init__(self, seed: int = 1, body: str = "cyberdog2") -> None:
        self.clock = LockstepClock()
        self.world = World(load_world("stairs"), [RobotPlacement("a", body)], clock=self.clock, seed=seed)
        self.robot = Robot("a", self.world.description_of("a"), self.clock)
        self.world.equip(self.robot)
        self.alignment = SeenStairAlignment(self.robot)
        self.robot.add(Driving, OdometryDriving(self.robot))
        self.world._use_kernels()
        self.world.start()

    async def put(self, before: float, degrees: float, aside: float, way: StairDirection = UP) -> None:
        """Place the dog so far before the edge, turned to the left, shifted along +y."""
        turn = math.radians(degrees)
        up = Pose(FOOT - before, MIDDLE + aside, turn)
        self.world.stage.place("a", up if way is UP else Pose(TOP + before, MIDDLE + aside, math.pi + turn))
        await self.clock.advance(0.3)

    async def ended(self, action: Action, seconds: float = 40.0) -> None:
        until = self.clock.time() + seconds
        while not action.status.ended and self.clock.time() < until:
            await self.clock.advance(0.1)

    async def reported(self, action: Action, stage: AlignmentStage) -> None:
        for _ in range(100):
            if action.feedback is stage:
                return
            await self.clock.advance(0.05)
        raise AssertionError(f"{action.feedback}, not {stage}")


Make = Callable[..., Awaitable[Stand]]


@pytest.fixture
async def stand() -> AsyncIterator[Make]:
    made: list[Stand] = []

    async def make(seed: int = 1, body: str = "cyberdog2") -> Stand:
        made.append(Stand(seed, body))
        await made[-1].clock.advance(0.3)
        return made[-1]

    yield make
    for each in made:
        for action in each.robot.actions.running():
            action.cancel()
            await each.ended(action)
        each.world.close()


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
@pytest.mark.parametrize(
    ("way", "before", "degrees", "aside"),
    [
        pytest.param(UP, 0.45, 0.0, 0.0, marks=pytest.mark.slow),
        pytest.param(UP, 0.7, 25.0, -0.1, marks=pytest.mark.slow),
        pytest.param(UP, 0.75, -15.0, 0.1, marks=pytest.mark.slow),
        (UP, 0.7, -30.0, 0.0),
        pytest.param(DOWN, 0.5, 15.0, 0.0, marks=pytest.mark.slow),
        pytest.param(DOWN, 0.6, -20.0, 0.1, marks=pytest.mark.slow),
        pytest.param(DOWN, 0.75, -10.0, 0.0, marks=pytest.mark.slow),
        (DOWN, 0.7, 20.0, 0.3),
    ],
)
async def test_it_ends_square_before_the_first_step(
    stand: Make, way: StairDirection, before: float, degrees: float, aside: float, seed: int
) -> None:
    dog = await stand(seed)
    await dog.put(before, degrees, aside, way)
    action = dog.alignment.align(way)
    await dog.ended(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert action.feedback is AlignmentStage.ALIGNED
    x, heading = (FOOT - BEFORE, 0.0) if way is UP else (TOP + BEFORE, 180.0)
    assert_pose(dog.world.truth.pose_of("a"), x=x, deg=heading, within=0.03, within_deg=3.0)
    assert dog.world.truth.pose_of("a").y == pytest.approx(MIDDLE + aside, abs=0.15)
    here = dog.world.truth.pose_of("a")
    await dog.clock.advance(1.0)
    assert dog.world.truth.pose_of("a").distance_to(here) < 0.002


async def test_shifts_until_the_step_is_on_both_sides(stand: Make) -> None:
    dog = await stand()
    await dog.put(0.6, 0.0, 0.5)  # 10 cm from the end of a flight 1.2 m wide
    action = dog.alignment.align(UP)
    await dog.ended(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert dog.world.truth.pose_of("a").y < MIDDLE + 0.44
    assert_pose(dog.world.truth.pose_of("a"), x=FOOT - BEFORE, deg=0, within=0.03, within_deg=3.0)


@pytest.mark.parametrize("way", [UP, DOWN])
async def test_refuses_to_move_where_no_step_is(stand: Make, way: StairDirection) -> None:
    dog = await stand()
    dog.world.stage.place("a", Pose(2.0, 2.0, 0.0))
    await dog.clock.advance(0.3)
    driving = dog.robot[Driving].drive(Twist(yaw=0.1))
    with pytest.raises(NotFound):
        dog.alignment.align(way)
    assert dog.robot.actions.running() == [driving]


async def test_down_is_not_up(stand: Make) -> None:
    dog = await stand()
    await dog.put(0.6, 0.0, 0.0, UP)
    with pytest.raises(NotFound):
        dog.alignment.align(DOWN)
    await dog.put(0.6, 0.0, 0.0, DOWN)
    with pytest.raises(NotFound):
        dog.alignment.align(UP)


@pytest.mark.parametrize("gap", [0.45, 0.6, 0.75])
async def test_a_wall_is_no_step(stand: Make, gap: float) -> None:
    dog = await stand()
    dog.world.stage.place("a", Pose(10.0 - gap, 1.5, 0.1))
    await dog.clock.advance(0.3)
    before = dog.world.truth.pose_of("a")
    action = dog.alignment.align(UP)
    await dog.ended(action)
    assert action.status is ActionStatus.ABORTED
    assert isinstance(action.error, NotFound)
    assert dog.world.truth.pose_of("a").distance_to(before) < 0.005


async def test_accepts_steps_by_their_tread_without_lidar(stand: Make) -> None:
    dog = await stand()
    dog.world.faults.inject("lidar_gone", robot="a")
    dog.world.stage.place("a", Pose(9.45, 1.5, 0.1))
    await dog.clock.advance(0.3)
    wall = dog.alignment.align(UP)
    await dog.ended(wall)
    assert isinstance(wall.error, NotFound)
    await dog.put(0.5, 8.0, 0.0)
    action = dog.alignment.align(UP)
    await dog.ended(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert_pose(dog.world.truth.pose_of("a"), x=FOOT - BEFORE, deg=0, within=0.03, within_deg=3.0)


async def test_cancelled_alignment_leaves_the_dog_standing(stand: Make) -> None:
    dog = await stand()
    await dog.put(0.75, 15.0, 0.0)
    action = dog.alignment.align(UP)
    await dog.reported(action, AlignmentStage.ALIGNING)
    await dog.clock.advance(0.5)
    action.cancel()
    await dog.ended(action, 2.0)
    assert action.status is ActionStatus.CANCELED
    here = dog.world.truth.pose_of("a")
    await dog.clock.advance(1.0)
    assert dog.world.truth.pose_of("a").distance_to(here) < 0.002
    assert 0.57 < FOOT - here.x < 0.745


@pytest.mark.slow  # a long pause
async def test_a_pause_takes_no_time_from_it(stand: Make) -> None:
    dog = await stand()
    await dog.put(0.75, 15.0, 0.0)
    action = dog.alignment.align(UP)
    await dog.reported(action, AlignmentStage.ALIGNING)
    await dog.clock.advance(0.5)
    action.pause()
    await dog.clock.advance(1.0)
    here = dog.world.truth.pose_of("a")
    await dog.clock.advance(31.0)
    assert dog.world.truth.pose_of("a").distance_to(here) < 0.002
    action.resume()
    await dog.ended(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason


async def test_it_looks_from_a_body_held_high(stand: Make) -> None:
    dog = await stand()
    await dog.put(0.7, 10.0, 0.0)
    await dog.ended(dog.robot[Legs].hold(BodyPose(height=0.28)))
    action = dog.alignment.align(UP)
    await dog.ended(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert_pose(dog.world.truth.pose_of("a"), x=FOOT - BEFORE, deg=0, within=0.03, within_deg=3.0)


async def test_a_step_that_is_lost_on_the_way(stand: Make) -> None:
    dog = await stand()
    await dog.put(0.75, 15.0, 0.0)
    action = dog.alignment.align(UP)
    await dog.reported(action, AlignmentStage.ALIGNING)
    dog.world.stage.place("a", Pose(2.0, 2.0, 0.0))
    await dog.ended(action)
    assert action.status is ActionStatus.ABORTED
    assert isinstance(action.error, NotFound)
    assert dog.world.truth.pose_of("a").distance_to(Pose(2.0, 2.0)) < 0.3


@pytest.mark.slow  # in short: test_a_step_that_is_lost_on_the_way
async def test_held_fast_it_gives_up_in_time(stand: Make) -> None:
    dog = await stand()
    await dog.put(0.75, 15.0, 0.0)
    dog.world.stage.lift("a", 0.0)  # held in place
    action = dog.alignment.align(UP)
    await dog.ended(action)
    assert isinstance(action.error, Expired)
    assert dog.clock.time() < 40.0


async def test_nothing_begins_after_an_emergency_stop(stand: Make) -> None:
    dog = await stand()
    await dog.put(0.75, 15.0, 0.0)
    action = dog.alignment.align(UP)
    await dog.reported(action, AlignmentStage.ALIGNING)
    dog.robot[Legs].go_limp()
    await dog.ended(action, 2.0)
    assert action.status is ActionStatus.CANCELED
    await dog.clock.advance(1.0)
    with pytest.raises(EmergencyStopped):
        dog.alignment.align(UP)


async def test_lying_dog_gets_up_first(stand: Make) -> None:
    dog = await stand()
    await dog.put(0.7, 10.0, 0.0)
    await dog.ended(dog.robot[Legs].lie_down())
    action = dog.alignment.align(UP)
    await dog.ended(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert dog.robot[Legs].posture is Posture.STANDING


async def test_base_that_would_not_drive_refuses_at_once(stand: Make) -> None:
    dog = await stand()
    await dog.put(0.7, 10.0, 0.0)
    of_kind(dog.robot[Base], SimulatedBase).locks.lock("test", "a cable")
    with pytest.raises(Refused):
        dog.alignment.align(UP)


async def test_wheels_align_too(stand: Make) -> None:
    robot = await stand(body="universal")
    await robot.put(0.7, 10.0, 0.0)
    action = robot.alignment.align(UP)
    await robot.ended(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    radius = robot.robot.description.radius
    assert_pose(robot.world.truth.pose_of("a"), x=FOOT - radius - 0.3, deg=0, within=0.03, within_deg=3.0)
