"""The CyberDog 2 protocol from the app's end: requests, awaitable tasks, pushes, files, pictures; TLS both ways.

Usable on its own::

    async with CyberDogClient("192.168.1.10", Certificates.load(Path("phone"))) as dog:
        await dog.found()                            # waits for heartbeats
        await (await dog.relocalise())
        await (await dog.navigate(1.5, 0.2))
        with dog.watch(Pose) as poses: ...

Uses the vendor's units and frames; knows no driver.
"""

from __future__ import annotations

import logging
from typing import Any, TypeVar

import msgspec

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused, NoAnswer
from roboglot.clients.cyberdog.chapters.camera.camera import Camera
from roboglot.clients.cyberdog.chapters.camera.video import Video
from roboglot.clients.cyberdog.chapters.mapping.labels import Labels
from roboglot.clients.cyberdog.chapters.motion import MotionChapter
from roboglot.clients.cyberdog.chapters.people.audio import Audio
from roboglot.clients.cyberdog.chapters.people.faces import Faces
from roboglot.clients.cyberdog.chapters.people.following import Following
from roboglot.clients.cyberdog.chapters.people.members import Members
from roboglot.clients.cyberdog.chapters.programming import Programs
from roboglot.clients.cyberdog.chapters.system.bluetooth import Bluetooth
from roboglot.clients.cyberdog.chapters.system.ota import Updates
from roboglot.clients.cyberdog.chapters.system.settings import Settings
from roboglot.clients.cyberdog.chapters.system.skin import Skin
from roboglot.clients.cyberdog.chapters.system.status import Status
from roboglot.clients.cyberdog.chapters.system.upkeep import Upkeep
from roboglot.clients.cyberdog.link import Certificates, DogLink, Heartbeat
from roboglot.clients.cyberdog.values import PUSHED, Value
from roboglot.clients.errors import BadAnswer, ClientError
from roboglot.model.clock import Clock, RealClock
from roboglot.model.feed import Feed, Viewer
from roboglot.transport.log_limiter import LogLimiter
from roboglot.validation import read_answer
from roboglot.wire.cyberdog.channel import APP_PORT, ROBOT_PORT
from roboglot.wire.cyberdog.chapters.camera import BadSignal, read_signal
from roboglot.wire.cyberdog.codes import Code
from roboglot.wire.cyberdog.text import NotJson, read_params

log = logging.getLogger(__name__)
V = TypeVar("V", bound=Value)
UNREAD_MAX = 256  # pushes queued for a slow reader, which then gets only the newest
FOUND_MAX = 20.0  # s to wait for the robot to call back


class CyberDogClient(
    Status,
    Settings,
    Skin,
    Updates,
    Bluetooth,
    Upkeep,
    MotionChapter,
    Following,
    Labels,
    Members,
    Audio,
    Faces,
    Camera,
    Video,
    Programs,
):
    """One robot. Every method raises CyberDogRefused (the robot's number and words), NoAnswer, LinkLost or TimedOut.

    ``certificates`` None: without TLS. ``app_port`` None: commands only, no heartbeats, no pushes, no pictures.
    """

    def __init__(
        self,
        host: str,
        certificates: Certificates | None,
        *,
        port: int = ROBOT_PORT,
        app_port: int | None = APP_PORT,
        clock: Clock | None = None,
    ) -> None:
        clock = clock or RealClock()
        self._log_limiter = LogLimiter(log)
        Calls.__init__(self, DogLink(host, port, certificates, clock, app_port=app_port, pushed=self._pushed))
        self.signals = _feed()
        self._feeds: dict[int, Feed[Any]] = {int(code): _feed() for code in PUSHED}
        self.frames = self._feeds[Code.PROGRAM_TO_APP]

    async def __aenter__(self) -> CyberDogClient:
        await self.link.open()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Disconnect; feeds of pushes end."""
        for feed in (*self._feeds.values(), self.signals):
            feed.close()
        await self.link.close()

    async def found(self, within: float = FOUND_MAX) -> Heartbeat:
        """Call the robot and wait until it calls back. Raises TimedOut, or ClientError without an ``app_port``."""
        if self.link.app_port is None:
            raise ClientError("this client has no server that the robot could call")
        try:
            serial = (await self.information("sn")).get("sn")
        except (NoAnswer, CyberDogRefused, BadAnswer):
            serial = None
        return await self.link.found(within, serial if isinstance(serial, str) else None)

    @property
    def heartbeat(self) -> Heartbeat | None:
        """Newest heartbeat; None before the first."""
        return self.link.heartbeat

    @property
    def connected(self) -> bool:
        """True while heartbeats arrive."""
        return self.link.connected

    def watch(self, kind: type[V]) -> Viewer[V]:
        """Return a viewer of future pushes of that kind: an async iterator to be closed, best by ``with``."""
        code = next(code for code, value in PUSHED.items() if value is kind)
        return self._feeds[code].subscribe()

    def _pushed(self, code: int, text: str) -> None:
        try:
            if code == Code.VIDEO:
                self.signals.push(read_signal(read_params(text)))
            elif code in self._feeds:
                self._feeds[code].push(read_answer(text.encode() or b"{}", PUSHED[Code(code)]))
            else:
                log.debug("unknown push %d", code)
        except (msgspec.MsgspecError, NotJson, BadSignal) as error:
            self._log_limiter.warning(str(code), "cannot read push %d: %s", code, error)


def _feed() -> Feed[object]:
    return Feed(lambda: None, lambda: None, queue_max=UNREAD_MAX)
