"""The example of each function on the reference page does what the page says."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from typing import cast

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.interaction.members import Members
from roboglot.model.components.mapping.map_library import Label, MapLibrary, StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.motion.motions import MOTIONS as MOTION_SPECS
from roboglot.model.components.motion.motions import Motion, MotionSpec
from roboglot.model.components.sensing.touch import TouchKind
from roboglot.model.geometry import Point, Pose
from roboglot.model.perception import Gesture, Sport
from roboglot.model.robot import Robot
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Finished
from roboglot.programs.functions.moving.performing import RESULT_MOTIONS
from roboglot.simulation.world.world import World
from roboglot.wire.contracts import contract
from tests.programs.functions.effects import EFFECTS, Seen
from tests.programs.functions.examples import Example, examples
from tests.programs.staging import Act, Stage

EXAMPLES = examples()
# s that a figure takes here; tests/simulation/bodies/test_performing.py has its real time, up to two minutes.
PARTS = 12  # of the examples of motions, the first of which is for every run
FIGURE = 2.0
MOTIONS = [f"cyberdog.motion.{name}" for name, _, _ in RESULT_MOTIONS]
WITH_PEOPLE = [
    name for name in EXAMPLES if name.split(".")[1] in ("follow", "gesture", "personnel", "skeleton", "train")
]
WITH_MAP = [name for name in EXAMPLES if name.startswith("cyberdog.navigation.")]
OTHERS = sorted(set(EXAMPLES) - set(WITH_PEOPLE) - set(WITH_MAP) - set(MOTIONS))
HALVES = [0, pytest.param(1, marks=pytest.mark.slow)]
HAPPENINGS: dict[str, Callable[[World], object]] = {
    "": lambda _world: None,
    "a person holds a thumb up": lambda world: world.stage.person("anna").gesture(Gesture.THUMB_UP, seconds=3),
    "a person holds a flat hand up": lambda world: world.stage.person("anna").gesture(Gesture.STOP, seconds=3),
    "a person does squats": lambda world: world.stage.person("anna").do_sport(Sport.SQUAT, count=5, period=2.0),
    "a person says 暂停任务": lambda world: world.stage.person("anna").say("暂停任务"),
    "Anna says something": lambda world: world.stage.person("anna").say("good morning"),
    "a person touches it twice": lambda world: world.stage.touch("a", TouchKind.DOUBLE),
}


class Player:
    """Plays examples one after the other on one robot."""

    def __init__(self, engine: Engine, robot: Robot, world: World, clock: LockstepClock) -> None:
        self.stage = Stage(engine, robot, clock)
        self.robot = robot
        self.world = world
        self.clock = clock

    async def play(self, name: str, example: Example) -> None:
        acts: list[Act] = [(0.5, lambda: HAPPENINGS[example.when](self.world))]
        before, actions = self.world.truth.pose_of("a"), self.robot.actions
        known = {action.id for action in [*actions.history, *actions.running()]}
        played = await self.stage.play(example.code, acts)
        goals = [action.goal for action in [*actions.history, *actions.running()] if action.id not in known]
        assert played.ending == Finished(), (name, played.ending)
        assert played.printed.rstrip("\n") == example.prints, name
        assert not example.logs or any(line.startswith(example.logs) for line in played.log), (name, played.log)
        seen = Seen(self.robot, self.world.truth.pose_of("a").relative_to(before), goals, played)
        assert name not in EFFECTS or EFFECTS[name](seen), (name, seen.way, goals, played.said, played.colours)

    async def stand_at(self, x: float, y: float) -> None:
        self.world.stage.place("a", Pose(x, y))
        if self.robot[Legs].posture is not Posture.STANDING:
            await self.stage.play("cyberdog.motion.resume_standing()")
        await self.clock.advance(0.1)


@pytest.fixture
async def player(robot: Robot, world: World, clock: LockstepClock) -> AsyncIterator[Player]:
    async with Engine() as engine:
        yield Player(engine, robot, world, clock)


def test_every_function_has_an_example_that_uses_it() -> None:
    assert set(EXAMPLES) == {row.key for row in contract("visual")}
    assert [name for name, example in EXAMPLES.items() if name not in example.code] == []
    assert set(EFFECTS) <= set(EXAMPLES)


@pytest.mark.world("empty", body="cyberdog2")
@pytest.mark.parametrize("part", [0, *(pytest.param(part, marks=pytest.mark.slow) for part in range(1, PARTS))])
async def test_examples_of_motions(player: Player, part: int, monkeypatch: pytest.MonkeyPatch) -> None:
    for motion, spec in MOTION_SPECS.items():
        if not spec.jumps:
            monkeypatch.setitem(cast(dict[Motion, MotionSpec], MOTION_SPECS), motion, replace(spec, duration=FIGURE))
    for name in MOTIONS[part::PARTS]:
        await player.stand_at(5.0, 5.0)
        await player.play(name, EXAMPLES[name])


@pytest.mark.slow
@pytest.mark.world("empty", body="cyberdog2")
@pytest.mark.parametrize("part", HALVES)
async def test_examples_of_what_needs_no_one(player: Player, part: int) -> None:
    motions = OTHERS.index("cyberdog.motion.absolute_attitude")  # some go on from where the one before ended
    some = OTHERS[:motions] if part else OTHERS[motions:]
    for name in sorted(some, key=lambda name: name != "cyberdog.touch.data"):  # before the first touch
        await player.stand_at(5.0, 5.0)
        await player.play(name, EXAMPLES[name])


@pytest.mark.slow
@pytest.mark.world("playground", body="cyberdog2")
@pytest.mark.parametrize("part", HALVES)
async def test_examples_with_people(player: Player, world: World, part: int) -> None:
    anna, ben = world.stage.person("anna"), world.stage.person("ben")
    ben.stand()
    ben.place(1.0, 7.5, 90)
    for person in (anna, ben):
        name = "Anna" if person is anna else "Ben"
        await player.robot[Members].add(name)
        await player.robot[Members].set_face(name, person.face)
        await player.robot[Members].set_voice(name, person.voice)
    for name in WITH_PEOPLE[part::2]:
        anna.stand()
        anna.place(5.5, 5.0, 180)
        await player.stand_at(2.0, 5.0)
        await player.play(name, EXAMPLES[name])


@pytest.mark.world("office", body="cyberdog2")
async def test_examples_with_a_map(player: Player) -> None:
    await player.clock.advance(3.0)
    labels = (Label("kitchen", Point(1.6, 0.3)),)
    grid = player.robot[Mapping].grid
    await player.robot[MapLibrary].put(StoredMap("home", grid, player.clock.epoch(), labels))
    for name in WITH_MAP:
        await player.play(name, EXAMPLES[name])
