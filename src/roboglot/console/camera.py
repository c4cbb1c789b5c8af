"""Media and detections of a robot for pages: photos, motion JPEG, WAV, video with sound by WebRTC."""

from __future__ import annotations

import asyncio
import importlib
import struct
from collections.abc import Awaitable, Callable, Iterator
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from roboglot.console.http import Problem, Receive, Send, answer, session_lasts
from roboglot.console.settings import CALL_SECONDS, CALLS_MAX, JPEG_QUALITY, OFFER_MAX, REVOKED_SECONDS
from roboglot.media.audio import AudioStream
from roboglot.media.stills import jpeg
from roboglot.media.video import VideoStream, beside
from roboglot.model import background
from roboglot.model.admission import Right
from roboglot.model.components.sensing.camera import Camera, Frame
from roboglot.model.components.sensing.detector import Detector
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.errors import Busy
from roboglot.model.feed import Viewer
from roboglot.model.perception import Box
from roboglot.model.robot import Robot
from roboglot.model.sound import SAMPLE_RATE, SoundBlock

if TYPE_CHECKING:
    from roboglot.media.webrtc import VideoCall

T = TypeVar("T")
BOUNDARY = b"roboglot-frame"
SIZE_UNKNOWN = 0xFFFFFFFF  # length of an endless WAV file
ENDLESS_WAV = struct.pack(  # one channel of 16 bits
    "<4sI4s4sIHHIIHH4sI",
    *(b"RIFF", SIZE_UNKNOWN, b"WAVE", b"fmt ", 16, 1, 1, SAMPLE_RATE, 2 * SAMPLE_RATE, 2, 16, b"data", SIZE_UNKNOWN),
)
ENDED = ("failed", "closed", "blind")  # states of a finished call


async def send_photo(robot: Robot, send: Send) -> None:
    """Answer with a new photo."""
    frame = await robot[Camera].capture()
    picture = await background.beside(partial(jpeg, frame, JPEG_QUALITY))
    await answer(send, 200, b"image/jpeg", picture, [(b"cache-control", b"no-store")])


async def send_film(robot: Robot, receive: Receive, send: Send) -> None:
    """Send motion JPEG until the client disconnects; a slow reader misses pictures."""
    viewer = robot[Camera].subscribe()

    async def encoded(first: Frame) -> bytes:
        frame = (viewer.drain() or [first])[-1]
        picture = await background.beside(partial(jpeg, frame, JPEG_QUALITY))
        return b"--%s\r\ncontent-type: image/jpeg\r\ncontent-length: %d\r\n\r\n%s\r\n" % (
            *(BOUNDARY, len(picture), picture),
        )

    await _stream(robot, viewer, encoded, b"multipart/x-mixed-replace; boundary=" + BOUNDARY, receive, send)


async def send_sound(robot: Robot, receive: Receive, send: Send) -> None:
    """Send the microphone's sound as an endless WAV file, until the client disconnects."""

    async def encoded(block: SoundBlock) -> bytes:
        return block.samples.tobytes()

    await _stream(robot, robot[Microphone].subscribe(), encoded, b"audio/wav", receive, send, ENDLESS_WAV)


async def _stream(
    robot: Robot,
    viewer: Viewer[T],
    encoded: Callable[[T], Awaitable[bytes]],
    kind: bytes,
    receive: Receive,
    send: Send,
    head: bytes = b"",
) -> None:
    """Send ``head`` and what the viewer gets, while the client is there and may see it."""
    gone = asyncio.ensure_future(_left(receive))
    headers = [(b"content-type", kind), (b"cache-control", b"no-store")]
    with viewer:
        gone.add_done_callback(lambda _: viewer.close())
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        await send({"type": "http.response.body", "body": head, "more_body": True})
        try:
            async for item in viewer:
                if not _may_watch(robot):
                    break
                await send({"type": "http.response.body", "body": await encoded(item), "more_body": True})
            await send({"type": "http.response.body", "body": b""})
        finally:
            gone.cancel()


def _may_watch(robot: Robot) -> bool:
    """Return whether the client still has the right to see the robot, and has not signed out."""
    return session_lasts.get()() and robot.admission.may(Right.SEE)


async def _left(receive: Receive) -> None:
    """Return when the client has hung up."""
    while (await receive())["type"] != "http.disconnect":
        pass


