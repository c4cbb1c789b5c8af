"""examples/programs: each program does what its comment says, on a dog with people around it."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.interaction.light import Colour
from roboglot.model.components.interaction.members import Members
from roboglot.model.components.mapping.map_library import Label, MapLibrary, StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.sensing.touch import TouchKind
from roboglot.model.geometry import Point, Pose
from roboglot.model.perception import Gesture, Sport
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Finished
from roboglot.simulation.world.world import World
from tests.programs.staging import Act, Performance, Stage

FOLDER = Path(__file__).parents[2] / "examples" / "programs"


@dataclass
class Scene:
    """The robot, where it is, and its people."""

    robot: Robot
    world: World
    clock: LockstepClock

    def touch(self, kind: TouchKind = TouchKind.SINGLE) -> Callable[[], None]:
        return lambda: self.world.stage.touch("a", kind)

    async def anna_stands_before_it(self, distance: float = 3.5) -> None:
        self.world.stage.place("a", Pose(2.0, 5.0))
        for name, x, y in (("ben", 1.0, 7.5), ("anna", 2.0 + distance, 5.0)):
            person = self.world.stage.person(name)
            person.stand()
            person.place(x, y, 180)
            await self.robot[Members].add(name.title())
            await self.robot[Members].set_face(name.title(), person.face)
        await self.clock.advance(0.5)


Prepare = Callable[[Scene], Coroutine[Any, Any, list[Act]]]


async def nothing(scene: Scene) -> list[Act]:
    return []


async def a_box_ahead(scene: Scene) -> list[Act]:
    scene.world.stage.add_obstacle(Pose(2.4, 5.0), (0.3, 0.8, 0.5))
    return []


async def a_box_to_the_left(scene: Scene) -> list[Act]:
    scene.world.stage.add_obstacle(Pose(3.2, 5.3), (0.3, 0.8, 0.5))
    return []


async def a_box_nearby(scene: Scene) -> list[Act]:
    scene.world.stage.place("a", Pose(2.0, 5.0))
    scene.world.stage.add_obstacle(Pose(3.1, 5.0), (0.3, 0.8, 0.5))
    return []


async def an_intruder(scene: Scene) -> list[Act]:
    scene.world.stage.place("a", Pose(2.0, 5.0))
    return [(4.0, lambda: scene.world.stage.add_obstacle(Pose(3.6, 5.4), (0.4, 0.4, 1.0)))]


async def anna_trains(scene: Scene) -> list[Act]:
    await scene.anna_stands_before_it()
    return [(5.0, lambda: scene.world.stage.person("anna").do_sport(Sport.SQUAT, count=4, period=2.0))]


async def anna_leads(scene: Scene) -> list[Act]:
    await scene.anna_stands_before_it()
    return [(4.0, lambda: scene.world.stage.person("anna").walk_to(7.3, 5.0)), (12.0, scene.touch())]


async def anna_gestures(scene: Scene) -> list[Act]:
    await scene.anna_stands_before_it()
    anna = scene.world.stage.person("anna")
    kinds = ((1.0, Gesture.STOP), (9.0, Gesture.THUMB_UP), (18.0, Gesture.PULL))
    return [(at, partial(anna.gesture, kind, seconds=2)) for at, kind in kinds]


async def anna_then_ben(scene: Scene) -> list[Act]:
    await scene.anna_stands_before_it()
    return [
        (2.0, lambda: scene.world.stage.person("anna").place(1.0, 1.0, 180)),
        (5.0, lambda: scene.world.stage.person("ben").place(5.5, 5.2, 180)),
    ]


async def anna_speaks(scene: Scene) -> list[Act]:
    await scene.anna_stands_before_it(2.0)
    anna = scene.world.stage.person("anna")
    said = ((1.0, "暂停任务"), (9.0, "good dog"), (15.0, "继续任务"), (24.0, "终止任务"))
    return [(at, partial(anna.say, text)) for at, text in said]


async def a_tune(scene: Scene) -> list[Act]:
    kinds = ((1.0, TouchKind.SINGLE), (2.0, TouchKind.DOUBLE), (4.0, TouchKind.LONG), (6.0, TouchKind.SINGLE))
    return [(at, scene.touch(kind)) for at, kind in kinds]


async def a_late_sleeper(scene: Scene) -> list[Act]:
    return [(8.0, scene.touch())]


async def a_map(scene: Scene) -> list[Act]:
    await scene.clock.advance(3.0)
    labels = (Label("kitchen", Point(1.6, 0.3)), Label("desk", Point(0.8, 0.0)))
    stored = StoredMap("home", scene.robot[Mapping].grid, scene.clock.epoch(), labels)
    await scene.robot[MapLibrary].put(stored)
    return [(14.0, scene.touch()), (20.0, scene.touch())]


@dataclass(frozen=True)
class Case:
    """Surroundings of a program, its output, words and lights, the robot's final pose, and further conditions."""

    prints: str
    prepare: Prepare = nothing
    world: str = "empty"
    said: tuple[str, ...] | None = None
    ends_at: tuple[float, float] | None = None
    then: Callable[[Scene, Performance], bool] = lambda _scene, _played: True


