"""Live video of the camera by WebRTC (4001), as decoded pictures. Imports aiortc on first use."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused
from roboglot.clients.errors import LinkLost, TimedOut
from roboglot.model.feed import Feed, Viewer
from roboglot.wire.cyberdog.chapters.camera import Description, End, Failure, Screen, Signal, fields_of
from roboglot.wire.cyberdog.codes import Code
from roboglot.wire.ice import offer_loopback

if TYPE_CHECKING:
    from av import VideoFrame

ANSWER_MAX = 15.0  # s: the robot itself gives up after 10


class Picture:
    """Incoming pictures: ``await pictures.next()``, or ``async for``."""

    def __init__(self, track: Any) -> None:
        self._track = track

    def __aiter__(self) -> Picture:
        return self

    async def __anext__(self) -> VideoFrame:
        from aiortc.mediastreams import MediaStreamError

        try:
            frame: VideoFrame = await self._track.recv()
        except MediaStreamError:
            raise StopAsyncIteration from None
        return frame

    async def next(self) -> VideoFrame:
        """Return the next picture. Raises LinkLost if there are no more."""
        try:
            return await anext(self)
        except StopAsyncIteration:
            raise LinkLost("the robot sends no more pictures") from None


class Video(Calls):
    """Image transmission."""

    signals: Feed[object]  # pushes of code 4001

    async def signal(self, signal: Signal) -> None:
        """4001: send a message of signalling; the robot's own arrive in ``signals``."""
        await self.text(Code.VIDEO, fields_of(signal))

    async def negotiate(self, uid: str, offer: str, screen: Screen | None = None) -> str:
        """Return the robot's SDP in answer to ``offer``. Raises CyberDogRefused, TimedOut."""
        with self.signals.subscribe() as signals:
            await self.signal(Description(uid, "offer", offer, screen))
            try:
                answer = await self.clock.wait_for(_answer(signals, uid), ANSWER_MAX)
            except TimeoutError:
                raise TimedOut(f"VIDEO: no answer within {ANSWER_MAX:g} s") from None
        if isinstance(answer, Failure):
            raise CyberDogRefused(Code.VIDEO.name, answer.code, answer.message)
        return answer.sdp

    async def end_video(self, uid: str) -> None:
        """End the video of ``uid``."""
        await self.signal(End(uid))

    @asynccontextmanager
    async def video(self, uid: str = "", screen: Screen | None = None) -> AsyncIterator[Picture]:
        """``async with client.video() as pictures: async for frame in pictures: …``; ``uid``: this viewer's own."""
        from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription

        uid = uid or f"roboglot {uuid4()}"
        offer_loopback()
        peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        tracks: asyncio.Queue[object] = asyncio.Queue()
        peer.add_listener("track", tracks.put_nowait)
        peer.addTransceiver("video", direction="recvonly")
        try:
            await peer.setLocalDescription(await peer.createOffer())
            answer = await self.negotiate(uid, peer.localDescription.sdp, screen)
            await peer.setRemoteDescription(RTCSessionDescription(answer, "answer"))
            try:
                track = await self.clock.wait_for(tracks.get(), ANSWER_MAX)
            except TimeoutError:
                raise TimedOut("VIDEO: the robot's answer has no pictures") from None
            yield Picture(track)
        finally:
            try:
                await self.end_video(uid)
            except LinkLost:
                pass  # the robot has disconnected
            finally:
                await peer.close()


async def _answer(signals: Viewer[Any], uid: str) -> Description | Failure:
    async for signal in signals:
        if signal.uid == uid and isinstance(signal, Description | Failure):
            return signal
    raise LinkLost("the client was closed")
