"""Plays a program in a copy of the world before the real robot runs it: in lockstep, in a separate thread.

The copy is built from the world's file and a ``Scene``: poses of the robot and people, and boxes. Maps, charge, faults
and random streams are not copied. For the studio's missions, and for agents that try a plan before they act. Knows no
door and no page.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import threading
import time
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import field
from typing import TypeVar

from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.interaction.light import Light
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.sensing.touch import TouchKind
from roboglot.model.errors import RobotError
from roboglot.model.events import BumperPressed, Event, SoundPlayed, Spoke
from roboglot.model.geometry import Pose, Twist
from roboglot.model.perception import Gesture
from roboglot.model.robot import Robot
from roboglot.model.stage import Stage
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Call, Failed, Finished, Limits, Output
from roboglot.programs.engine.run import Run
from roboglot.programs.functions import ability_set
from roboglot.programs.functions.results import refusal
from roboglot.programs.functions.session import Session, TaskEnded
from roboglot.programs.functions.table import call as call_function
from roboglot.programs.library.modules import HEADER_LINES
from roboglot.programs.rehearsing import Act, Hit, Played, Refusal, Scene, Spot, Step, Tried
from roboglot.storage.database import Database
from roboglot.values import dataclass

log = logging.getLogger(__name__)

ROBOT = "a"
LOOK = 0.1  # s of robot time between two points of the path
QUEUE_MAX = 16  # rehearsals waiting for their turn
LIMITS = Limits(cpu=20, wall=120.0)
HITS_MAX = 20
REFUSED_MAX = 20
R = TypeVar("R")
Notice = Callable[[dict[str, object]], None]


class Rehearsals:
    """Plays one program after the other; ``close`` ends the thread. The first play starts it."""

    def __init__(self, *, memory_together: int = 0) -> None:
        self._memory_together = memory_together
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread: threading.Thread | None = None
        self._engine: Engine | None = None
        self._turn: asyncio.Lock | None = None
        self._waiting = 0

    async def play(
        self,
        source: str,
        scene: Scene,
        *,
        modules: Mapping[str, str] | None = None,
        speed: float = 10.0,
        notice: Notice | None = None,
    ) -> Played:
        """Play a program to its end, at ``speed`` times real speed (0: as fast as possible).

        ``notice`` gets blocks, spots and prints as they happen, on the caller's loop. Raises ValueError for an
        impossible scene, RuntimeError if too many rehearsals wait.
        """
        here = asyncio.get_running_loop()

        def notify(news: dict[str, object]) -> None:
            if notice is not None:
                here.call_soon_threadsafe(notice, news)

        async def program(fleet: Fleet, clock: LockstepClock, engine: Engine) -> Played:
            return await _Play(fleet, clock, scene, speed, notify).run(engine, source, dict(modules or {}))

        return await self._in_turn(scene, program)

    async def try_plan(self, steps: Sequence[Step], scene: Scene) -> Tried:
        """Carry out a plan's steps in turn, as fast as possible. Raises the errors of ``play``."""

        async def plan(fleet: Fleet, clock: LockstepClock, _: Engine) -> Tried:
            return await _Trial(fleet, clock, scene).run(steps)

        return await self._in_turn(scene, plan)

    async def _in_turn(self, scene: Scene, act: Callable[[Fleet, LockstepClock, Engine], Awaitable[R]]) -> R:
        """Run ``act`` in a copy of the world, in the thread, after those already waiting."""
        if self._waiting >= QUEUE_MAX:
            raise RuntimeError("too many rehearsals wait; try again soon")
        self._waiting += 1
        try:
            work = self._in_copy(scene, act)
            return await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(work, self._started()))
        finally:
            self._waiting -= 1

    async def close(self) -> None:
        """End the current play, the engine and the thread."""
        if self._loop is None or self._thread is None:
            return
        loop, self._loop = self._loop, None
        with contextlib.suppress(RuntimeError):
            await asyncio.wrap_future(asyncio.run_coroutine_threadsafe(self._end(), loop))
        loop.call_soon_threadsafe(loop.stop)
        await asyncio.to_thread(self._thread.join)
        loop.close()

    def _started(self) -> asyncio.AbstractEventLoop:
        if self._loop is None:
            loop = self._loop = asyncio.new_event_loop()
            self._thread = threading.Thread(target=loop.run_forever, name="rehearsals", daemon=True)
            self._thread.start()
        return self._loop

    async def _end(self) -> None:
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        if self._engine is not None:
            await self._engine.close()

    async def _in_copy(self, scene: Scene, act: Callable[[Fleet, LockstepClock, Engine], Awaitable[R]]) -> R:
        if self._turn is None:
            self._turn, self._engine = asyncio.Lock(), Engine(memory_together=self._memory_together)
        async with self._turn:
            assert self._engine is not None
            clock, database = LockstepClock(), Database(":memory:")
            fleet = build_fleet(
                scene.world, [RobotConfig(ROBOT, scene.body)], clock=clock, seed=scene.seed, database=database
            )
            try:
                await fleet.start(wait=True)
                set_up(fleet.world.stage, scene)
                await clock.advance(0.2)
                return await act(fleet, clock, self._engine)
            finally:
                await fleet.close()
                database.close()


