"""Orders and instant actions of fleet control, with the fields of both versions, bounded and checked."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import Annotated, Literal, TypeVar

import msgspec

from roboglot.validation import why_invalid

MESSAGE_MAX = 1 << 20  # bytes
NODES_MAX = 1000
ACTIONS_MAX = 64  # per node; per message
PARAMETERS_MAX = 64

Id = Annotated[str, msgspec.Meta(min_length=1, max_length=256)]
Text = Annotated[str, msgspec.Meta(max_length=4096)]
Texts = Annotated[tuple[Text, ...], msgspec.Meta(max_length=64)]
Count = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
Metres = Annotated[float, msgspec.Meta(ge=-100_000, le=100_000)]
Angle = Annotated[float, msgspec.Meta(ge=-3.1416, le=3.1416)]
NotNegative = Annotated[float, msgspec.Meta(ge=0, le=100_000)]


class Malformed(ValueError):
    """The bytes are not a valid message; the text says where."""


class Parameter(msgspec.Struct, frozen=True):
    """One parameter of an action."""

    key: Id
    value: object


class Action(msgspec.Struct, frozen=True, rename="camel"):
    """An action at a node, on an edge or at once."""

    action_type: Id
    action_id: Id
    blocking_type: Literal["NONE", "SINGLE", "SOFT", "HARD"] = "HARD"
    action_parameters: Annotated[tuple[Parameter, ...], msgspec.Meta(max_length=PARAMETERS_MAX)] = ()
    retriable: bool = False  # 3.0: may be tried again after a failure

    @property
    def values(self) -> dict[str, object]:
        """Values of the parameters by key."""
        return {parameter.key: parameter.value for parameter in self.action_parameters}


class Ellipse(msgspec.Struct, frozen=True):
    """Allowed deviation from a node (3.0): half axes in m."""

    a: NotNegative
    b: NotNegative
    theta: Angle = 0.0


class NodePosition(msgspec.Struct, frozen=True):
    """Position of a node in the map (m, rad)."""

    x: Metres
    y: Metres
    map_id: Id = msgspec.field(name="mapId")
    theta: Angle | None = None
    deviation: NotNegative | Ellipse | None = msgspec.field(name="allowedDeviationXY", default=None)
    deviation_theta: NotNegative | None = msgspec.field(name="allowedDeviationTheta", default=None)

    @property
    def reach(self) -> float:
        """Distance from the node that counts as arrived, m; 0: as near as possible."""
        match self.deviation:
            case Ellipse(a=a, b=b):
                return min(a, b)
            case None:
                return 0.0
            case radius:
                return float(radius)


Actions = Annotated[tuple[Action, ...], msgspec.Meta(max_length=ACTIONS_MAX)]


class OrderPart(msgspec.Struct, frozen=True, rename="camel", kw_only=True):
    """Common fields of nodes and edges: their sequence number, and ``released``: part of the order's base."""

    sequence_id: Count
    released: bool
    actions: Actions


class Node(OrderPart, frozen=True, rename="camel", kw_only=True):
    """A place to pass on the way."""

    node_id: Id
    node_position: NodePosition | None = None


class Edge(OrderPart, frozen=True, rename="camel", kw_only=True):
    """The way between two nodes; unsupported fields are parsed so that they can be refused.

    Limits have several names: those of 2.1, of drafts of 3.0, and of 3.0.
    """

    edge_id: Id
    start_node_id: Text | None = None
    end_node_id: Text | None = None
    max_speed: NotNegative | None = None
    maximum_speed: NotNegative | None = None
    max_height: NotNegative | None = None
    maximum_height: NotNegative | None = None
    maximum_mobile_robot_height: NotNegative | None = None
    min_height: NotNegative | None = None
    minimum_height: NotNegative | None = None
    minimum_load_handling_device_height: NotNegative | None = None
    max_rotation_speed: NotNegative | None = None
    maximum_rotation_speed: NotNegative | None = None
    orientation: object = None
    direction: object = None
    rotation_allowed: bool | None = None
    trajectory: object = None
    corridor: object = None

    @property
    def speed(self) -> float | None:
        """Speed limit, m/s; None: no limit."""
        return _least(self.max_speed, self.maximum_speed)

    @property
    def rotation_speed(self) -> float | None:
        """Limit of the turning rate, rad/s; None: no limit."""
        return _least(self.max_rotation_speed, self.maximum_rotation_speed)

    @property
    def height(self) -> float | None:
        """Limit of the robot's height, m; None: no limit."""
        return _least(self.max_height, self.maximum_height, self.maximum_mobile_robot_height)

    @property
    def device_height(self) -> float:
        """Height above which the load handling device has to be, m."""
        given = self.min_height, self.minimum_height, self.minimum_load_handling_device_height
        return max((height for height in given if height is not None), default=0.0)


