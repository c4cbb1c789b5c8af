"""Channels of a door, live or played: topics with their schemas, and their listeners."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from typing import Protocol

from roboglot.values import dataclass
from roboglot.wire.foxglove.messages import Playback


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic as clients know it."""

    id: int
    topic: str
    encoding: str
    schema: str
    schema_encoding: str
    schema_data: bytes

    @property
    def row(self) -> Mapping[str, object]:
        """Row of the channel in an ``advertise`` message."""
        binary = self.schema_encoding == "protobuf"
        return {
            "id": self.id,
            "topic": self.topic,
            "encoding": self.encoding,
            "schemaName": self.schema,
            "schemaEncoding": self.schema_encoding,
            "schema": (base64.b64encode(self.schema_data) if binary else self.schema_data).decode(),
        }


@dataclass(frozen=True, slots=True)
class PlaybackCommand:
    """Request of a client for playback: ``play`` or pause, speed, position to ``seek`` (ns), and its id."""

    play: bool
    speed: float
    seek: int | None = None
    request: str = ""


class Listener(Protocol):
    """A client that receives channels and messages."""

    def advertise(self, channels: Sequence[Channel]) -> None:
        """Announce further topics."""

    def wants(self, channel: int) -> int | None:
        """Return the listener's number for a subscribed topic; None: not subscribed."""

    def deliver(self, subscription: int, at: int, data: bytes) -> None:
        """Send a message; ``at``: ns since 1970."""

    def beat(self, at: int, *, seldom: bool) -> None:
        """Advance with robot time; ``seldom``: about once a second."""

    def played(self, state: Playback) -> None:
        """Report a new state of the playback."""


class Source(Protocol):
    """Source of channels and messages at a door."""

    @property
    def channels(self) -> Sequence[Channel]:
        """Known channels."""

    def join(self, listener: Listener) -> None:
        """Add a client: it gets all known topics, and further ones."""

    def leave(self, listener: Listener) -> None:
        """Remove a client; after the last one, sampling ends."""

    def close(self) -> None:
        """Stop sampling."""

    def show_last(self, listener: Listener, channel: int, subscription: int) -> None:
        """Send a new subscriber the last message, so that it need not wait for a change."""

    def look_at_camera(self) -> None:
        """Film only while a client has subscribed to the camera."""

    def control(self, listener: Listener, command: PlaybackCommand) -> None:
        """Play, pause or seek for a client. Raises NotFound if live, InvalidGoal."""
