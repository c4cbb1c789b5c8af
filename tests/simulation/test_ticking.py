"""Ticks that a kernel does at once equal those done one by one, to the last bit."""

from __future__ import annotations

import contextlib
import math
import random
from collections.abc import Mapping
from functools import partial

import pytest

from roboglot.model.clock import LockstepClock, Timer
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import RobotError
from roboglot.model.events import Event
from roboglot.model.geometry import Point, Pose, Twist, Vector3
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

from .conftest import Simulate

BODIES = {"a": "universal", "h": "robomaster_ep"}
BUSY = {"a": "universal", "d": "cyberdog2", "h": "hermes"}  # some have something to do in every tick
QUIET, TICK = 60, 0.02  # steps without commands; s


def put_apart(world: World) -> None:
    """Put the robots where nothing is near."""
    for index, name in enumerate(world.robots):
        world.stage.place(name, Pose(3.5 + 1.3 * index, 5.5))


def turn(world: World, twist: Twist) -> None:
    """Drive all robots so that can."""
    for robot in world.robots.values():
        with contextlib.suppress(RobotError):
            robot[Base].set_velocity(twist)


def happen(world: World, step: int) -> None:
    """Let hands, faults and people interfere in some steps of 0.1 s."""
    hands, (person, *_) = world.stage, (walker.key for walker in world._walkers)
    happenings = {
        5: lambda: hands.push("a", Vector3(30.0, 10.0, 5.0)),
        10: lambda: hands.lift("h", 0.2),
        15: lambda: hands.let_go("h"),
        20: lambda: world.faults.inject("motor_fault", "h", duration=1.53),
        25: lambda: "d" in world.robots and world.robot("d")[Legs].lie_down(),
        30: lambda: hands.add_person(hands.robots[0].pose.compose(Pose(1.2, 0.1)), name="eve"),
        32: lambda: hands.person("eve").walk_to(hands.robots[0].pose.x, hands.robots[0].pose.y),
        35: lambda: world.robot("a")[Gimbal].set_mode(FollowMode.GIMBAL_LEAD),
        40: lambda: hands.person(person).walk_to(8.0, 8.0, speed=1.9),
        45: lambda: hands.remove_person("eve"),
        50: lambda: hands.place("a", Pose(22.0, 10.0, 2.0)),
        55: lambda: hands.add_obstacle(Pose(21.3, 10.9)),
        60: lambda: put_apart(world),
        61: lambda: world.robot("a")[Gimbal].set_mode(FollowMode.CHASSIS_LEAD),
        65: lambda: turn(world, Twist(0.1, 0.0, 0.6)),
        80: lambda: world.faults.inject("motor_fault", "h", duration=0.51),
        99: lambda: turn(world, Twist()),
    }
    if happening := happenings.get(step):
        happening()


class CountingClock(LockstepClock):
    """Counts how often a world went ahead."""

    leaps = 0

    def go_ahead(self, when: float) -> None:
        self.leaps += 1
        super().go_ahead(when)


async def lived(bodies: Mapping[str, str], *, at_once: bool) -> tuple[list[str], int]:
    """Return all that happens to robots and people with whom hands interfere, and how often time went ahead."""
    clock, dice, lines = CountingClock(), random.Random(5), list[str]()

    def note(name: str, event: Event) -> None:
        lines.append(f"{name} {clock.time()} {clock.turn} {type(event).__name__} {event.stamp}")

    placements = [RobotPlacement(name, body) for name, body in bodies.items()]
    world = World(load_world("office"), placements, clock=clock, seed=4)
    robots = [Robot(name, world.description_of(name), clock) for name in bodies]
    for robot in robots:
        world.equip(robot)
        robot.events.listen(Event, partial(note, robot.id))
    await world.prepare(wait=True)
    if not at_once:
        world._ticking._run = world._crowd._walk = None
    world.start()
    for step in range(60 + QUIET):
        await clock.advance(0.1 if step % 7 else 0.13)
        for robot in robots if step < 60 else ():
            if dice.random() < 0.2:
                sideways = dice.choice((0.0, 0.2))
                with contextlib.suppress(RobotError):
                    robot[Base].set_velocity(Twist(dice.uniform(-0.5, 0.8), sideways, dice.uniform(-1.0, 1.0)))
        happen(world, step)
        lines += [f"{robot[Imu].reading} {robot[Odometry].reading} {world.truth.pose_of(robot.id)}" for robot in robots]
        lines += [f"{walker.key} {walker.pose} {walker.walking} {walker.doing}" for walker in world._walkers]
    world.close()
    return lines, clock.leaps


