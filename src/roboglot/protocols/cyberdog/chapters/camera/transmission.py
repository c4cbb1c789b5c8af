"""Chapter "image transmission": the camera live by WebRTC (4001): signalling as requests and pushes, a peer per uid.

Peers run on real time: the network's delays do not follow the robot's clock.
"""

from __future__ import annotations

import asyncio
import importlib
import logging
from collections.abc import Coroutine
from typing import TYPE_CHECKING, Any

from roboglot.media.fitting import FittedPictures
from roboglot.media.video import VideoStream, beside
from roboglot.model.client_context import connection, identity
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.table import push
from roboglot.wire.cyberdog.chapters.camera import (
    Alignment,
    Candidate,
    Description,
    End,
    Failure,
    Screen,
    Signal,
    VideoError,
    fields_of,
)
from roboglot.wire.cyberdog.codes import Code

if TYPE_CHECKING:
    from roboglot.media.webrtc import VideoCall

log = logging.getLogger(__name__)
PUSHED_MAX = 16  # addresses beside an answer, which has all of them and would be dropped before more
PATIENCE = 10.0  # s (machine clock) to find a way to the app
PEERS_MAX = 16  # apps that watch or connect at the same time
SIGNAL = push(Code.VIDEO, depth=PEERS_MAX * (PUSHED_MAX + 2))  # an answer, its addresses and an end for each
TASKS_MAX = 4 * PEERS_MAX  # calls that are answered, served or closed at the same time
EARLY_MAX = 32  # candidates of one app that arrived before its offer
SCREEN_WIDTH = 640  # width of pictures for a screen of unknown size
PLACES = {Alignment.TOP: 0.0, Alignment.MIDDLE: 0.5, Alignment.BOTTOM: 1.0}