def _least(*limits: float | None) -> float | None:
    """Return the lowest limit; None without one."""
    return min((limit for limit in limits if limit is not None), default=None)


class OrderMessage(msgspec.Struct, frozen=True, rename="camel"):
    """A route of nodes and edges, or an update of the current one."""

    header_id: Count
    timestamp: Text
    version: Text
    manufacturer: Text
    serial_number: Text
    order_id: Id
    order_update_id: Count
    nodes: Annotated[tuple[Node, ...], msgspec.Meta(min_length=1, max_length=NODES_MAX)]
    edges: Annotated[tuple[Edge, ...], msgspec.Meta(max_length=NODES_MAX)]
    zone_set_id: Text = ""

    @property
    def parts(self) -> tuple[OrderPart, ...]:
        """All nodes and edges."""
        return (*self.nodes, *self.edges)


class InstantActions(msgspec.Struct, frozen=True, rename="camel"):
    """Actions to execute at once.

    Their list has two names: 2.1 and 3.0 call it ``actions``; schemas before them, and clients made from those
    (vda-5050-lib is one), ``instantActions``.
    """

    header_id: Count
    timestamp: Text
    version: Text
    manufacturer: Text
    serial_number: Text
    listed: Actions | msgspec.UnsetType = msgspec.field(name="actions", default=msgspec.UNSET)
    instant_actions: Actions | msgspec.UnsetType = msgspec.UNSET

    def __post_init__(self) -> None:
        if self.listed is msgspec.UNSET and self.instant_actions is msgspec.UNSET:
            raise ValueError("actions is missing")

    @property
    def actions(self) -> Actions:
        """All actions, under either name."""
        return (*(self.listed or ()), *(self.instant_actions or ()))


M = TypeVar("M", OrderMessage, InstantActions)


def read(data: bytes, kind: type[M]) -> M:
    """Return the message. Raises Malformed."""
    if len(data) > MESSAGE_MAX:
        raise Malformed(f"the message has more than {MESSAGE_MAX} bytes")
    try:
        message = msgspec.json.decode(data, type=kind)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError) as error:
        raise Malformed(why_invalid(error, "the message", wanted=kind)) from None
    if isinstance(message, OrderMessage):
        _check_graph(message)
    _check_ids(message)
    return message


def _check_graph(order: OrderMessage) -> None:
    """Raise Malformed unless nodes and edges alternate, with consecutive numbers and the released ones first."""
    nodes, edges = order.nodes, order.edges
    if len(edges) != len(nodes) - 1:
        raise Malformed(f"{len(nodes)} nodes need {len(nodes) - 1} edges, not {len(edges)}")
    first = nodes[0].sequence_id
    if first % 2:
        raise Malformed(f"nodes have even sequenceIds, not {first}")
    for index, node in enumerate(nodes):
        if node.sequence_id != first + 2 * index:
            raise Malformed(f"node {node.node_id} has sequenceId {node.sequence_id}, not {first + 2 * index}")
    for index, edge in enumerate(edges):
        _check_edge(edge, nodes[index], nodes[index + 1])
    if not nodes[0].released:
        raise Malformed(f"node {nodes[0].node_id} is the first and not released")
    if any(after.released and not before.released for before, after in pairwise(nodes)):
        raise Malformed("a released node follows one that is not released")


def _check_edge(edge: Edge, start: Node, end: Node) -> None:
    if edge.sequence_id != start.sequence_id + 1:
        raise Malformed(f"edge {edge.edge_id} has sequenceId {edge.sequence_id}, not {start.sequence_id + 1}")
    if edge.released is not end.released:
        raise Malformed(f"edge {edge.edge_id} and node {end.node_id}: one is released, the other not")
    for said, node in ((edge.start_node_id, start), (edge.end_node_id, end)):
        if said is not None and said != node.node_id:
            raise Malformed(f"edge {edge.edge_id} names node {said} where {node.node_id} is")


def _check_ids(message: OrderMessage | InstantActions) -> None:
    """Raise Malformed for a repeated actionId."""
    parts: Iterable[OrderPart | InstantActions] = message.parts if isinstance(message, OrderMessage) else (message,)
    ids = [action.action_id for part in parts for action in part.actions]
    if len(ids) != len(set(ids)):
        raise Malformed("an actionId comes twice")