@dataclass
class _Play:
    """One program on one copy."""

    fleet: Fleet
    clock: LockstepClock
    scene: Scene
    speed: float
    notify: Notice
    played: Played = field(default_factory=Played)
    _coming: list[Act] = field(default_factory=list)
    _began: float = 0.0
    _real: float = 0.0
    _over: bool = False

    def begin_block(self, id: str) -> None:
        """Record and report the beginning of a block."""
        self.played.blocks.append(id)
        self.notify({"what": "block", "id": id})

    async def breakpoint(self) -> None:
        """Return at once: a rehearsal has no breakpoints."""

    def write(self, level: str, text: str) -> None:
        """Discard a line of the task's log."""

    async def run(self, engine: Engine, source: str, modules: dict[str, str]) -> Played:
        """Play from start to end."""
        robot = self.fleet.robots[ROBOT]
        session = Session(robot, "rehearsal", self)
        plan = self.fleet.world.stage.floors[self.fleet.world.truth.floor_of(ROBOT)]
        self.played.outlines = [*plan.walls, *plan.furniture]
        self._began, self._real = self.clock.time(), time.monotonic()
        self._coming = sorted(self.scene.acts, key=lambda act: act.at)
        run = await engine.start(source, ability_set(), LIMITS, modules=modules, seed=self.scene.seed)
        try:
            with robot.events.subscribe(Spoke, SoundPlayed) as heard:
                self._note()
                async for event in run:
                    await self._take(event, run, session)
                session.cancel("the program has ended")
                await self._pass(0.3)
                self.played.said = [_words(event) for event in heard.drain()]
        finally:
            await run.kill()
        if Legs in robot:
            self.played.posture = str(robot[Legs].posture)
        return self.played

    async def _take(self, event: object, run: Run, session: Session) -> None:
        match event:
            case Output(text=text):
                self.played.printed += text
                self.notify({"what": "print", "text": text})
            case Call():
                self.played.calls.append((event.name, tuple(event.args)))
                await self._answer(event, run, session)
            case Failed() if not self._over:
                self.played.error = f"{event.type}: {event.message}"
                self.played.line = 0 if event.unit else event.line
            case Finished() | Failed():
                self._over = True

    async def _answer(self, event: Call, run: Run, session: Session) -> None:
        answering = asyncio.ensure_future(call_function(session, event.name, event.args, event.kwargs))
        try:
            await self.clock.advance(0.0)
            while not answering.done() and self.clock.time() - self._began <= self.scene.longest:
                await self._pass(LOOK)
        finally:  # also when the play is called off
            if late := not answering.done():
                answering.cancel()
                await asyncio.gather(answering, return_exceptions=True)
        if late:
            self.played.late = self._over = True
            await run.kill()
            return
        self._note_lights()
        try:
            run.calls.reply(event.id, value := answering.result())
            self._note_refusal(event, value)
        except TaskEnded:
            self._over = True
            await run.kill()
        except (RobotError, TypeError, ValueError, ArithmeticError, NotImplementedError) as error:
            run.calls.fail(event.id, type(error).__name__, str(error))

    def _note_refusal(self, call: Call, value: object) -> None:
        if call.name.endswith("state"):  # the program asks how it went
            return
        if len(self.played.refused) < REFUSED_MAX and (words := refusal(value)):
            line = call.line - HEADER_LINES if call.unit else call.line
            self.played.refused.append(Refusal(call.name, line, call.unit, words))

    async def _pass(self, seconds: float) -> None:
        """Let robot time pass, no faster than the requested speed, and record the robot's pose."""
        now = self.clock.time() - self._began
        while self._coming and now >= self._coming[0].at - 1e-9:
            act(self.fleet.world.stage, self._coming.pop(0))
        await self.clock.advance(seconds)
        self._note()
        if self.speed > 0:
            ahead = (self.clock.time() - self._began) / self.speed - (time.monotonic() - self._real)
            await asyncio.sleep(max(0.0, ahead))

    def _note(self) -> None:
        pose = self.fleet.world.truth.pose_of(ROBOT)
        spot = Spot(round(self.clock.time() - self._began, 2), pose.x, pose.y, pose.yaw)
        self.played.path.append(spot)
        self.played.seconds = spot.at
        self.notify({"what": "spot", "at": spot.at, "x": spot.x, "y": spot.y, "yaw": spot.yaw})
        self._note_lights()

    def _note_lights(self) -> None:
        robot = self.fleet.robots[ROBOT]
        if Light in robot:
            light = robot[Light]
            for zone in light.zones:
                colour = light.state(zone).colour
                self.played.colours.add((zone, colour.red, colour.green, colour.blue))


