"""Live video and sound to one viewer by WebRTC: the streams' own packets, so that one encoder serves all viewers.

Imports aiortc: import this module only when a picture is requested. Independent of the signalling: texts go in and
come out. Packets are stamped with their time of display, in the network's time, not the robot's.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Generic, TypeVar

from aiortc import (
    MediaStreamTrack,
    RTCConfiguration,
    RTCPeerConnection,
    RTCRtpReceiver,
    RTCRtpSender,
    RTCSessionDescription,
)
from aiortc.exceptions import InvalidAccessError, InvalidStateError, OperationError
from aiortc.mediastreams import MediaStreamError
from aiortc.sdp import candidate_from_sdp
from av.packet import Packet
from av.stream import Stream

from roboglot.media.audio import AudioStream
from roboglot.media.h264 import VideoPacket
from roboglot.media.opus import AudioPacket
from roboglot.media.video import VideoStream
from roboglot.model.clock import Clock, RealClock
from roboglot.model.components.sensing.microphone import BLOCK
from roboglot.model.errors import RobotError
from roboglot.model.feed import Viewer
from roboglot.model.sound import SAMPLE_RATE
from roboglot.values import dataclass
from roboglot.wire.ice import offer_loopback

P = TypeVar("P", VideoPacket, AudioPacket)
KEYFRAME_EVERY = 0.3  # s between two keyframes requested by one viewer
GAP = SAMPLE_RATE // 5  # samples by which audio may be early or late without a gap
SECTIONS_MAX = 8  # media sections per offer: each may open sockets
H264, RETRANSMISSION = "video/h264", "video/rtx"


class BadOffer(ValueError):
    """An SDP that cannot be answered, with the reason as its message."""


@dataclass(frozen=True, slots=True)
class IceCandidate:
    """One address of this side as SDP text, for the media section ``mid`` (number ``index``)."""

    text: str
    mid: str
    index: int


class _PacketTrack(MediaStreamTrack, Generic[P]):
    """Passes a stream's packets on unchanged; views the stream from the first ``recv``."""

    base: Fraction  # s, the unit of a packet's time

    def __init__(self, subscribe: Callable[[], Viewer[P]], clock: Clock, ended: Callable[[], None]) -> None:
        super().__init__()
        self._subscribe: Callable[[], Viewer[P]] = subscribe
        self._clock, self._ended = clock, ended
        self._viewer: Viewer[P] | None = None
        self._last = -1

    async def recv(self) -> Packet[Stream]:
        """Return the next packet. Raises MediaStreamError at the end."""
        try:
            if self._viewer is None:
                self._viewer = self._subscribe()
            media = await anext(self._viewer)
        except (StopAsyncIteration, RobotError):
            if self.readyState == "live":
                self._ended()
            self.stop()
            raise MediaStreamError from None
        packet = self._packet(media)
        self._last = packet.pts = self._due(round(self._shown_at(media.stamp) / self.base))
        packet.time_base = self.base
        return packet

    def _packet(self, media: P) -> Packet[Stream]:
        return Packet(media.data)

    def _due(self, now: int) -> int:
        """Return the time to show a packet, in units of ``base``; ``now``: the time of its media."""
        return max(self._last + 1, now)

    def _shown_at(self, stamp: float) -> float:
        """Return the real time (s) of a stamp: faster clocks show pictures faster; in lockstep, the present time."""
        if isinstance(self._clock, RealClock):
            return self._clock.real_time_of(stamp)
        return asyncio.get_running_loop().time()

    def stop(self) -> None:
        super().stop()
        if self._viewer is not None:
            self._viewer.close()


class _PictureTrack(_PacketTrack[VideoPacket]):
    """Track of the camera."""

    kind, base = "video", Fraction(1, 90_000)

    def __init__(self, stream: VideoStream, clock: Clock, blind: Callable[[], None]) -> None:
        super().__init__(stream.subscribe, clock, blind)
        self._stream = stream
        self._keyframe_at = float("-inf")

    def _packet(self, media: VideoPacket) -> Packet[Stream]:
        packet = super()._packet(media)
        packet.is_keyframe = media.keyframe
        return packet

    def request_keyframe(self) -> None:
        """Request a keyframe for a viewer that lost packets, at a limited rate."""
        now = asyncio.get_running_loop().time()
        if now - self._keyframe_at >= KEYFRAME_EVERY:
            self._keyframe_at = now
            self._stream.request_keyframe()