@pytest.mark.parametrize(("bodies", "least"), [(BODIES, 40), (BUSY, 0)])
async def test_ticks_at_once_equal_those_one_by_one(bodies: Mapping[str, str], least: int) -> None:
    (lines, leaps), (slowly, none) = await lived(bodies, at_once=True), await lived(bodies, at_once=False)
    assert lines == slowly
    assert leaps >= least
    assert not none


async def test_time_ends_when_asked(simulate: Simulate) -> None:
    simulation = simulate("office")
    world, clock = simulation.world, simulation.clock
    await world.prepare(wait=True)
    world.start()
    stamps: list[float] = []
    clock.call_at(0.05, lambda: stamps.append(world.time))
    for end in (0.03, 0.11, 0.19):
        await clock.advance_to(end)
        assert world.time == pytest.approx(math.floor(end / TICK) * TICK)
    assert stamps == [pytest.approx(0.04)]


async def test_faults_end_in_their_tick(simulate: Simulate, monkeypatch: pytest.MonkeyPatch) -> None:
    simulation = simulate("office")
    world, faults, ended = simulation.world, simulation.world.faults, list[float]()
    monkeypatch.setattr(faults, "_end", lambda _numbers: ended.append(world.time))
    await world.prepare(wait=True)
    world.start()
    await simulation.clock.advance(1.0)
    wanted = [0.03, 0.05, 0.09, 0.11, 0.15, 0.17]
    for seconds in wanted:
        faults.inject("low_battery", duration=seconds)
        faults._active.clear()
    await simulation.clock.advance(0.5)
    assert ended == [pytest.approx(1.0 + math.ceil(seconds / TICK) * TICK) for seconds in wanted]


async def test_people_walk_past_robots_as_without_the_kernel(simulate: Simulate) -> None:
    """Those who wait for a robot, step aside, turn, stand or are moved included."""

    async def walked(*, compiled: bool) -> list[str]:
        simulation = simulate("office", start=Pose(7.0, 6.0), compiled=False)
        world, found = simulation.world, list[str]()
        if compiled:
            world._crowd.load_kernels()
        one, other, *_ = (world.stage.person(walker.key) for walker in world._walkers)
        one.place(9.0, 6.0)
        one.walk_to(5.0, 6.0)
        one.look_at(0.0, 0.0)
        other.walk_to(8.0, 8.0, speed=1.9)
        world.start()
        for tick in range(700):
            await simulation.clock.advance(TICK)
            if tick == 300:
                other.place(8.0, 7.0)
                other.resume()
            found += [f"{walker.pose} {walker.walking} {walker.way} {walker.doing}" for walker in world._walkers]
            found.append(str(world._physics._data.mocap_pos.tolist()) + str(world._physics._data.mocap_quat.tolist()))
        return found

    assert await walked(compiled=True) == await walked(compiled=False)


class PassingClock(LockstepClock):
    """Time that passes by itself, as far as a world can tell."""

    repeats = False

    @property
    def free_until(self) -> float:
        return self.time()

    @property
    def next_due(self) -> float:
        return min((when for when, _, timer in self._heap if timer.callback), default=math.inf)

    def go_ahead(self, when: float) -> None:
        assert when <= self.time() + 1e-9


