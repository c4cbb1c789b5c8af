"""The door: a Zenoh router at the robot's address, where its topics are published and others listened to."""

from __future__ import annotations

import asyncio
import json
import logging
import time
from collections import defaultdict
from collections.abc import Coroutine, Sequence
from functools import partial
from typing import TYPE_CHECKING

from roboglot.extras import explaining
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.background import beside
from roboglot.model.client_context import set_client
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.system.link import is_current
from roboglot.model.errors import RobotError
from roboglot.model.robot import Robot
from roboglot.protocols.door import Endpoint
from roboglot.protocols.ros2.config import Ros2Config
from roboglot.protocols.ros2.context import Context
from roboglot.protocols.ros2.dispatch import MESSAGE_MAX, answer
from roboglot.protocols.ros2.intake import Intake
from roboglot.protocols.ros2.table import PUBLISHED
from roboglot.protocols.ros2.vocabulary import DOOR, TYPES
from roboglot.protocols.turns import Turns
from roboglot.transport.log_limiter import LogLimiter
from roboglot.wire.ros2.zenoh import KEPT, RELIABLE, Node, Sender, topic_key

if TYPE_CHECKING:
    import zenoh
    from zenoh.ext import AdvancedPublisher

    from roboglot.recording.entries import Entry
    from roboglot.recording.ros2.translation import Ros2Translator, RosMessage
    from roboglot.recording.sampler import Sampler

log = logging.getLogger(__name__)
PENDING_MAX = 32  # messages of a topic queued for handling; beyond this the oldest are dropped and logged
FULL = "robot %s: too many messages of %s come: the oldest are dropped"
PASSED_MAX = 32 * 1024 * 1024  # bytes of a message between other nodes; longer ones are dropped
PICTURE_PERIOD = 0.2  # s
JPEG_QUALITY = 80
NODE = "roboglot"