class _SoundTrack(_PacketTrack[AudioPacket]):
    """Track of the microphone."""

    kind, base = "audio", Fraction(1, SAMPLE_RATE)

    def __init__(self, stream: AudioStream, clock: Clock) -> None:
        super().__init__(stream.subscribe, clock, lambda: None)

    def _due(self, now: int) -> int:
        """Return the end of the last packet, unless sound was missing in between."""
        follows = self._last + BLOCK
        return follows if self._last >= 0 and abs(now - follows) < GAP else max(self._last + 1, now)


class VideoCall:
    """Call of one viewer. ``changed(state)`` receives aiortc's connection states, and "blind" after the last picture.

    ``sound`` is also sent to a viewer that requests it.
    """

    def __init__(
        self, stream: VideoStream, clock: Clock, changed: Callable[[str], None], sound: AudioStream | None = None
    ) -> None:
        offer_loopback()
        # No STUN servers: no outside host learns our address.
        self._peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        self._track = _PictureTrack(stream, clock, lambda: changed("blind"))
        self._sound = _SoundTrack(sound, clock) if sound is not None else None
        self._peer.add_listener("connectionstatechange", lambda: changed(self._peer.connectionState))

    async def answer(self, offer: str) -> str:
        """Return the SDP answer to ``offer``, with all addresses of this side; to be called once. Raises BadOffer."""
        if offer.count("m=") > SECTIONS_MAX:
            raise BadOffer(f"more than {SECTIONS_MAX} media sections")
        peer = self._peer
        sender: RTCRtpSender = peer.addTrack(self._track)
        (transceiver,) = peer.getTransceivers()
        transceiver.direction = "sendonly"
        known = RTCRtpReceiver.getCapabilities("video")
        codecs = known.codecs if known else []
        transceiver.setCodecPreferences([codec for codec in codecs if codec.mimeType.lower() in (H264, RETRANSMISSION)])
        # aiortc asks its own encoder for a keyframe; we use another one.
        vars(sender)["_send_keyframe"] = self._track.request_keyframe
        if self._sound is not None and "\nm=audio" in offer:
            peer.addTrack(self._sound)
        try:
            await peer.setRemoteDescription(RTCSessionDescription(offer, "offer"))
            if transceiver.mid is None or transceiver._offerDirection not in ("sendonly", "sendrecv"):
                raise BadOffer("it does not ask for video")
            await peer.setLocalDescription(await peer.createAnswer())
        except BadOffer:
            raise
        except (ValueError, KeyError, IndexError, AttributeError, AssertionError, TypeError) as error:
            # Raised by its parser for malformed lines.
            raise BadOffer(f"not an SDP: {error!r}") from error
        except (InvalidAccessError, InvalidStateError, OperationError) as error:
            raise BadOffer(str(error)) from error
        return str(peer.localDescription.sdp)

    def candidates(self) -> Sequence[IceCandidate]:
        """Return the addresses of this side, as in the answer."""
        found: list[IceCandidate] = []
        section, mid = -1, ""
        lines = self._peer.localDescription.sdp.splitlines() if self._peer.localDescription else []
        mids = [line[6:] for line in lines if line.startswith("a=mid:")]
        for line in lines:
            if line.startswith("m="):
                section += 1
                mid = mids[section] if section < len(mids) else str(section)
            elif line.startswith("a=candidate:"):
                found.append(IceCandidate(line[2:], mid, section))
        return found

    async def add_candidate(self, text: str, mid: str | None, index: int | None) -> None:
        """Add an address of the viewer; empty: there are no more. Raises BadOffer for a malformed one."""
        if not text:
            return  # later ones are accepted
        try:
            candidate = candidate_from_sdp(text.removeprefix("a=").removeprefix("candidate:"))
            candidate.sdpMid, candidate.sdpMLineIndex = mid, index
            await self._peer.addIceCandidate(candidate)
        except (ValueError, IndexError, AssertionError, KeyError) as error:
            raise BadOffer(f"not a candidate: {error}") from error

    async def close(self) -> None:
        """Hang up."""
        self._track.stop()
        if self._sound is not None:
            self._sound.stop()
        await self._peer.close()
