"""Chapter "photo and video": 4002 and 4004, by requests and as files in chunks.

What a robot sends is held in memory only up to a bound; ``into`` an open file it may have as much as the protocol can
express.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import aclosing
from typing import BinaryIO

import msgspec

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused, check
from roboglot.clients.errors import BadAnswer, TimedOut
from roboglot.values import dataclass
from roboglot.wire.cyberdog.codes import Code, FileError
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

PHOTO, RECORD, STOP = 1, 2, 3
PHOTO_MAX = 64 << 20  # bytes
MEMORY_MAX = 256 << 20  # bytes of a file that is not received ``into`` another
CHUNK_WAIT = 30.0  # s to wait for the next chunk
Progress = Callable[[float], object]


@dataclass(frozen=True, slots=True)
class CameraFile:
    """A complete photo (.jpg) or recording (.mp4); ``data`` is empty if it was received ``into`` a file."""

    name: str
    data: bytes
    size: int


class Camera(Calls):
    """Photos and recordings. ``on_progress`` is called with the received part of the file (0..1)."""

    async def photo(self, on_progress: Progress | None = None, *, into: BinaryIO | None = None) -> CameraFile:
        """4002 by getFile: take a photo and return it."""
        return await self._file(Code.CAMERA, {"command": PHOTO}, on_progress, into, PHOTO_MAX)

    async def record(self) -> None:
        """4002: begin a recording."""
        await self._camera(RECORD)

    async def stop_recording(self, on_progress: Progress | None = None, *, into: BinaryIO | None = None) -> CameraFile:
        """4002 by getFile: end the recording and return it."""
        return await self._file(Code.CAMERA, {"command": STOP}, on_progress, into)

    async def keep_photo(self) -> None:
        """4002 by sendMsg: take a photo that stays on the robot (FilesLeft) until ``saved_file`` fetches it."""
        await self._camera(PHOTO)

    async def keep_recording(self) -> None:
        """4002 by sendMsg: end the recording; it stays on the robot."""
        await self._camera(STOP)

    async def saved_file(
        self, name: str, on_progress: Progress | None = None, *, into: BinaryIO | None = None
    ) -> CameraFile:
        """4004: fetch a file left on the robot, which deletes it after a complete transfer."""
        return await self._file(Code.SAVED_FILE, {"file_name": name}, on_progress, into)

    async def _camera(self, command: int) -> None:
        check(Code.CAMERA, await self.ask(Code.CAMERA, dict, {"command": command}), FileError)

    async def _file(
        self,
        code: Code,
        params: dict[str, object],
        on_progress: Progress | None,
        into: BinaryIO | None,
        most: int = MEMORY_MAX,
    ) -> CameraFile:
        """Receive a file of at most ``most`` bytes, or of any size ``into`` another. Raises BadAnswer."""
        data, received, name, size = bytearray(), 0, "", 0
        async with aclosing(self.link.fetch(code, msgspec.json.encode(params).decode())) as chunks:
            while (chunk := await self._next(chunks, code)) is not None:
                if chunk.error_code:
                    known = chunk.error_code in tuple(FileError)
                    words = FileError(chunk.error_code).name.lower().replace("_", " ") if known else "unknown"
                    raise CyberDogRefused(code.name, chunk.error_code, words)
                name, size = chunk.file_name, chunk.file_size
                received += len(chunk.buffer)
                if received > size:
                    raise BadAnswer(f"{name} has more than its {size} bytes")
                if into is not None:
                    into.write(chunk.buffer)
                elif size <= most:
                    data += chunk.buffer
                else:
                    raise BadAnswer(f"{name} has {size} bytes: more than {most} are received into a file only")
                if on_progress:
                    on_progress(received / size if size else 1.0)
        if not name or received != size:
            raise BadAnswer(f"{name or 'the file'} has {received} of {size} bytes")
        return CameraFile(name, bytes(data), size)

    async def _next(self, chunks: AsyncIterator[pb.FileChunk], code: Code) -> pb.FileChunk | None:
        try:
            return await self.clock.wait_for(anext(chunks, None), CHUNK_WAIT)
        except TimeoutError:
            raise TimedOut(f"{code.name}: nothing arrived for {CHUNK_WAIT:g} s") from None