class Ros2Door:
    """ROS 2 door of one robot; closed unless enabled."""

    name = DOOR

    def __init__(self, robot: Robot, address: str, config: Ros2Config) -> None:
        self._robot, self._address, self._config = robot, address, config
        self._namespace = config.namespaces.get(robot.id, robot.id)
        self._session: zenoh.Session | None = None
        self._node: Node | None = None
        self._tokens: list[object] = []  # announcements, which end when they are released
        self._publishers: dict[str, zenoh.Publisher | AdvancedPublisher] = {}
        self._senders = defaultdict[str, Sender](Sender)
        self._numbers = 0
        self._log_limiter = LogLimiter(log)
        self._heard = Intake(PENDING_MAX, partial(self._log_limiter.warning, "full", FULL, robot.id))
        self._turns = Turns(robot, f"{DOOR} {robot.id}:zenoh")
        self._called = False  # by a thread of Zenoh's, to take what was heard
        self._answering: asyncio.Task[None] | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._sampler: Sampler | None = None
        self._battery: Entry | None = None
        self._translator: Ros2Translator | None = None

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """The router's address."""
        if self._session is None:
            return ()
        listen = f"ZENOH_CONFIG_OVERRIDE='connect/endpoints=[\"{self._locator}\"]' ros2 topic list"
        return [Endpoint("ROS 2", self._locator, listen)]

    @property
    def _words(self) -> Ros2Translator:
        assert self._translator is not None  # set when the door opens
        return self._translator

    @property
    def _locator(self) -> str:
        return f"tcp/{self._address}:{self._config.port}"

    async def start(self) -> None:
        """Listen and publish. Raises MissingExtra without its libraries, OSError for an address that is taken."""
        if not self._config.enabled:
            return
        if self._robot.admission.enforced:
            log.warning("robot %s: the ROS 2 door stays closed: Zenoh shows no one's rights", self._robot.id)
            return
        with explaining("the ROS 2 door", "ros2"):
            import zenoh

            from roboglot.recording.ros2.translation import Ros2Translator
            from roboglot.recording.sampler import Sampler
        loop = asyncio.get_running_loop()
        try:
            self._session = await loop.run_in_executor(None, zenoh.open, self._zenoh_config())
        except zenoh.ZError as error:
            raise OSError(f"{self._locator}: {error}") from None
        self._translator = Ros2Translator(self._robot.id)
        self._node = Node(self._config.domain, str(self._session.zid()), f"/{self._namespace}", NODE)
        self._tokens.append(self._session.liveliness().declare_token(self._node.token))
        for key, type in TYPES.items():
            self._subscribe(key, type)
        self._sampler = Sampler(self._robot, self._put)
        self._follow(self._sample(self._sampler))
        self._follow(self._film())

    def _zenoh_config(self) -> zenoh.Config:
        import zenoh

        config = zenoh.Config()
        for key, value in {
            "mode": "router",
            "listen/endpoints": [self._locator],
            "connect/endpoints": list(self._config.connect),
            "scouting/multicast/enabled": False,
            "transport/link/rx/max_message_size": PASSED_MAX,
        }.items():
            config.insert_json5(key, json.dumps(value))
        return config

    async def close(self) -> None:
        """Stop publishing, and cancel the actions commanded here."""
        for task in tuple(self._tasks):
            task.cancel()
        if self._sampler is not None:
            self._sampler.close()
            self._sampler = None
        for action in self._robot.actions.running():
            if action.source == DOOR:
                action.cancel("the ROS 2 door closes")
        session, self._session = self._session, None
        self._publishers.clear()
        self._tokens.clear()
        if session is not None:
            await asyncio.get_running_loop().run_in_executor(None, session.close)

    def _follow(self, work: Coroutine[None, None, None]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(work, name=f"ros2 {self._robot.id}")
        self._tasks.add(task)
        task.add_done_callback(self._ended)
        return task

    def _ended(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("robot %s: the ROS 2 door broke: %s", self._robot.id, error, exc_info=error)

    # -- listening --

    def _subscribe(self, key: str, type: str) -> None:
        from roboglot.recording.ros2.translation import STORE

        assert self._node is not None
        assert self._session is not None
        topic, hashed = self._topic(key), STORE.hash_rihs01(type)
        self._numbers += 1
        token = self._node.subscription_token(self._numbers, topic, type, hashed, RELIABLE)
        self._tokens.append(self._session.liveliness().declare_token(token))
        loop = asyncio.get_running_loop()

        def on_sample(sample: zenoh.Sample) -> None:  # in a thread of Zenoh's
            data = sample.payload.to_bytes() if len(sample.payload) <= MESSAGE_MAX else None
            self._heard.put(key, data)
            if not self._called:
                self._called = True
                loop.call_soon_threadsafe(self._take)

        key_of_all = topic_key(self._config.domain, topic, type, "*")
        self._tokens.append(self._session.declare_subscriber(key_of_all, on_sample))

    def receive(self, key: str, data: bytes) -> None:
        """Handle a message as if it had come from Zenoh, if the door is open."""
        self._heard.put(key, data)
        self._take()

    def _topic(self, name: str) -> str:
        return f"/{self._namespace}/{name}" if self._namespace else f"/{name}"

    def _take(self) -> None:
        """Answer received messages."""
        self._called = False
        self._turns.look()
        if self._session is not None and (self._answering is None or self._answering.done()):
            self._answering = self._follow(self._answer_all())

    async def _answer_all(self) -> None:
        set_client(DOOR)
        while self._heard:
            await self._turns.take(self._heard.stops)
            await self._turns.count(self._answer(*self._heard.pop()))

    async def _answer(self, key: str, data: bytes | None) -> None:
        """Answer a message; None stands for one that is too long."""
        from roboglot.recording.ros2.translation import read_cdr

        level, why = await answer(Context(self._robot, self._config, self._report), key, data, read_cdr)
        if why:
            self._log(level, why)

    def _report(self, action: Action) -> None:
        async def wait() -> None:
            if await action.done() is not ActionStatus.SUCCEEDED:
                end = action.status.name.lower()
                self._log(logging.WARNING, f"{action.name} {end}: {action.reason or 'another command came'}")

        self._follow(wait())

    # -- publishing --

    async def _sample(self, sampler: Sampler) -> None:
        from roboglot.recording.sampler import POSE_PERIOD, STATE_BEATS

        number = 0
        sampler.beat(number)
        async for _ in self._robot.clock.every(POSE_PERIOD):
            number += 1
            sampler.beat(number)
            if self._battery is not None and number % STATE_BEATS == 0 and is_current(self._robot):
                self._show(self._battery._replace(at=self._now()))
            if Gimbal in self._robot and is_current(self._robot):
                attitude = self._robot[Gimbal].attitude
                joints = {"gimbal_pitch": attitude.pitch, "gimbal_yaw": attitude.yaw}
                self._publish(self._words.joints(self._now(), joints), "joint_states")

    async def _film(self) -> None:
        from roboglot.media.stills import jpeg

        async for _ in self._robot.clock.every(PICTURE_PERIOD):
            if Camera not in self._robot:  # a real robot's appears with its link
                continue
            topic = self._topic("image/compressed")
            publisher = self._publishers.get(topic)
            if publisher is not None and not _is_watched(publisher):
                continue
            if publisher is None:
                self._declare(topic, "sensor_msgs/msg/CompressedImage", kept=False)
                continue
            try:
                frame = await self._robot[Camera].capture()
            except RobotError as error:  # a real robot's camera is silent while its link is lost
                self._log_limiter.info("camera", "robot %s: no picture for ROS: %s", self._robot.id, error)
                continue
            picture = await beside(partial(jpeg, frame, JPEG_QUALITY))
            self._publish(self._words.picture(self._now(), f"{self._robot.id}/camera", picture), "image/compressed")

    def _put(self, entry: Entry) -> None:
        """Publish an entry of a recording, if ROS has a type for it."""
        if entry.kind == "battery":  # a recording contains changes only; ROS expects it periodically
            self._battery = entry
        if entry.kind in PUBLISHED:
            self._show(entry)

    def _show(self, entry: Entry) -> None:
        from roboglot.recording.entries import KINDS
        from roboglot.recording.reader import Record

        kind = KINDS[entry.kind]
        record = Record(entry.topic, kind.schema, entry.at, kind.encode(entry.at, entry.value))
        for message in self._words.translate(record):
            if message.type != "std_msgs/msg/String":
                self._publish(message)

    def _log(self, level: int, text: str) -> None:
        log.info("robot %s: %s", self._robot.id, text)
        self._publish(self._words.line(self._now(), level, NODE, text))

    def _now(self) -> int:
        return round(self._robot.clock.epoch() * 1e9)

    def _publish(self, message: RosMessage, name: str = "") -> None:
        if self._session is None:
            return
        topic = message.topic
        if topic.startswith(f"/{self._robot.id}/"):
            topic = self._topic(topic.removeprefix(f"/{self._robot.id}/"))
        topic = self._topic(name) if name else topic
        publisher = self._publishers.get(topic) or self._declare(topic, message.type, kept=message.kept)
        publisher.put(message.data, attachment=self._senders[topic].attachment(time.time_ns()))

    def _declare(self, topic: str, type: str, *, kept: bool) -> zenoh.Publisher | AdvancedPublisher:
        import zenoh
        from zenoh.ext import CacheConfig, declare_advanced_publisher

        from roboglot.recording.ros2.translation import STORE

        assert self._node is not None
        assert self._session is not None
        hashed = STORE.hash_rihs01(type)
        self._numbers += 1
        token = self._node.publisher_token(self._numbers, topic, type, hashed, KEPT if kept else RELIABLE)
        key = topic_key(self._config.domain, topic, type, hashed)
        drop = zenoh.CongestionControl.DROP
        publisher: zenoh.Publisher | AdvancedPublisher
        if kept:
            cache = CacheConfig(1)
            publisher = declare_advanced_publisher(
                self._session, key, cache=cache, publisher_detection=True, congestion_control=drop
            )
        else:
            publisher = self._session.declare_publisher(key, congestion_control=drop)
        self._publishers[topic] = publisher
        self._tokens.append(self._session.liveliness().declare_token(token))
        return publisher


def _is_watched(publisher: object) -> bool:
    """Return True if someone listens. Zenoh's stubs know nothing of its status' own field."""
    return bool(getattr(getattr(publisher, "matching_status", None), "matching", True))
