"""cyberdog.navigation on the simulated robot: judged by the world."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace

import numpy as np
import pytest

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.mapping.localization import LOCALIZATION, Localization, Region
from roboglot.model.components.mapping.map_library import Label, MapLibrary, StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.driving import Driving
from roboglot.model.errors import NotLocalized
from roboglot.model.events import ScanTaken, Spoke
from roboglot.model.geometry import Point, Pose, Twist
from roboglot.model.maps import OccupancyGrid
from roboglot.programs.functions.moving.navigating import HELP_SECONDS, REQUEST, same_origin
from roboglot.simulation.world.world import World
from roboglot.testing import passed_in_order
from tests.narrowing import of_kind
from tests.programs.functions.calling import Caller, field

pytestmark = pytest.mark.world("office")


def result_of(record: object) -> tuple[int, int]:
    return field(record, "state.code"), field(record, "response.result")


@pytest.fixture
async def home(caller: Caller) -> Caller:
    """A robot that has looked around and saved its map with a point on it."""
    await caller.clock.advance(3.0)
    await caller("cyberdog.motion.go_straight", 0.5, 1.0)
    await caller.clock.advance(2.0)
    labels = (Label("kitchen", Point(1.6, 0.3)), Label("nowhere", Point(500.0, 0.0)))
    grid = caller.robot[Mapping].grid
    await caller.robot[MapLibrary].put(StoredMap("home", grid, caller.clock.epoch(), labels))
    return caller


def driven(world: World, start: object) -> tuple[float, float]:
    pose = world.truth.pose_of("a").relative_to(of_kind(start, Pose))
    return pose.x, pose.y


async def test_presets_are_the_points_of_the_newest_map(home: Caller) -> None:
    presets = await home("cyberdog.navigation.get_preset")
    assert field(presets, "map_name") == "home"
    assert [field(point, "label_name") for point in field(presets, "list")] == ["kitchen", "nowhere"]
    assert (field(presets, "dictionary")["kitchen"].fields["physic_x"], field(presets, "state.code")) == (1.6, 0)


async def test_going_to_a_preset(home: Caller, world: World) -> None:
    with home.robot.events.subscribe(Spoke) as said:
        assert result_of(await home("cyberdog.navigation.to_preset", "kitchen", False, True, 40)) == (0, 0)
        assert (await said.next()).text == "navigation succeeded"
    pose = home.robot[Localization].pose
    assert pose.distance_to(Point(1.6, 0.3)) < 0.1


async def test_going_to_coordinates_needs_navigation_on(home: Caller, world: World) -> None:
    before, start = world.truth.pose_of("a"), home.robot[Localization].pose
    assert result_of(await home("cyberdog.navigation.navigation_to_coordinates", 1.5)) == (1, 2)
    assert result_of(await home("cyberdog.navigation.navigation_to_preset", "kitchen")) == (1, 2)
    assert world.truth.pose_of("a").distance_to(before) < 0.01
    assert result_of(await home("cyberdog.navigation.turn_on_navigation")) == (0, 0)
    goal = Point(start.x + 0.5, start.y + 0.4)
    turned = await home("cyberdog.navigation.navigation_to_coordinates", goal.x, goal.y, yaw=math.pi / 2)
    assert result_of(turned) == (0, 0)
    x, y = driven(world, before)
    assert (x, y) == (pytest.approx(0.5, abs=0.1), pytest.approx(0.4, abs=0.1))
    assert math.degrees(world.truth.pose_of("a").relative_to(before).yaw) == pytest.approx(90, abs=3)
    assert result_of(await home("cyberdog.navigation.turn_off_navigation")) == (0, 0)
    assert result_of(await home("cyberdog.navigation.navigation_to_preset", "kitchen")) == (1, 2)


async def test_goals_that_cannot_be_reached(home: Caller) -> None:
    await home("cyberdog.navigation.turn_on_navigation")
    for name, args, expected in (
        ("navigation_to_preset", ("nowhere",), 3),
        ("navigation_to_preset", ("cellar",), 3),
        ("to_preset", ("cellar",), 3),
        ("to_preset", ("kitchen", False, True, 101), 4),
        ("navigation_to_coordinates", (math.nan,), 4),
        ("navigation_to_coordinates", (2e4,), 4),
        ("turn_on_navigation", (True,), 3),
    ):
        assert result_of(await home(f"cyberdog.navigation.{name}", *args)) == (1, expected), (name, args)


async def test_takeover_cancels_the_drive(home: Caller) -> None:
    await home("cyberdog.navigation.turn_on_navigation")
    going = home.start("cyberdog.navigation.navigation_to_preset", "kitchen")
    await home.clock.advance(0.6)
    home.robot[Driving].drive(Twist(), lifetime=0.1, source="someone")
    await home.clock.advance(1.0)
    assert result_of(going.result()) == (1, 5)


async def test_drive_can_be_cancelled(home: Caller, world: World) -> None:
    await home("cyberdog.navigation.turn_on_navigation")
    going = home.start("cyberdog.navigation.navigation_to_preset", "kitchen")
    await home.clock.advance(0.8)
    assert result_of(await home("cyberdog.navigation.cancel_navigation")) == (0, 0)
    assert not home.robot.actions.running()
    await home.clock.advance(0.2)
    assert result_of(going.result()) == (1, 5)


async def test_drive_that_waits_can_be_cancelled(home: Caller) -> None:
    """It went uncancelled while the robot still braked, or got up, for it."""
    await home("cyberdog.navigation.turn_on_navigation")
    home.robot[Driving].drive(Twist(0.5), lifetime=5.0, source="someone")
    await home.clock.advance(1.0)
    going = home.start("cyberdog.navigation.navigation_to_preset", "kitchen")
    await home.clock.advance(0.0)
    assert home.robot.actions.running()[-1].status is ActionStatus.ACCEPTED
    assert result_of(await home("cyberdog.navigation.cancel_navigation")) == (0, 0)
    await home.clock.advance(2.0)
    assert not home.robot.actions.running()
    assert result_of(going.result()) == (1, 5)


async def test_map_of_earlier_life_is_loaded_and_found(home: Caller, world: World) -> None:
    mapping, localization = home.robot[Mapping], home.robot[Localization]
    stored = await home.robot[MapLibrary].get("home")
    pose = localization.pose
    mapping.move_origin(Point(0.5, -0.4))
    assert not same_origin(stored.grid, mapping.grid)
    assert result_of(await home("cyberdog.navigation.turn_on_navigation")) == (0, 0)
    assert same_origin(stored.grid, mapping.grid)
    assert localization.pose.distance_to(pose) < 0.1


async def cut_off(program: Caller, call: asyncio.Task[object]) -> None:
    """End the program in the middle of its call, as a task's run does."""
    call.cancel()
    program.session.cancel("the program has ended")
    for _ in range(10):
        await program.clock.advance(0.5)
    assert call.done()