@dataclass
class _Trial:
    """One plan on one copy."""

    fleet: Fleet
    clock: LockstepClock
    scene: Scene
    tried: Tried = field(default_factory=Tried)

    async def run(self, steps: Sequence[Step]) -> Tried:
        """Carry out the steps until one fails."""
        robot = self.fleet.robots[ROBOT]
        began = self.clock.time()
        start = robot[Localization].pose
        with robot.events.subscribe(BumperPressed) as pressed:
            for step in steps:
                try:
                    action = _begin(robot, step, start)
                except RobotError as error:
                    self.tried.steps.append(("ABORTED", str(error)))
                    break
                while not action.status.ended and not self.tried.late:
                    await self.clock.advance(LOOK)
                    self._note(self.clock.time() - began, bool(pressed.drain()))
                self.tried.steps.append((action.status.name if action.status.ended else "EXECUTING", action.reason))
                if action.status is not ActionStatus.SUCCEEDED:
                    break
        return self.tried

    def _note(self, now: float, touched: bool) -> None:
        pose = self.fleet.world.truth.pose_of(ROBOT)
        self.tried.path.append(Spot(round(now, 2), pose.x, pose.y, pose.yaw))
        self.tried.seconds, self.tried.late = round(now, 2), now >= self.scene.longest
        if touched and len(self.tried.hits) < HITS_MAX:
            self.tried.hits.append(Hit(round(now, 2), pose.x, pose.y, self._what(pose)))

    def _what(self, pose: Pose) -> str:
        """Name the nearest person or box within reach; else the building."""
        reach = self.fleet.robots[ROBOT].description.radius
        near = [(pose.distance_to(at), f"person {name}", 0.4) for name, at in self.scene.people]
        near += [(pose.distance_to(at), "a box", math.hypot(*size[:2]) / 2) for at, size in self.scene.boxes]
        found = min(((far, what) for far, what, wide in near if far <= reach + wide + 0.05), default=None)
        return found[1] if found else "a wall or furniture"


def _begin(robot: Robot, step: Step, start: Pose) -> Action:
    if step.goal is None:
        return robot[Driving].drive(step.twist or Twist(), lifetime=step.seconds, source="rehearsal")
    goal = start.compose(Pose(step.goal.x, step.goal.y, 0.0))
    return robot[Navigation].navigate_to([goal.point], NavigationOptions(), source="rehearsal")


def _words(event: Event) -> str:
    match event:
        case Spoke(text=words) | SoundPlayed(name=words):
            return words
    return ""


def set_up(stage: Stage, scene: Scene) -> None:
    """Arrange the world as in the scene. Raises ValueError, NotFound."""
    if scene.start is not None:
        stage.place(ROBOT, scene.start)
    for pose, size in scene.boxes:
        stage.add_obstacle(pose, size)
    for name, pose in scene.people:
        person = stage.person(name)
        person.stand()
        person.place(pose.x, pose.y, math.degrees(pose.yaw))


def act(stage: Stage, given: Act) -> None:
    """Carry out an event in the world. Raises ValueError for an unknown or impossible one."""
    match given.kind, given.who:
        case "touch", _:
            stage.touch(ROBOT, TouchKind[given.text.upper() or "SINGLE"])
        case "say", who:
            stage.person(who).say(given.text)
        case "gesture", who:
            stage.person(who).gesture(Gesture[given.text.upper()], seconds=2.0)
        case "walk", who:
            stage.person(who).walk_to(*given.to)
        case "box", _:
            stage.add_obstacle(Pose(*given.to), (0.4, 0.4, 1.0))
        case kind, _:
            raise ValueError(f"{kind!r} is not a kind of step")


def scene_of(stage: Stage, robot: str, world: str, body: str, others: Sequence[str] = ()) -> Scene:
    """Return the current scene: true pose of the robot, boxes, people, and other robots as boxes."""
    placed = {item.name: item for item in stage.robots}
    here = placed[robot]
    boxes = [(box.pose, box.size) for box in stage.obstacles if box.floor == here.floor]
    boxes += [(placed[name].pose, (0.35, 0.35, 0.4)) for name in others if placed[name].floor == here.floor]
    people = tuple((person.name, person.pose) for person in stage.people if person.floor == here.floor)
    return Scene(world=world, body=body, start=here.pose, boxes=tuple(boxes), people=people, longest=600.0)