RAINBOW = {Colour(255, 0, 0), Colour(255, 120, 0), Colour(255, 255, 0), Colour(0, 255, 0), Colour(0, 0, 255)}
CASES = {
    "patrol": Case(
        "east something is there\nnorth clear\nwest clear\nsouth clear\nround finished, clear on 3 of 4 sides\n",
        a_box_ahead,
        ends_at=(1.15, 5.0),
        then=lambda _scene, played: played.blocks == [f"corner {name}" for name in ("east", "north", "west", "south")],
    ),
    "guard_dog": Case(
        "watching\nintruder at 1.4 m\n",
        an_intruder,
        said=("bark 4001",),
        then=lambda _scene, played: Colour(255, 0, 0) in played.colours and 4.0 < played.seconds < 6.0,
    ),
    "fitness_coach": Case("3 squats\n", anna_trains, "playground", ("Let us do 3 squats", "Well done!")),
    "light_show": Case(
        "red orange yellow green blue violet \n" * 2, then=lambda _scene, played: played.colours > RAINBOW
    ),
    "follow_me": Case("coming\nstopped by a touch\nI am 4.0 m further\n", anna_leads, "playground", ends_at=(5.9, 5.0)),
    "measure_room": Case("length 9.9 m, width 10.0 m, area 99 m2\n"),
    "parking_aid": Case(
        "0.66 m\n0.49 m\n0.39 m\n0.34 m\nparked after 3 steps\n", a_box_nearby, said=("bark 4000",), ends_at=(2.35, 5.0)
    ),
    "touch_piano": Case("tune: woof bow-wow grrr woof\n", a_tune, said=("bark 4000", "bark 4001", "grrr", "bark 4000")),
    "voice_commands": Case(
        "I listen for 3 phrases\nheard 暂停任务\nheard 继续任务\nheard 终止任务\n",
        anna_speaks,
        "playground",
        then=lambda scene, _played: scene.robot[Legs].posture is Posture.STANDING,
    ),
    "dance": Case(
        "thank you!\n",
        ends_at=(1.26, 5.0),
        then=lambda _scene, played: {"dancer.dance", "cyberdog.motion.bow"} < set(played.calls) and played.seconds > 30,
    ),
    "battery_watch": Case("charge 90 %\non battery\n22 W for 5 s\n", said=()),
    "gesture_control": Case("down\nup\ncoming\n", anna_gestures, "playground", ends_at=(2.4, 5.0)),
    "greet_family": Case(
        "greeted: Anna, Ben\n", anna_then_ben, "playground", ("Hello, young Anna!", "Hello, dear Ben!")
    ),
    "polygon": Case("3 corners: closed\n4 corners: closed\n", ends_at=(1.36, 5.0)),
    "compass": Case("I was turned by more than 30 degrees: True\nback within 5 degrees\n"),
    "explorer": Case("turning right\n1 turns\n", a_box_to_the_left),
    "dice": Case("left 1\nright 3\nwinner: right\n"),
    "alarm_clock": Case("good morning after 4 rings\n", a_late_sleeper, said=("bark 4001",) * 4),
    "own_steps": Case("2 gaits: True forward\n", ends_at=(1.07, 5.0)),
    "delivery": Case(
        "I know desk, kitchen\ntaken\nback\n",
        a_map,
        "office",
        ("Your delivery. Please touch my head when you have taken it.",),
        then=lambda _scene, played: played.blocks == ["to the kitchen", "to the desk"],
    ),
}


@pytest.mark.parametrize(
    "name",
    [  # one example in ten; the others are slow
        pytest.param(
            name, marks=[pytest.mark.world(case.world, body="cyberdog2"), *([pytest.mark.slow] if n % 10 else [])]
        )
        for n, (name, case) in enumerate(CASES.items())
    ],
)
async def test_an_example_does_what_it_says(name: str, robot: Robot, world: World, clock: LockstepClock) -> None:
    case, scene = CASES[name], Scene(robot, world, clock)
    acts = await case.prepare(scene)
    async with Engine() as engine:
        played = await Stage(engine, robot, clock).play((FOLDER / f"{name}.py").read_text("utf-8"), acts)
    assert played.ending == Finished()
    assert played.printed == case.prints
    assert case.said is None or tuple(played.said) == case.said
    assert case.ends_at is None or world.truth.pose_of("a").distance_to(Point(*case.ends_at)) < 0.15
    assert case.then(scene, played)


def test_every_example_is_played_and_explained() -> None:
    assert {path.stem for path in FOLDER.glob("*.py")} == set(CASES)
    assert len(CASES) >= 20
    for path in FOLDER.glob("*.py"):
        assert "# For teachers: " in path.read_text("utf-8").partition("\n\n")[0], path.name