async def test_ended_program_keeps_no_other_map(home: Caller) -> None:
    """The stored map stayed loaded, with the robot nowhere in it."""
    home.robot[Mapping].move_origin(Point(0.5, -0.4))
    before, pose = home.robot[Mapping].grid, home.robot[Localization].pose
    stored = await home.robot[MapLibrary].get("home")
    turning_on = home.start("cyberdog.navigation.turn_on_navigation")
    await home.clock.advance(0.0)
    assert same_origin(stored.grid, home.robot[Mapping].grid)
    await cut_off(home, turning_on)
    assert same_origin(before, home.robot[Mapping].grid)
    assert home.robot[Localization].pose.distance_to(pose) < 0.1


async def test_ended_program_says_nothing_more(home: Caller) -> None:
    """The robot said that navigation had failed, after its program's end."""
    with home.robot.events.subscribe(Spoke) as said:
        going = home.start("cyberdog.navigation.to_preset", "kitchen", False, True, 40)
        await home.clock.advance(1.0)
        await cut_off(home, going)
        another = Caller(home.robot, home.clock, "another")
        training = another.start("cyberdog.skeleton.sports_recognition", 1, 2, 30)
        await home.clock.advance(1.0)
        another.session.cancel("the program was ended")
        await home.clock.advance(5.0)
        assert training.done()
        assert said.drain() == []


@pytest.mark.slow
async def test_lost_robot_is_helped(home: Caller, monkeypatch: pytest.MonkeyPatch) -> None:
    localization, known = home.robot[Localization], []
    find = localization.relocalize

    async def fails(action: Action) -> None:
        await home.clock.sleep(1.0)
        raise NotLocalized("no place fits")

    def relocalize(region: Region | None = None, *, source: str = "") -> Action:
        return (
            find(source=source)
            if known
            else home.robot.actions.start("relocalize", fails, resources=[LOCALIZATION], source=source)
        )

    monkeypatch.setattr(localization, "relocalize", relocalize)
    home.robot[Mapping].move_origin(Point(0.5, -0.4))
    assert result_of(await home("cyberdog.navigation.turn_on_navigation")) == (1, 3)
    with home.robot.events.subscribe(Spoke) as said:
        helped = home.start("cyberdog.navigation.to_preset", "kitchen", True, True, 40)
        await home.clock.advance(12.0)
        assert not helped.done()
        assert (await said.next()).text == REQUEST
        known.append("here")  # it was carried
        assert result_of(await helped_to_the_end(home, helped)) == (0, 0)
        assert (await said.next()).text == "navigation succeeded"
    known.clear()
    home.robot[Mapping].move_origin(Point(0.5, -0.4))
    start = home.clock.time()
    assert result_of(await home("cyberdog.navigation.turn_on_navigation", False, True)) == (1, 3)
    assert home.clock.time() - start == pytest.approx(HELP_SECONDS, abs=3.0)


