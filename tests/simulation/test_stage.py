"""The documentation's example of hands runs as it stands there; the same seed gives the same blows and shots."""

import math
from contextlib import suppress
from pathlib import Path

import pytest
from msgspec.structs import replace

from roboglot.model.components.interaction.armor import Armor, PlatePlace
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.motion.motion_status import MotionStatus
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.errors import Collided, NotFound, Refused
from roboglot.model.events import ArmorHit
from roboglot.model.geometry import Point, Pose, Twist, Vector3, wrap_angle
from roboglot.model.sound import claps
from roboglot.simulation.components.motion.emergency_stop import SimulatedEmergencyStop
from roboglot.simulation.world.description import Box
from roboglot.simulation.world.world_files import load_world
from tests.narrowing import known

DOCS = Path(__file__).parents[2] / "docs" / "worlds" / "worlds.md"


@pytest.mark.world("obstacle_course")
async def test_the_documented_example(robot, world, forward):
    (example,) = [part for part in DOCS.read_text().split("```python\n") if "test_picked_up" in part]
    names = {"pytest": pytest, "MotionStatus": MotionStatus, "Vector3": Vector3, "PlatePlace": PlatePlace}
    exec(example.partition("```")[0], names)
    await names["test_picked_up"](robot, world, forward)


def test_stage_find_only_what_is_there(simulate):
    sim = simulate()
    for touch in (
        lambda: sim.world.stage.lift("z"),
        lambda: sim.world.stage.push("z", Vector3()),
        lambda: sim.world.stage.touch_plate("a", "roof"),
        lambda: sim.world.stage.apply_voltage("a", 9, 1, 1.0),
        lambda: sim.world.truth.thing("moon"),
    ):
        with pytest.raises(NotFound):
            touch()


NAN, FAR = math.nan, 1e9


@pytest.mark.parametrize(
    "ask",
    [
        lambda stage: stage.lift("a", NAN),
        lambda stage: stage.lift("a", FAR),
        lambda stage: stage.push("a", Vector3(0.0, 0.0, math.inf)),
        lambda stage: stage.push("a", Vector3(FAR)),
        lambda stage: stage.pull("a", Point(0.0, NAN)),
        lambda stage: stage.roll_over("a", math.inf),
        lambda stage: stage.touch("a", "often"),
        lambda stage: stage.place("a", Pose(), 0.5),
        lambda stage: stage.move_thing("can", Vector3(NAN)),
        lambda stage: stage.make_sound(claps(1), Point(1.0, 1.0), loudness=NAN),
    ],
)
async def test_impossible_values_change_nothing(simulate, ask):
    """Not even for the robots beside it: all share one physics."""
    sim = simulate("obstacle_course", robots=("a", "b"), body="cyberdog2")
    hands = sim.world.stage
    sim.world.start()
    await sim.clock.advance(0.5)
    before = [robot.pose for robot in hands.robots]
    with pytest.raises(ValueError, match=r"not|no place"):
        ask(hands)
    await sim.clock.advance(0.5)
    moved = [robot.pose.distance_to(there) for robot, there in zip(hands.robots, before, strict=True)]
    assert max(moved) < 0.01, moved


async def test_somebody_more_stands_in_way_until_taken_away(simulate):
    sim = simulate("empty")
    hands, start = sim.world.stage, sim.world.stage.robots[0].pose
    ahead = start.compose(Pose(1.2, 0.0))
    assert hands.add_person(ahead) == "visitor 1"
    with pytest.raises(ValueError, match="already"):
        hands.add_person(ahead, name="visitor 1")
    sim.world.start()

    async def driven(seconds: float) -> float:
        for _ in range(round(seconds * 10)):
            with suppress(Collided):
                sim.robot[Base].set_velocity(Twist(0.4, 0.0, 0.0))
            await sim.clock.advance(0.1)
        return hands.robots[0].pose.distance_to(start)

    assert await driven(6.0) < 1.2
    hands.remove_person("visitor 1")
    with pytest.raises(NotFound):
        hands.person("visitor 1")
    assert await driven(6.0) > 2.0


