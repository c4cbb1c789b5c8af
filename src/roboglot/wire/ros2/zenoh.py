"""rmw_zenoh's key expressions, attachments, and liveliness tokens, which make up the graph.

A topic's messages have the key ``DOMAIN/TOPIC/TYPE/HASH``; each node, publisher and subscription has a token.
"""

from __future__ import annotations

import struct
from uuid import uuid4

from roboglot.values import dataclass

_ATTACHMENT = struct.Struct("<qqB16s")
RELIABLE, KEPT = "::,10:,:,:,,", ":1:,1:,:,:,,"  # QoS in the syntax of liveliness tokens
GRAPH = "@ros2_lv"


def dds_type(type: str) -> str:
    """Return ``sensor_msgs/msg/LaserScan`` as ``sensor_msgs::msg::dds_::LaserScan_``."""
    package, kind, name = type.split("/")
    return f"{package}::{kind}::dds_::{name}_"


def topic_key(domain: int, topic: str, type: str, type_hash: str) -> str:
    """Return the key of a topic's messages; ``type_hash`` may be ``*`` to listen to all versions of the type."""
    return f"{domain}/{topic.strip('/')}/{dds_type(type)}/{type_hash}"


@dataclass(frozen=True, slots=True)
class Node:
    """A node of ROS; ``session``: the id of its Zenoh session."""

    domain: int
    session: str
    namespace: str
    name: str
    id: int = 0

    @property
    def token(self) -> str:
        """Key of the node's token."""
        return f"{self._head(self.id, 'NN')}"

    def publisher_token(self, number: int, topic: str, type: str, type_hash: str, qos: str) -> str:
        """Return the key of a publisher's token; ``number``: unique among the node's publishers and subscriptions."""
        return f"{self._head(number, 'MP')}/{mangled(topic)}/{dds_type(type)}/{type_hash}/{qos}"

    def subscription_token(self, number: int, topic: str, type: str, type_hash: str, qos: str) -> str:
        """Return the key of a subscription's token."""
        return f"{self._head(number, 'MS')}/{mangled(topic)}/{dds_type(type)}/{type_hash}/{qos}"

    def _head(self, number: int, kind: str) -> str:
        namespace = mangled(self.namespace or "/")
        return f"{GRAPH}/{self.domain}/{self.session}/{self.id}/{number}/{kind}/%/{namespace}/{self.name}"


def mangled(name: str) -> str:
    """Return a name in the form of tokens, with ``%`` for ``/``."""
    return name.replace("/", "%")


class Sender:
    """The id of a publisher, and the number of its last message, by which nodes notice that messages were lost."""

    def __init__(self) -> None:
        self._gid, self._sequence = uuid4().bytes, 0

    def attachment(self, at: int) -> bytes:
        """Return the next message's attachment: number, time (``at``, ns since 1970) and sender."""
        self._sequence += 1
        return _ATTACHMENT.pack(self._sequence, at, len(self._gid), self._gid)
