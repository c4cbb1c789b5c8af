"""A program tried in a copy of the world before the robot runs it, or in a mission's world to be graded.

One page tries one program at a time. Events are sent as they happen, at ten times real speed.
"""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Callable
from typing import Annotated

import msgspec

from roboglot.console.drawings import whereabouts
from roboglot.console.studio.checks import HULL, distance
from roboglot.console.studio.lessons import Lesson, grade, no_program
from roboglot.console.studio.mistakes import explain
from roboglot.console.studio.programs import Programs, Studio
from roboglot.model.errors import Busy, NotFound
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.programs.errors import ProgramError
from roboglot.programs.language import Problem
from roboglot.programs.rehearsing import Played, Scene
from roboglot.wire.visual.requests import BODY_MAX

SPEED = 10.0
NAME_MAX = 100
Tell = Callable[[dict[str, object]], None]


class TrialRequest(msgspec.Struct, tag="try", tag_field="type", forbid_unknown_fields=True):
    """Request to try ``body`` in the world of ``lesson``; empty: in a copy of the robot's own world."""

    id: int
    body: Annotated[str, msgspec.Meta(max_length=BODY_MAX)]
    lesson: Annotated[str, msgspec.Meta(max_length=NAME_MAX)] = ""


class TrialEnd(msgspec.Struct, tag="end_try", tag_field="type", forbid_unknown_fields=True):
    """Request to end the trial."""


class Trial:
    """Trial of one page."""

    def __init__(self, tell: Tell) -> None:
        self._send = tell
        self._busy = self._ended = False  # from the request on, including its check
        self._playing: asyncio.Task[Played] | None = None
        self._origin = Pose()  # of the world, in the frame that the page's map has

    async def take(self, request: TrialRequest, studio: Studio, programs: Programs) -> None:
        """Try a program and report the result. Raises NotFound, Busy, ValueError, ProgramError."""
        if self._busy:
            raise Busy("a program is being tried already")
        self._busy, self._ended = True, False
        try:
            await self._try(request, studio, programs)
        finally:
            self._busy = False

    async def _try(self, request: TrialRequest, studio: Studio, programs: Programs) -> None:
        lesson = studio.lessons().get(request.lesson) if request.lesson else None
        if request.lesson and lesson is None:
            raise NotFound(f"there is no mission {request.lesson!r}")
        if problems := await programs.service.check(request.body):
            self._answer(request, lesson, problems=problems)
            return
        scene = _scene(studio, programs, lesson)
        self._origin = map_origin(programs.robot, scene) if lesson is None else Pose()
        played = await self._play(request, scene, studio, programs)
        self._answer(request, lesson, played)

    async def _play(self, request: TrialRequest, scene: Scene, studio: Studio, programs: Programs) -> Played:
        if studio.rehearse is None:
            raise NotFound("there is no simulation here to try it in")
        modules = await _modules(programs, request.body)
        if self._ended:
            raise Busy("it was cancelled")
        play = studio.rehearse.play(request.body, scene, modules=modules, speed=SPEED, notice=self._notice)
        self._playing = asyncio.ensure_future(play)
        try:
            return await self._playing
        except RuntimeError as error:
            raise Busy(str(error)) from None
        except asyncio.CancelledError:
            raise Busy("it was cancelled") from None
        finally:
            self._playing = None

    def _notice(self, news: dict[str, object]) -> None:
        match news:
            case {"x": float(x), "y": float(y), "yaw": float(yaw)}:
                spot = self._origin.compose(Pose(x, y, yaw))
                news = news | {"x": spot.x, "y": spot.y, "yaw": spot.yaw}
        self._send({"type": "trial", **news})

    def _answer(
        self,
        request: TrialRequest,
        lesson: Lesson | None,
        played: Played | None = None,
        problems: list[Problem] | None = None,
    ) -> None:
        answer: dict[str, object] = {"type": "tried", "id": request.id, "lesson": request.lesson}
        if played is not None:
            answer |= {"printed": played.printed, "error": played.error, "line": played.line, "seconds": played.seconds}
            answer |= {"why": explain(played.error)} if played.error else {}
            answer |= {"late": played.late, "touched": _touched(played)}
            answer |= {"refused": [dataclasses.asdict(one) for one in played.refused]}
        if lesson is not None:
            found = no_program(problems or []) if played is None else grade(lesson, request.body, played)
            answer |= {"grade": msgspec.to_builtins(found)}
        elif problems:
            first = problems[0]
            answer |= {"error": first.english, "line": first.line, "why": {"en": first.english, "zh": first.chinese}}
        self._send(answer)

    def close(self) -> None:
        """End the trial."""
        self._ended = True
        if self._playing is not None:
            self._playing.cancel()


def _scene(studio: Studio, programs: Programs, lesson: Lesson | None) -> Scene:
    if lesson is not None:
        return lesson.scene
    if studio.scene_of is None:
        raise NotFound("there is no simulation here to try it in")
    return studio.scene_of(programs.robot.id)


def map_origin(robot: Robot, scene: Scene) -> Pose:
    """Return the world's origin in the map that the page draws, by the robot's pose estimate."""
    believed = whereabouts(robot)
    if scene.start is None or believed is None:
        return Pose()
    return believed.compose(scene.start.inverse())


async def _modules(programs: Programs, body: str) -> dict[str, str]:
    """Return the sources of the modules that a program may call, found by their functions' names."""
    library = programs.service.library
    try:
        return await library.sources(library.ids(name for name in library.functions if f"{name}(" in body))
    except ProgramError as error:
        raise ValueError(str(error)) from None


def _touched(played: Played) -> float | None:
    """Return the first time (s) at which the dog touched a wall or furniture; None: never."""
    return next((spot.at for spot in played.path if distance(spot, played.outlines) < HULL), None)