async def battle(simulate, seed):
    """All that two robots feel who shoot at each other on the ramp."""
    sim = simulate("obstacle_course", start=Pose(2.0, 4.0), robots=("a", "b"), body="robomaster_ep", seed=seed)
    sim.world.stage.place("b", Pose(4.9, 4.0, 3.1))
    felt = []
    for robot in sim.robots.values():
        robot.events.listen(ArmorHit, lambda event: felt.append(repr(event)))
        robot[Gimbal].set_mode(FollowMode.FREE)
        robot[Armor].set_sensitivity(10)
        robot[Blaster].set_beads(8)
        robot[RangeSensors].measure(True)
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(0.7, 0.05, 0.1))
    for _ in range(6):
        for robot in sim.robots.values():
            robot[Blaster].fire()
            felt.append(repr((robot[Imu].reading, robot[MotionStatus].flags, robot[RangeSensors].reading("ir_1"))))
        await sim.clock.advance(1.1)
    felt += map(repr, sim.world.truth.bead_landings)
    return felt


@pytest.mark.slow  # long; test_world_trace.py has the same seed's trace
async def test_the_same_seed_gives_the_same_battle(simulate):
    first = await battle(simulate, 3)
    assert first == await battle(simulate, 3)
    assert first != await battle(simulate, 4)


async def test_robot_put_elsewhere_has_its_weight(simulate):
    sim = simulate("empty", start=Pose(4.0, 5.0))
    sim.world.start()
    hands, hull = sim.world.stage, sim.world._physics.hulls["a"]
    hands.lift("a")
    await sim.clock.advance(1.0)
    hands.place("a", Pose(6.0, 5.0))
    await sim.clock.advance(0.5)
    assert hull.support.sprung
    assert hull.rise == pytest.approx(0.0, abs=1e-3)


PLACES = {  # in the office, for a universal of 0.25 m radius
    "a wall": Pose(15.0, 0.1),
    "furniture": Pose(4.0, 2.0),
    "b": Pose(23.4, 8.9),
    "person 0 0": None,
}


@pytest.mark.parametrize("what", PLACES)
async def test_no_robot_is_put_into_anything(simulate, what):
    sim = simulate("office", robots=("a", "b"))
    world, before = sim.world, sim.pose
    at = PLACES[what] or world.stage.person(what).pose
    with pytest.raises(Refused, match=f"{what} is in the way"):
        world.stage.place("a", at)
    assert sim.pose == before


async def test_robots_may_touch_walls_and_stand_below_boards(simulate):
    sim = simulate(replace(load_world("empty"), floors=(under_a_board(),)), start=Pose(6.0, 5.0))
    radius = sim.robot.description.radius
    sim.world.stage.place("a", Pose(5.0, radius))
    sim.world.stage.place("a", Pose(4.0, 5.0))  # the board is above it
    sim.world.start()
    await sim.clock.advance(2.0)
    assert sim.pose.distance_to(Pose(4.0, 5.0)) < 0.01
    assert sim.world.truth.height_of("a") == pytest.approx(0.0, abs=0.01)


def under_a_board():
    board = Box(at=(4.0, 5.0), size=(1.2, 1.2, 0.05), base=1.5)
    return replace(load_world("empty").floors[0], furniture=(board,))


@pytest.mark.parametrize("floor", [0, 1])
async def test_no_robot_is_put_into_an_empty_shaft(simulate, floor):
    sim = simulate("office")
    middle = Pose(*known(sim.world.description.lift).at)
    if floor == known(sim.world.description.lift).parked_at:
        sim.world.stage.place("a", middle, floor)
    else:
        with pytest.raises(Refused, match="a gap in the floor is in the way"):
            sim.world.stage.place("a", middle, floor)


async def test_nothing_is_put_into_a_robot(simulate):
    sim = simulate("empty", start=Pose(5.0, 5.0))
    hands, there = sim.world.stage, Pose(5.2, 5.1)
    box, name = hands.add_obstacle(Pose(8.0, 8.0)), hands.add_person(Pose(2.0, 2.0))
    for put in (
        lambda: hands.add_obstacle(there),
        lambda: hands.move_obstacle(box, there, 0),
        lambda: hands.add_person(there),
        lambda: hands.person(name).place(5.2, 5.1),
    ):
        with pytest.raises(Refused, match="a stands there"):
            put()
    sim.world.start()
    await sim.clock.advance(1.0)
    assert sim.world.truth.height_of("a") == pytest.approx(0.0, abs=0.01)


