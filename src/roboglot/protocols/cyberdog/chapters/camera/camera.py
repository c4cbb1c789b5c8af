"""Chapter "photo and video": 4002 and 4004 by ``getFile`` and ``sendMsg``; pushes 4003 and 4005."""

from __future__ import annotations

import logging
from collections.abc import AsyncGenerator, Mapping
from pathlib import Path

from google.protobuf.message import DecodeError

from roboglot.hosting.error_text import in_words
from roboglot.media.recorder import Recorder
from roboglot.model.admission import Forbidden
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.errors import NotFound, RobotError
from roboglot.model.responder import Responder
from roboglot.operations import Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters.camera.camera_files import CameraFiles
from roboglot.protocols.cyberdog.chapters.camera.transfers import error_of
from roboglot.protocols.cyberdog.context import Context
from roboglot.protocols.cyberdog.errors import RecordedEnd
from roboglot.protocols.cyberdog.table import TABLE, files
from roboglot.wire.cyberdog.codes import Code, FileError
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.text import Int32

log = logging.getLogger(__name__)
files.add(Code.SAVED_FILE)


def get_file(
    context: Context, host: str, code: int, fields: Mapping[str, object], params: str = ""
) -> AsyncGenerator[pb.FileChunk, None]:
    """Yield the chunks that answer a ``getFile`` of ``host``; ``params``: the text that ``fields`` were read from."""
    if (responder := context.robot.responder) is not None:
        return _played(context, responder, code, params)
    if Camera not in context.robot or Recorder not in context.robot:
        return _refused(FileError.CAMERA_SILENT if code in (Code.CAMERA, Code.SAVED_FILE) else FileError.WRONG_CODE)
    if not _may_fetch(context, code):
        return _refused(FileError.CAMERA_SILENT)
    camera_files = context.files
    command = fields.get("command")
    match code, None if isinstance(command, bool) else command:
        case Code.SAVED_FILE, _:
            return context.transfers.send(host, lambda: _saved(camera_files, str(fields.get("file_name", ""))))
        case Code.CAMERA, 1:
            return context.transfers.send(host, camera_files.photograph)
        case Code.CAMERA, 3:
            return context.transfers.send(host, camera_files.stop)
        case Code.CAMERA, _:
            return _refused(FileError.ARGUMENTS)
    return _refused(FileError.WRONG_CODE)


def _may_fetch(context: Context, code: int) -> bool:
    if (admission := context.robot.admission).enforced:
        try:
            admission.check("cyberdog", str(int(code)), Right.SEE if code == Code.SAVED_FILE else Right.DRIVE)
        except Forbidden:
            return False
    return True


async def _played(context: Context, responder: Responder, code: int, params: str) -> AsyncGenerator[pb.FileChunk, None]:
    """Yield the chunks of a file that was fetched in the recording."""
    if not _may_fetch(context, code):
        yield pb.FileChunk(error_code=FileError.CAMERA_SILENT)
        return
    try:
        async for reply in responder.answer("cyberdog", str(int(code)), params.encode(), reads=code == Code.SAVED_FILE):
            RecordedEnd.check(reply.status)
            yield pb.FileChunk.FromString(reply.payload)
    except (NotFound, DecodeError) as error:
        log.info("cannot send a file: %s", error)
        yield pb.FileChunk(error_code=FileError.NOT_THERE)


async def _saved(files: CameraFiles, name: str) -> Path:
    return files.path(name)


async def _refused(error: FileError) -> AsyncGenerator[pb.FileChunk, None]:
    yield pb.FileChunk(error_code=error)


@TABLE.on(Code.CAMERA, right=Right.DRIVE, needs=(Camera, Recorder))
async def camera(call: Call, *, command: Int32) -> dict[str, int]:
    """Take a photo (1), begin (2) or end (3) a recording; files stay on the robot until they are fetched."""
    robot, kept = call.context.robot, call.context.files
    robot.require(Camera, Recorder)
    try:
        match command:
            case 1:
                await kept.photograph()
            case 2:
                kept.record()
            case 3:
                await kept.stop()
            case _:
                return call.refused({"result": int(FileError.ARGUMENTS)}, f"there is no command {command}")
    except (RobotError, OSError) as error:
        return call.refused({"result": int(error_of(error))}, in_words(error))
    return {"result": int(FileError.NONE)}
