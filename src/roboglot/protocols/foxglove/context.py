"""One client: its subscriptions, its published topics and its actions. Given to every handler."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Sequence

import msgspec

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.client_context import set_client
from roboglot.model.robot import Robot
from roboglot.protocols.channels import Carrier
from roboglot.protocols.foxglove.channels import Channel, Source
from roboglot.protocols.foxglove.config import FoxgloveConfig
from roboglot.protocols.foxglove.vocabulary import DOOR, parameters
from roboglot.wire.foxglove.messages import (
    PLAYS,
    Level,
    Playback,
    message,
    message_data,
    playback_state,
    split_time,
    time_message,
)

log = logging.getLogger(__name__)
CAPABILITIES = ("clientPublish", "parameters", "parametersSubscribe", "time")
PLAYED = ("parameters", "parametersSubscribe", "time", "playbackControl")  # of a recorded robot
UNSENT_MAX = 1 << 20  # bytes queued for a slow client; further messages are dropped
DROPS_PERIOD = 10.0  # s between two log lines about that


class Published(msgspec.Struct, rename="camel"):
    """A topic that the client publishes."""

    id: int
    topic: str
    encoding: str
    schema_name: str = ""


class Context:
    """Context of one client, from its opening to its end."""

    def __init__(self, robot: Robot, carrier: Carrier, config: FoxgloveConfig, topics: Source | None = None) -> None:
        self.robot, self.config, self.topics = robot, config, topics
        self.subscriptions: dict[int, int] = {}  # the client's subscription number by channel
        self.published: dict[int, Published] = {}
        self.watched: dict[str, object] = {}  # parameters that it watches, and their last values sent, or None
        self.source = f"{DOOR} {carrier.name}"  # of the actions that this client starts
        self._carrier = carrier
        self._dropped = 0
        self._warned_at = -DROPS_PERIOD
        self._following: set[asyncio.Task[None]] = set()
        self.joined = asyncio.Event()  # set when ``topics`` is ready, or failed
        session = f"{robot.id}-{int(robot.clock.epoch() * 1e3)}"
        model = robot.description.model
        recorded = robot.responder.recorded if robot.responder is not None else None
        self.send(
            message(
                "serverInfo",
                name=f"roboglot: {robot.id}",
                capabilities=CAPABILITIES if recorded is None else PLAYED,
                supportedEncodings=["json"],
                metadata={"robot": robot.id, "model": model},
                sessionId=session,
                dataStartTime=None if recorded is None else split_time(recorded.first),
                dataEndTime=None if recorded is None else split_time(recorded.last),
            )
        )

    def close(self) -> None:
        """Handle the client's departure: its actions end."""
        if self.topics is not None:
            self.topics.leave(self)
        for action in self.robot.actions.running():
            if action.source == self.source:
                action.cancel("its client is gone", hard=True)
        for task in tuple(self._following):
            task.cancel()

    def send(self, data: str | bytes) -> None:
        """Send one message."""
        self._carrier.send(data)

    def status(self, level: Level, text: str) -> None:
        """Send a status message."""
        self.send(message("status", level=int(level), message=text))

    def follow(self, action: Action) -> None:
        """Report an action of the client that fails."""

        async def report() -> None:
            set_client("")  # not on behalf of a client
            if await action.done() is not ActionStatus.SUCCEEDED:
                end = action.status.name.lower()
                self.status(Level.WARNING, f"{action.name} {end}: {action.reason or 'another command came'}")

        task = asyncio.get_running_loop().create_task(report(), name="foxglove goal")
        self._following.add(task)
        task.add_done_callback(self._following.discard)

    # -- called by topics --

    def advertise(self, channels: Sequence[Channel]) -> None:
        """Announce further topics."""
        if channels:
            self.send(message("advertise", channels=[channel.row for channel in channels]))

    def wants(self, channel: int) -> int | None:
        """Return the client's number for a subscribed topic."""
        return self.subscriptions.get(channel)

    def deliver(self, subscription: int, at: int, data: bytes) -> None:
        """Send a message of a topic, or drop it where the client does not keep up."""
        if self._carrier.unsent > UNSENT_MAX:
            self._dropped += 1
        else:
            self.send(message_data(subscription, at, data))

    def beat(self, at: int, *, seldom: bool) -> None:
        """Send the time; if ``seldom``, also changed parameters and the number of dropped messages."""
        if self._carrier.unsent <= UNSENT_MAX:
            self.send(time_message(at))
        if not seldom:
            return
        now = self.robot.clock.time()
        if self._dropped and now - self._warned_at >= DROPS_PERIOD:
            self._warned_at, dropped, self._dropped = now, self._dropped, 0
            self.status(Level.WARNING, f"{dropped} messages were dropped: this client reads too slowly")
        self.report_parameters()

    def played(self, state: Playback) -> None:
        """Report a new state of the playback, which the older subprotocol cannot express."""
        if self._carrier.subprotocol in PLAYS:
            self.send(playback_state(state))

    def report_parameters(self) -> None:
        """Send changed parameters that the client follows; one that is gone has no value."""
        if not self.watched:  # without names, all would be found
            return
        gone: dict[str, dict[str, object]] = {name: {"name": name} for name in self.watched}
        found = gone | {row["name"]: row for row in parameters(self.robot, list(self.watched))}
        changed = [row for name, row in found.items() if self.watched[name] != row.get("value")]
        if changed:
            self.watched |= {row["name"]: row.get("value") for row in changed}
            self.send(message("parameterValues", parameters=changed))