class Calls:
    """The WebRTC calls of all pages, at most ``CALLS_MAX``."""

    def __init__(self) -> None:
        self._calls: set[VideoCall] = set()
        self._closing: set[asyncio.Task[None]] = set()

    async def answer(self, robot: Robot, offer: str) -> str:
        """Return the SDP answer to a page's ``offer`` of video and sound. Raises Problem, Busy, ComponentMissing."""
        stream = robot[VideoStream]
        if len(self._calls) >= CALLS_MAX:
            raise Busy(f"{CALLS_MAX} pages show live video already")
        if len(offer) > OFFER_MAX:
            raise Problem(413, f"an offer has at most {OFFER_MAX} characters")
        webrtc: Any = await beside(robot.clock, lambda: importlib.import_module("roboglot.media.webrtc"))
        sound = robot[AudioStream] if AudioStream in robot else None  # noqa: SIM401 - a robot has no get
        call: VideoCall = webrtc.VideoCall(stream, robot.clock, lambda state: self._changed(call, late, state), sound)
        late: asyncio.TimerHandle = asyncio.get_running_loop().call_later(CALL_SECONDS, self._end, call)
        self._calls.add(call)
        self._look_after(robot, call)
        try:
            return await call.answer(offer)
        except webrtc.BadOffer as bad:
            late.cancel()
            self._end(call)
            raise Problem(400, f"the offer cannot be answered: {bad}") from None

    def _look_after(self, robot: Robot, call: VideoCall) -> None:
        """Hang up when the caller may no longer see the robot; runs in the caller's context."""
        if call not in self._calls:
            return
        if _may_watch(robot):
            asyncio.get_running_loop().call_later(REVOKED_SECONDS, self._look_after, robot, call)
        else:
            self._end(call)

    def _changed(self, call: VideoCall, late: asyncio.TimerHandle, state: str) -> None:
        if state == "connected":
            late.cancel()
        elif state in ENDED:
            late.cancel()
            self._end(call)

    def _end(self, call: VideoCall) -> None:
        if call in self._calls:
            self._calls.discard(call)
            closing = asyncio.get_running_loop().create_task(call.close(), name="console video call")
            self._closing.add(closing)
            closing.add_done_callback(self._closing.discard)

    async def close(self) -> None:
        """Hang up on all pages."""
        for call in tuple(self._calls):
            self._end(call)
        await asyncio.gather(*self._closing, return_exceptions=True)


class Sightings:
    """Detections in the camera's picture of a robot, while a page shows it."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._viewers: list[Viewer[Any]] = []

    def open(self) -> None:
        """Switch the detectors on; no effect if they are on."""
        if Vision not in self._robot or self._viewers:
            return
        vision = self._robot[Vision]
        detectors: list[Detector[Any]] = [vision.people, vision.faces, vision.gestures]
        detectors += [vision.markers, vision.robots, vision.tags]
        for detector in detectors:
            with suppress(Busy):  # draw the other boxes anyway
                self._viewers.append(detector.subscribe())

    def close(self) -> None:
        """Release the detectors, which go off unless another client uses them."""
        for viewer in self._viewers:
            viewer.close()
        self._viewers = []

    @property
    def boxes(self) -> list[list[object]]:
        """[kind, label, x, y, width, height] of each detection, in fractions of the picture; x, y: centre."""
        if not self._viewers:
            return []
        return [[kind, label, *_rounded(box)] for kind, label, box in _seen(self._robot[Vision])]


def _seen(vision: Vision) -> Iterator[tuple[str, str, Box]]:
    for person in _items(vision.people):
        yield "person", f"{person.distance:.1f} m", person.box
    for face in _items(vision.faces):
        yield "face", face.name, face.box
    for gesture in _items(vision.gestures):
        yield "gesture", gesture.gesture, gesture.box
    for marker in _items(vision.markers):
        yield "marker", marker.symbol, marker.box
    for robot in _items(vision.robots):
        yield "robot", f"{robot.distance:.1f} m", robot.box
    for tag in _items(vision.tags):
        yield "tag", tag.text, tag.box


def _items(detector: Detector[Any]) -> tuple[Any, ...]:
    sighting = detector.latest
    return () if sighting is None else sighting.seen


def _rounded(box: Box) -> tuple[float, ...]:
    return tuple(round(value, 4) for value in (box.x, box.y, box.width, box.height))
