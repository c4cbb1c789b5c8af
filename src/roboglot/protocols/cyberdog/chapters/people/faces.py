"""Chapter "faces": entering members' faces (7001, push 7003), recognising them (7002, push 7004)."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine
from enum import IntEnum
from typing import Annotated, Any

import msgspec

from roboglot.model.components.interaction.members import Members
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import InvalidGoal, NotFound, RobotError
from roboglot.model.perception import Emotion, FaceSeen
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.table import TABLE, Call, push
from roboglot.wire.cyberdog.codes import Code
from roboglot.wire.cyberdog.text import Int32

log = logging.getLogger(__name__)
ENTERED = push(Code.FACE_ENTERED)
RECOGNISED = push(Code.FACE_RECOGNISED)
ENTERING_MAX = 30.0  # s until a face must have been seen
AGAIN = 1.0  # s between two reports of the same person
SECONDS_MAX = 300
EMOTIONS = tuple(Emotion)
Seconds = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]


class FaceResult(IntEnum):
    """``result`` of this chapter's answers and pushes."""

    DONE = 0
    UNDEFINED = 5901
    STATE = 5903
    INNER = 5904
    TIMEOUT = 5907
    ARGUMENTS = 5910
    BUSY = 5911
    KNOWN = 5921


class Faces:
    """Enters one face or recognises, not both at once. Lives as long as the door is open."""

    def __init__(self, robot: Robot, app: AppLink) -> None:
        self.entering = ""  # the member whose face is awaited
        self.entered = ""  # the member whose face came last
        self._robot, self._app = robot, app
        self._looking: asyncio.Task[None] | None = None

    @property
    def busy(self) -> bool:
        """Whether it enters or recognises."""
        return self._looking is not None and not self._looking.done()

    def enter(self, name: str) -> None:
        """Take the next face for that member's; push 7003 tells the outcome."""
        self.entering = name
        self._begin(self._enter(name))

    def recognise(self, name: str, id: int, seconds: float) -> None:
        """Push 7004 for each member (only ``name``, if given) seen within ``seconds``; 5907 if none was."""
        self._begin(self._recognise(name, id, seconds))

    def stop(self) -> None:
        """Look no more, tell nothing."""
        if self._looking:
            self._looking.cancel()
        self._looking, self.entering = None, ""

    def _begin(self, work: Coroutine[Any, Any, None]) -> None:
        self._looking = asyncio.get_running_loop().create_task(work, name="faces")

    async def _enter(self, name: str) -> None:
        members = self._robot[Members]
        try:
            face = await self._robot.clock.wait_for(self._next_face(), ENTERING_MAX)
            if face.name not in ("", name):
                result = FaceResult.KNOWN
            else:
                await members.set_face(name, face.print)
                self.entered, result = name, FaceResult.DONE
        except TimeoutError:
            result = FaceResult.TIMEOUT
        except RobotError as error:
            log.info("face of %r: %s", name, error)
            result = FaceResult.INNER
        self.entering = ""
        self._app.push(ENTERED, {"result": int(result), "username": name})

    async def _next_face(self) -> FaceSeen:
        with self._robot[Vision].faces.subscribe() as sightings:
            async for sighting in sightings:
                if sighting.seen:
                    return sighting.seen[0]
        raise RobotError("the camera is gone")

    async def _recognise(self, name: str, id: int, seconds: float) -> None:
        reported: dict[str, float] = {}
        try:
            await self._robot.clock.wait_for(self._tell(name, id, reported), seconds)
        except TimeoutError:
            if not reported:
                self._app.push(RECOGNISED, _recognised(FaceResult.TIMEOUT, name, id, 0.0, 0.0))
        except RobotError as error:
            log.info("face recognition: %s", error)

    async def _tell(self, wanted: str, id: int, reported: dict[str, float]) -> None:
        with self._robot[Vision].faces.subscribe() as sightings:
            async for sighting in sightings:
                for face in sighting.seen:
                    again = sighting.stamp - reported.get(face.name, -AGAIN) < AGAIN
                    if not face.name or again or wanted not in ("", face.name):
                        continue
                    reported[face.name] = sighting.stamp
                    emotion = float(EMOTIONS.index(face.emotion))
                    self._app.push(RECOGNISED, _recognised(FaceResult.DONE, face.name, id, face.age, emotion))


def _recognised(result: FaceResult, name: str, id: int, age: float, emotion: float) -> dict[str, Any]:
    return {"username": name, "result": int(result), "id": id, "age": age, "emotion": emotion}


@TABLE.on(Code.ENTER_FACE, right=Right.EDIT, needs=(Members, Vision))
async def enter_face(
    call: Call, *, command: Int32, username: str = "", oriname: str = "", ishost: bool = False
) -> dict[str, Any]:
    """0 enter, 1 cancel that, 2 confirm (the robot did already), 3 rename, 4 delete a face, 5 who has one."""
    robot, faces = call.context.robot, call.context.faces
    robot[Vision], robot[Members]
    try:
        match command:
            case 0:
                return {"result": int(await _begin_entry(call, username, ishost))}
            case 1:
                result = FaceResult.DONE if faces.entering else FaceResult.STATE
                if faces.entering:
                    faces.stop()
            case 2:
                result = FaceResult.DONE if faces.entered and faces.entered == username else FaceResult.STATE
            case 3:
                _check_face(robot[Members], oriname)
                await robot[Members].rename(oriname, username)
                result = FaceResult.DONE
            case 4:
                _check_face(robot[Members], username)
                await robot[Members].set_face(username, None)
                result = FaceResult.DONE
            case 5:
                names = [member.name for member in robot[Members].all() if member.face]
                return {"result": int(FaceResult.DONE), "allfaces": ",".join(names)}
            case _:
                result = FaceResult.ARGUMENTS
    except (NotFound, InvalidGoal) as error:
        return call.refused({"result": int(FaceResult.ARGUMENTS)}, str(error))
    return {"result": int(result)}


def _check_face(members: Members, name: str) -> None:
    """Raise NotFound unless that member's face is known."""
    if members.get(name).face is None:
        raise NotFound(f"no face of {name!r} is known")


async def _begin_entry(call: Call, name: str, host: bool) -> FaceResult:
    faces, members = call.context.faces, call.context.robot[Members]
    if faces.busy:
        return FaceResult.BUSY
    if name not in {member.name for member in members.all()}:
        await members.add(name, host=host)
    faces.enter(name)
    return FaceResult.DONE


@TABLE.on(Code.RECOGNISE_FACES, right=Right.DRIVE, needs=(Vision,))
async def recognise_faces(
    call: Call, *, command: Int32, username: str = "", id: Int32 = 0, timeout: Seconds = 60
) -> dict[str, int]:
    """0 everybody known, 1 ``username`` alone, 2 stop; for ``timeout`` s (1 to 300). Push 7004 tells who is seen."""
    faces = call.context.faces
    call.context.robot[Vision]
    if command == 2:
        if not faces.entering:
            faces.stop()
        return {"result": int(FaceResult.DONE)}
    if command not in (0, 1) or faces.busy or (command == 1 and not username):
        return {"result": int(FaceResult.UNDEFINED)}
    faces.recognise(username if command == 1 else "", id, max(1, min(SECONDS_MAX, timeout)))
    return {"result": int(FaceResult.DONE)}