def test_nothing_is_put_outside_of_the_world(simulate):
    stage = simulate("empty").world.stage
    box, tag = stage.add_obstacle(Pose(8.0, 8.0)), stage.add_tag("1", Pose(8.0, 8.0))
    for pose, floor in ((Pose(8.0, 8.0), 1), (Pose(8.0, 8.0), -1), (Pose(-9000.0, 8.0), 0), (Pose(8.0, math.nan), 0)):
        for put in (
            lambda pose, floor: stage.add_obstacle(pose, floor=floor),
            lambda pose, floor: stage.move_obstacle(box, pose, floor),
            lambda pose, floor: stage.add_tag("2", pose, floor),
            lambda pose, floor: stage.move_tag(tag, pose, floor),
            lambda pose, floor: stage.add_person(pose, floor),
            lambda pose, floor: stage.place("a", pose, floor),
            lambda pose, floor: stage.make_sound(claps(), pose.point, floor),
        ):
            with pytest.raises(ValueError, match="has no place"):
                put(pose, floor)
    assert (len(stage.obstacles), len(stage.tags), len(stage.people)) == (1, 1, 0)


async def test_robot_goes_back_only_to_a_free_start(simulate):
    sim = simulate("empty", start=Pose(5.0, 5.0))
    sim.world.stage.place("a", Pose(8.0, 8.0))
    box = sim.world.stage.add_obstacle(Pose(5.0, 5.0))
    with pytest.raises(Refused, match="cannot go back to its start: furniture is in the way"):
        sim.world.stage.reset("a")
    sim.world.stage.remove_obstacle(box)
    sim.world.stage.reset("a")
    assert sim.pose.distance_to(Pose(5.0, 5.0)) < 0.01


@pytest.mark.parametrize("limp", [False, True])
async def test_reset_dog_stands(simulate, limp):
    sim = simulate("empty", body="cyberdog2", start=Pose(5.0, 5.0))
    sim.world.start()
    legs = sim.robot[Legs]
    if limp:
        legs.go_limp()
    else:
        legs.lie_down()
    await sim.clock.advance(5.0)
    assert legs.posture is not Posture.STANDING
    sim.world.stage.reset("a")
    await sim.clock.advance(0.5)
    assert legs.posture is Posture.STANDING
    sim.robot[Base].set_velocity(Twist(0.3, 0.0, 0.0))
    await sim.clock.advance(3.0)
    assert sim.world.truth.pose_of("a").x > 5.5


async def test_reset_ends_emergency_stop_and_released_brake(simulate):
    sim = simulate("empty", start=Pose(5.0, 5.0))
    sim.world.start()
    stop = sim.robot[EmergencyStop]
    assert isinstance(stop, SimulatedEmergencyStop)
    stop.press(True)
    stop.release_brake(True)
    await sim.clock.advance(1.0)
    sim.world.stage.reset("a")
    assert (stop.pressed, stop.engaged, stop.brake_released) == (False, False, False)
    sim.robot[Base].set_velocity(Twist(0.3, 0.0, 0.0))
    await sim.clock.advance(3.0)
    assert sim.world.truth.pose_of("a").x > 5.5


@pytest.mark.parametrize("yaw", [1e300, -4e10, 3 * math.pi])
async def test_every_finite_heading_can_be_taken(simulate, yaw):
    """Physics takes angles beyond 1e10 for an explosion, and puts all robots of the world at its origin."""
    sim = simulate("empty", start=Pose(5.0, 5.0, yaw), robots=("a", "b"), compiled=False)
    sim.world.start()
    sim.world.stage.place("b", Pose(8.0, 5.0, yaw))
    for robot in sim.robots.values():
        robot[Base].set_velocity(Twist(0.2, 0.0, 0.0))
    await sim.clock.advance(1.0)
    for name, x in (("a", 5.0), ("b", 8.0)):
        pose = sim.world.truth.pose_of(name)
        assert pose.distance_to(Pose(x, 5.0)) < 0.25
        assert abs(wrap_angle(pose.yaw - math.remainder(yaw, math.tau))) < 0.01
