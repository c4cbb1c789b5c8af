"""Chapter "faces": enrolling members' faces (7001, push 7003), recognising them (7002, push 7004)."""

from __future__ import annotations

import logging
from typing import Annotated

import msgspec

from roboglot.model.components.interaction.members import Members
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.operations import Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters.people.face_recognition import FaceResult
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.wire.cyberdog.codes import Code
from roboglot.wire.cyberdog.text import Int32

log = logging.getLogger(__name__)
SECONDS_MAX = 300
BUSY = "a face is being entered, or faces are recognised"
Seconds = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]


@TABLE.on(Code.ENTER_FACE, right=Right.EDIT, needs=(Members, Vision))
async def enter_face(
    call: Call, *, command: Int32, username: str = "", oriname: str = "", ishost: bool = False
) -> dict[str, object]:
    """Enrol (0), cancel (1), confirm (2: no effect), rename (3) or delete (4) a face, or list members with one (5)."""
    robot = call.context.robot
    robot.require(Vision, Members)
    try:
        match command:
            case 0 | 1 | 2:
                return await _enter(call, command, username, ishost)
            case 3:
                _check_face(robot[Members], oriname)
                await robot[Members].rename(oriname, username)
            case 4:
                _check_face(robot[Members], username)
                await robot[Members].set_face(username, None)
            case 5:
                names = [member.name for member in robot[Members].all() if member.face]
                return {"result": int(FaceResult.DONE), "allfaces": ",".join(names)}
            case _:
                return _refused(call, FaceResult.ARGUMENTS, f"there is no command {command}")
    except (NotFound, InvalidGoal) as error:
        return _refused(call, FaceResult.ARGUMENTS, str(error))
    return {"result": int(FaceResult.DONE)}


async def _enter(call: Call, command: int, name: str, host: bool) -> dict[str, object]:
    """Begin (0), cancel (1) or confirm (2) the entry of a face."""
    faces = call.context.faces
    if command == 0:
        if faces.busy:
            return _refused(call, FaceResult.BUSY, BUSY)
        await faces.enter(name, host=host)
    elif command == 1:
        if not faces.entering:
            return _refused(call, FaceResult.STATE, "no face is being entered")
        faces.stop()
    elif not faces.entered or faces.entered != name:
        return _refused(call, FaceResult.STATE, f"{name!r} is not the face that was entered last")
    return {"result": int(FaceResult.DONE)}


def _refused(call: Call, result: FaceResult, why: str) -> dict[str, object]:
    return call.refused({"result": int(result)}, why)


def _check_face(members: Members, name: str) -> None:
    """Raise NotFound unless the member has a face."""
    if members.get(name).face is None:
        raise NotFound(f"no face of {name!r} is known")


@TABLE.on(Code.RECOGNISE_FACES, right=Right.DRIVE, needs=(Members, Vision))
async def recognise_faces(
    call: Call, *, command: Int32, username: str = "", id: Int32 = 0, timeout: Seconds = 60
) -> dict[str, object]:
    """Recognise all faces (0) or ``username`` (1) for ``timeout`` s (1 to 300), or stop (2). Reports: push 7004."""
    faces = call.context.faces
    call.context.robot.require(Vision, Members)
    if command == 2:
        if not faces.entering:
            faces.stop()
        return {"result": int(FaceResult.DONE)}
    if command not in (0, 1) or (command == 1 and not username):
        return _refused(call, FaceResult.UNDEFINED, f"command {command} is not 0, 1 (with a username) or 2")
    if faces.busy:
        return _refused(call, FaceResult.UNDEFINED, BUSY)
    seconds = max(1, min(SECONDS_MAX, timeout))
    if seconds != timeout:
        log.info("7002: a timeout of %d s is taken for %d s: it lasts from 1 to %d s", timeout, seconds, SECONDS_MAX)
    faces.recognise(username if command == 1 else "", id, seconds)
    return {"result": int(FaceResult.DONE)}