async def helped_to_the_end(home: Caller, helped: asyncio.Task[object]) -> object:
    for _ in range(400):
        await home.clock.advance(0.5)
        if helped.done():
            break
    return helped.result()


async def test_without_a_map(caller: Caller, bare_caller: Caller) -> None:
    for which in (caller, bare_caller):
        assert field(await which("cyberdog.navigation.get_preset"), "state.code") == 1
        assert result_of(await which("cyberdog.navigation.turn_on_navigation")) == (1, 3)


def test_maps_of_other_places_have_other_walls() -> None:
    random = np.random.default_rng(1)
    cells = np.where(random.random((60, 60)) > 0.95, 100, -100).astype(np.int8)
    grid = OccupancyGrid(cells, 0.05, Point(-1.0, -1.0))
    assert same_origin(grid, grid)
    assert not same_origin(grid, OccupancyGrid(cells, 0.05, Point(1.0, 0.6)))
    assert not same_origin(grid, OccupancyGrid(cells[:0, :0], 0.05, Point(0.0, 0.0)))


async def test_an_outdoor_map_is_for_outdoors(home: Caller) -> None:
    assert result_of(await home("cyberdog.navigation.turn_on_navigation", True)) == (1, 3)
    stored = await home.robot[MapLibrary].get("home")
    await home.robot[MapLibrary].put(replace(stored, name="garden", outdoor=True))
    assert field(await home("cyberdog.navigation.get_preset"), "is_outdoor") is True
    assert result_of(await home("cyberdog.navigation.turn_on_navigation", True)) == (0, 0)
    await home.robot[MapLibrary].remove("home")
    assert result_of(await home("cyberdog.navigation.turn_on_navigation", False)) == (1, 3)
    assert result_of(await home("cyberdog.navigation.to_preset", "kitchen")) == (0, 0)


async def test_newer_outdoor_map_leaves_indoor_points_alone(home: Caller) -> None:
    stored = await home.robot[MapLibrary].get("home")
    garden = replace(stored, name="garden", outdoor=True, labels=(Label("kitchen", Point(0.4, 0.2)),))
    await home.robot[MapLibrary].put(garden)
    assert result_of(await home("cyberdog.navigation.turn_on_navigation")) == (0, 0)
    assert result_of(await home("cyberdog.navigation.navigation_to_preset", "kitchen")) == (0, 0)
    pose = home.robot[Localization].pose
    assert pose.distance_to(Point(1.6, 0.3)) < 0.1
    await home.robot[MapLibrary].remove("home")
    assert result_of(await home("cyberdog.navigation.navigation_to_preset", "kitchen")) == (1, 3)


async def test_replaced_map_switches_navigation_off(home: Caller) -> None:
    """Points of the map that it was on for lie elsewhere on another client's map."""
    assert result_of(await home("cyberdog.navigation.turn_on_navigation")) == (0, 0)
    grid, pose = home.robot[Mapping].grid, home.robot[Localization].pose
    home.robot[Mapping].load(grid, pose)
    await home.clock.advance(1.0)
    assert result_of(await home("cyberdog.navigation.navigation_to_preset", "kitchen")) == (1, 2)
    assert result_of(await home("cyberdog.navigation.turn_on_navigation")) == (0, 0)
    assert result_of(await home("cyberdog.navigation.navigation_to_preset", "kitchen")) == (0, 0)


@pytest.mark.slow  # in short: test_going_to_a_preset
async def test_a_tour_of_presets_passes_them_in_turn(caller: Caller, world: World) -> None:
    await caller.clock.advance(3.0)
    spots = {"a": Point(1.2, 0.8), "b": Point(1.2, -0.2), "c": Point(1.8, 0.3)}
    labels = tuple(Label(name, place) for name, place in spots.items())
    start = world.truth.pose_of("a")
    await caller.robot[MapLibrary].put(StoredMap("home", caller.robot[Mapping].grid, caller.clock.epoch(), labels))
    track: list[Pose] = []
    caller.robot.events.listen(ScanTaken, lambda _: track.append(world.truth.pose_of("a").relative_to(start)))
    tour = ("a", "b", "a", "a", "c", "b")
    for name in tour:
        assert result_of(await caller("cyberdog.navigation.to_preset", name)) == (0, 0)
    assert passed_in_order(track, [spots[name] for name in tour], 0.08) == len(tour)