async def commanded(body: str, clock: LockstepClock) -> tuple[list[str], float]:
    """Return what a robot does that is commanded at odd times and rests between, and the world's beats per tick."""
    world = World(load_world("empty"), [RobotPlacement("a", body, start=Pose(5.0, 5.0))], clock=clock)
    robot, dice, lines, begun = Robot("a", world.description_of("a"), clock), random.Random(3), list[str](), 0
    world.equip(robot)
    await world.prepare(wait=True)
    advance = world._beat._advance

    def count(fired: Timer | None) -> None:
        nonlocal begun
        begun += 1
        advance(fired)

    world._beat._advance = count  # type: ignore[method-assign]
    world.start()
    await clock.advance(1.5)
    for step in range(40):
        await clock.advance(dice.uniform(0.0, 0.25))
        if step % 8 in (1, 6):
            robot[Base].set_velocity(Twist(0.0, 0.0, dice.choice((-1.0, 1.0))))
        elif step % 8 in (2, 5) and Gimbal in robot:
            robot[Gimbal].set_speed(0.0, dice.choice((-1.0, 1.0)))
        elif step % 4 == 3:
            robot[Base].set_velocity(Twist())
            await robot.actions.cancel()
            await clock.advance(1.2)
        reading = robot[Odometry].reading
        angles = robot[Gimbal].angles if Gimbal in robot else None
        lines.append(f"{world.truth.pose_of('a')} {reading.pose} {reading.twist} {angles}")
    world.close()
    return lines, begun / (world.simulated / TICK)


@pytest.mark.parametrize(("body", "most"), [("universal", 0.8), ("robomaster_ep", 0.8), ("cyberdog2", 1.01)])
async def test_rest_in_real_time_moves_no_command(body: str, most: float) -> None:
    """Ticks that wait while a robot rests are done before it follows a command, as if each had had its time."""
    (passing, beats), (lockstep, _) = await commanded(body, PassingClock()), await commanded(body, CountingClock())
    assert passing == lockstep
    assert len({*passing}) > 12
    assert beats < most


async def test_timers_of_real_time_find_ticks_done() -> None:
    clock = PassingClock()
    world = World(load_world("empty"), [RobotPlacement("a", start=Pose(3.0, 2.0))], clock=clock)
    world.equip(Robot("a", world.description_of("a"), clock))
    await world.prepare(wait=True)
    world.start()
    await clock.advance(2.09)
    stamps = list[float]()
    assert world.time == pytest.approx(2.0)  # it rests until the robot has something due
    assert world.simulated == pytest.approx(2.08)  # it keeps up all the same
    for when in (2.125, 2.15, 2.31, 2.33):
        clock.call_at(when, lambda: stamps.append(world.time))
    await clock.advance(0.5)
    assert stamps == [pytest.approx(math.floor(when / TICK) * TICK) for when in (2.125, 2.15, 2.31, 2.33)]
    world.close()


async def staged(body: str, clock: LockstepClock) -> list[str]:
    """Return the course of a resting robot that is moved by hand at odd times."""
    world = World(load_world("yard"), [RobotPlacement("a", body, start=Pose(5.0, 5.0))], clock=clock)
    world.equip(Robot("a", world.description_of("a"), clock))
    await world.prepare(wait=True)
    world.start()
    dice, lines, stage = random.Random(5), list[str](), world.stage
    await clock.advance(2.5)
    for change in (
        lambda: stage.place("a", Pose(6.0, 5.0, 0.5)),
        lambda: stage.roll_over("a"),
        lambda: stage.reset("a"),
        lambda: stage.pull("a", Point(60.0, 0.0)),
        lambda: stage.pull("a", Point(0.0, 0.0)),
        lambda: stage.add_obstacle(Pose(7.0, 5.0)),
    ):
        await clock.advance(dice.uniform(2.0, 2.1))
        change()
        for _ in range(40):
            await clock.advance(TICK)
            hull = world._population.hull("a")
            lines.append(
                f"{hull.pose} {hull.elevation:.6f} {hull.overturned} {world.robot('a')[Odometry].reading.pose}"
            )
    world.close()
    return lines


@pytest.mark.parametrize("body", ["universal", "robomaster_ep"])
async def test_rest_in_real_time_moves_no_hand(body: str) -> None:
    """A robot moved by hand began to slide or fall up to 80 ms before it was."""
    assert await staged(body, PassingClock()) == await staged(body, CountingClock())
