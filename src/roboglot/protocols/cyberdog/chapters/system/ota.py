"""Chapter "ota": download (5003), install (5004), progress (5001, 5005, 5006), goals (5010, 5011)."""

from __future__ import annotations

from typing import Annotated

import msgspec

from roboglot.model.components.system.firmware import Firmware, FirmwareState
from roboglot.model.errors import InvalidGoal
from roboglot.operations import Right
from roboglot.protocols.cyberdog.call import Call, follow
from roboglot.protocols.cyberdog.chapters.system.update_jobs import OPERATIONS, Goal
from roboglot.protocols.cyberdog.chapters.system.updates import (
    ARGUMENTS,
    BUSY,
    FAILED,
    GOOD,
    STATE,
    UNDER_WAY,
    WORDS,
    package_of,
)
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.wire.cyberdog.codes import Accepted, Code

STREAM_MAX = 10_800.0  # s for which one stream stays open for its result
ID_MAX = 128  # characters of a goal's id
Id = Annotated[int, msgspec.Meta(ge=-(2**63), le=2**63 - 1)] | Annotated[str, msgspec.Meta(max_length=ID_MAX)]
NO_TIME = -2  # s
OBSTACLES = {
    BUSY: "an update is under way",
    STATE: "no update is downloaded",
    ARGUMENTS: "no file of the download has this md5",
}


@TABLE.on(Code.UPDATE_STATUS, right=Right.SEE, needs=(Firmware,))
async def update_status(call: Call) -> dict[str, object]:
    """Return the state: idle, download or update."""
    state = call.context.robot[Firmware].progress.state
    return {"status": WORDS.get(state, "idle"), "code": FAILED if state is FirmwareState.FAILED else GOOD}


@TABLE.on(Code.UPDATE_VERSION, right=Right.SEE, needs=(Firmware,))
async def update_version(call: Call) -> dict[str, object]:
    """Return the running firmware version (not in the manual)."""
    return {"version": call.context.robot[Firmware].version, "code": GOOD}


@TABLE.on(Code.DOWNLOAD_UPDATE, right=Right.ADMIN, needs=(Firmware,))
async def download_update(call: Call, *, modules: object) -> dict[str, object]:
    """Download the files of modules; push 5005 reports the progress."""
    firmware = call.context.robot[Firmware]
    try:
        package, digests = package_of(modules)
        if firmware.progress.state in UNDER_WAY:
            return call.refused({"response": False, "code": BUSY}, OBSTACLES[BUSY])
        call.context.updates.download(package, digests)
    except InvalidGoal as error:
        return call.refused({"response": False, "code": ARGUMENTS}, str(error))
    return {"response": True, "code": GOOD}


@TABLE.on(Code.INSTALL_UPDATE, right=Right.ADMIN, needs=(Firmware,))
async def install_update(call: Call, *, md5: str) -> dict[str, object]:
    """Install the download and restart; the manual spells the key "reponse", clients read either."""
    call.context.robot.require(Firmware)
    code = call.context.updates.obstacle(md5)
    if code == GOOD:
        call.context.updates.install()
    else:
        call.why = OBSTACLES[code]
    return {"reponse": code == GOOD, "response": code == GOOD, "code": code}


@TABLE.on(Code.UPDATE_PROGRESS, right=Right.SEE, needs=(Firmware,))
async def update_progress(call: Call) -> dict[str, int]:
    """Return the progress of download and installation, percent; -1 failed, -2 too little space."""
    call.context.robot.require(Firmware)
    return call.context.updates.progress()


@TABLE.on(Code.UPDATE_TIME, right=Right.SEE, needs=(Firmware,))
async def update_time(call: Call) -> dict[str, int]:
    """Return the remaining seconds of the update under way; -2 without one."""
    remaining = call.context.robot[Firmware].remaining
    return {"time": NO_TIME if remaining is None else round(remaining)}


@TABLE.on(Code.START_UPDATE, right=Right.ADMIN, needs=(Firmware,))
async def start_update(call: Call, *, operate: str = "", id: Id = "", data: object = None) -> object:
    """Answers ``accepted``, feedback, result; the work continues if the stream breaks."""
    call.context.robot.require(Firmware)
    if operate not in OPERATIONS:
        return call.refused({"accepted": int(Accepted.NO)}, f"operate is one of {', '.join(OPERATIONS)}")
    if call.context.jobs.stream is not None:
        return call.refused({"accepted": int(Accepted.NO)}, "another goal is under way")
    return await follow(call, call.context.jobs.start(Goal(operate, id, data)), STREAM_MAX)


@TABLE.on(Code.JOIN_UPDATE, right=Right.SEE, needs=(Firmware,))
async def join_update(call: Call) -> object:
    """Take over the stream of the goal under way, from its latest feedback on."""
    call.context.robot.require(Firmware)
    stream = call.context.jobs.stream
    if stream is None:
        return call.refused({"accepted": int(Accepted.NOTHING_TO_JOIN)}, "no goal is under way")
    return await follow(call, stream, STREAM_MAX)