class Transmission:
    """Video calls of all viewing apps, by uid."""

    def __init__(self, robot: Robot, app: AppLink) -> None:
        self._robot, self._app = robot, app
        self._peers: dict[str, _Peer] = {}
        self._streams: dict[tuple[int, Alignment], VideoStream] = {}
        self._running: set[asyncio.Task[None]] = set()

    @property
    def viewers(self) -> int:
        """Number of apps that view or are connecting."""
        return sum(peer.offered for peer in self._peers.values())

    def take(self, signal: Signal) -> None:
        """Handle a message of the app. Never waits; answers are pushed."""
        match signal:
            case End(uid):
                if peer := self._peers.pop(uid, None):
                    self._begin(self._end(peer))
            case Description(uid, "offer"):
                self._offered(uid, signal)
            case Candidate(uid, candidate, mid, index) if peer := self._peer(uid):
                peer.put(candidate, mid, index)
            case _:
                log.info("ignored a signal of type %s", type(signal).__name__)

    def end_all_of(self, who: str) -> None:
        """End the calls of a client that lost rights."""
        for peer in [peer for peer in self._peers.values() if peer.owner == who]:
            self._fail(peer, VideoError.NO_CONNECTION, f"{who} lost rights on this robot")

    async def close(self) -> None:
        """End all calls."""
        peers, self._peers = list(self._peers.values()), {}
        for task in self._running:
            task.cancel()
        await asyncio.gather(*self._running, *(peer.close() for peer in peers), return_exceptions=True)

    def _offered(self, uid: str, offer: Description) -> None:
        """Answer an offer; one under a known uid replaces the call: the app started over."""
        if (old := self._peers.get(uid)) and old.offered:
            self._forget(old)
            self._begin(old.close())
        peer = self._peer(uid) if len(self._running) < TASKS_MAX else None
        if peer is None:
            self._push(Failure(uid, VideoError.NO_CONNECTION, f"{PEERS_MAX} apps receive pictures already"))
            return
        peer.offered = True
        self._begin(self._connect(peer, offer))

    def _peer(self, uid: str) -> _Peer | None:
        """Return the app's peer, or a new one if there is room."""
        if uid not in self._peers:
            if len(self._peers) >= PEERS_MAX:
                log.warning("refused pictures to %r: %d apps receive them", uid, PEERS_MAX)
                return None
            peer = self._peers[uid] = _Peer(uid)
            peer.give_up = asyncio.get_running_loop().call_later(PATIENCE, self._late, peer)
        return self._peers[uid]

    def _late(self, peer: _Peer) -> None:
        self._fail(peer, VideoError.NO_CONNECTION, "ICE connection timeout")

    def _fail(self, peer: _Peer, code: VideoError, message: str) -> None:
        """Report a failure to the app and drop the peer."""
        if self._forget(peer):
            if peer.offered:
                self._push(Failure(peer.uid, code, message))
            self._begin(peer.close())

    def _forget(self, peer: _Peer) -> bool:
        """Drop the peer; return whether it was still known."""
        peer.give_up.cancel()
        if self._peers.get(peer.uid) is not peer:
            return False
        del self._peers[peer.uid]
        return True

    async def _connect(self, peer: _Peer, offer: Description) -> None:
        if not self._robot.admission.carries_datagrams(connection()):
            self._fail(peer, VideoError.NO_CONNECTION, "roboglot connect carries no WebRTC: take photos, or films")
            return
        webrtc: Any = await beside(self._robot.clock, lambda: importlib.import_module("roboglot.media.webrtc"))
        stream = self._stream(offer.screen)
        call: VideoCall = webrtc.VideoCall(stream, self._robot.clock, lambda state: self._changed(peer, state))
        peer.call = call
        try:
            answer = await call.answer(offer.sdp)
        except webrtc.BadOffer as bad:
            log.info("cannot answer the offer of %r: %s", peer.uid, bad)
            self._fail(peer, VideoError.NO_CONNECTION, f"the offer cannot be answered: {bad}")
            return
        if self._peers.get(peer.uid) is not peer:  # it gave up meanwhile
            await call.close()
            return
        self._push(Description(peer.uid, "answer", answer))
        for ours in call.candidates()[:PUSHED_MAX]:
            self._push(Candidate(peer.uid, ours.text, ours.mid, ours.index))
        await peer.pass_on(webrtc.BadOffer)

    def _changed(self, peer: _Peer, state: str) -> None:
        """Handle a change of the connection's state, as aiortc words it."""
        log.info("the video call of %r is %s", peer.uid, state)
        match state:
            case "connected":
                peer.give_up.cancel()
            case "blind":
                self._fail(peer, VideoError.NO_CAMERA, "the camera gives no pictures")
            case "failed":
                self._fail(peer, VideoError.NO_CONNECTION, "ICE connection failed")
            case "closed" if self._forget(peer):
                self._begin(peer.close())

    def _stream(self, screen: Screen | None) -> VideoStream:
        """Return the camera's stream, or one for a screen of that shape; all screens of one shape share an encoder."""
        if screen is None:
            return self._robot[VideoStream]
        height = 2 * max(1, round(SCREEN_WIDTH * screen.height / screen.width / 2))
        key = (height, screen.alignment)
        if key not in self._streams:
            if len(self._streams) >= PEERS_MAX:
                self._streams = {}  # viewers of a stream keep it open
            clock, camera = self._robot.clock, self._robot[Camera]
            pictures = FittedPictures(camera, clock, SCREEN_WIDTH, height, PLACES[screen.alignment])
            self._streams[key] = VideoStream(pictures, clock)
        return self._streams[key]

    async def _end(self, peer: _Peer) -> None:
        peer.give_up.cancel()
        await peer.close()
        self._push(End(peer.uid, done=True))

    def _push(self, signal: Signal) -> None:
        self._app.push(SIGNAL, fields_of(signal))

    def _begin(self, work: Coroutine[object, None, None]) -> None:
        task = asyncio.get_running_loop().create_task(work, name="image transmission")
        self._running.add(task)
        task.add_done_callback(self._done)

    def _done(self, task: asyncio.Task[None]) -> None:
        self._running.discard(task)
        if not task.cancelled() and (error := task.exception()):
            log.error("image transmission crashed", exc_info=error)


class _Peer:
    """One app: its call, and candidates that arrived before it."""

    def __init__(self, uid: str) -> None:
        self.uid = uid
        self.owner = identity()
        self.offered = False
        self.call: VideoCall | None = None
        self.give_up: asyncio.TimerHandle
        self._waiting: list[tuple[str, str | None, int | None]] = []
        self._more = asyncio.Event()

    def put(self, candidate: str, mid: str | None, index: int | None) -> None:
        """Add an ICE candidate of the app."""
        if len(self._waiting) < EARLY_MAX:
            self._waiting.append((candidate, mid, index))
            self._more.set()

    async def pass_on(self, bad: type[Exception]) -> None:
        """Pass candidates on to the call as they arrive, until it is closed."""
        total = 0
        while self.call is not None and total < EARLY_MAX:
            while self._waiting and self.call is not None:
                candidate, mid, index = self._waiting.pop(0)
                total += 1
                try:
                    await self.call.add_candidate(candidate, mid, index)
                except bad as error:
                    log.info("cannot use a candidate of %r: %s", self.uid, error)
            self._more.clear()
            await self._more.wait()

    async def close(self) -> None:
        """Close the call."""
        call, self.call = self.call, None
        self._more.set()
        if call is not None:
            await call.close()
