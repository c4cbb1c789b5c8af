"""The robot's order: rules for accepting messages, remaining nodes and edges, states of actions.

Follows chapter 6.1 of the standard. Knows no robot and no clock: the driving code reports reached nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import field
from enum import StrEnum

from roboglot.protocols.vda5050.errors import Rejected
from roboglot.values import dataclass
from roboglot.wire.vda5050.orders import NODES_MAX, Action, Edge, Node, OrderMessage, OrderPart
from roboglot.wire.vda5050.versions import ErrorKind

ACTIONS_KEPT_MAX = 1000  # action states; the oldest finished ones are dropped first


class ActionStatus(StrEnum):
    """Status of an action."""

    WAITING = "WAITING"
    INITIALIZING = "INITIALIZING"
    RUNNING = "RUNNING"
    PAUSED = "PAUSED"
    RETRIABLE = "RETRIABLE"  # 3.0: failed, waiting for retry or skipRetry
    FINISHED = "FINISHED"
    FAILED = "FAILED"

    @property
    def ended(self) -> bool:
        """True if the action has ended."""
        return self in (ActionStatus.FINISHED, ActionStatus.FAILED)


@dataclass(slots=True)
class ActionState:
    """State of one action."""

    action: Action
    status: ActionStatus = ActionStatus.WAITING
    result: str = ""


def forget_oldest(states: dict[str, ActionState]) -> None:
    """Drop the oldest actions that have ended, beyond ACTIONS_KEPT_MAX of all."""
    for key in [key for key, state in states.items() if state.status.ended][: max(0, len(states) - ACTIONS_KEPT_MAX)]:
        del states[key]


@dataclass(slots=True)
class OrderBook:
    """``nodes`` and ``edges`` have yet to be passed; the first node is passed when the order is taken."""

    order_id: str = ""
    update_id: int = 0
    nodes: list[Node] = field(default_factory=list)
    edges: list[Edge] = field(default_factory=list)
    actions: dict[str, ActionState] = field(default_factory=dict)
    last_node: str = ""
    last_sequence: int = 0
    decision: Node | None = None  # the last released node in all messages so far
    cancelled: bool = False
    canceling: bool = False
    last: OrderMessage | None = None
    measure: Callable[[], float] = lambda: 0.0  # returns the robot's total distance in m
    placed_at: float | None = None  # that distance at the last node

    @property
    def idle(self) -> bool:
        """True if there is nothing left to pass, no horizon, and no action under way."""
        return not self.nodes and all(state.status.ended for state in self.actions.values())

    @property
    def base(self) -> Iterator[tuple[Edge | None, Node]]:
        """Yield the released nodes that are left, each with the edge that leads there."""
        edges = {edge.sequence_id: edge for edge in self.edges}
        for node in self.nodes:
            if node.released:
                yield edges.get(node.sequence_id - 1), node

    def take(self, order: OrderMessage, near: Callable[[Node], bool]) -> bool:
        """Accept an order or an update; False if it is the current one. Raises Rejected, and then changes nothing."""
        known = {"orderId": order.order_id, "orderUpdateId": order.order_update_id}
        if order.order_id != self.order_id:
            self._check_new(order, near, known)
            self.actions.clear()
            self.order_id, self.cancelled = order.order_id, False
            self.nodes, self.edges = [], []
            self.last_node, self.last_sequence, self.placed_at = "", 0, None
            self._extend(order, order.nodes)
        else:
            if order.order_update_id == self.update_id and self.last is not None:
                if (order.nodes, order.edges) == (self.last.nodes, self.last.edges):
                    return False
                raise Rejected(ErrorKind.SAME_UPDATE, "another order has the same orderUpdateId", known)
            self._check_update(order, known)
            self._drop_horizon()
            self._extend(order, order.nodes[1:])
        self.update_id, self.last = order.order_update_id, order
        return True

    def _check_new(self, order: OrderMessage, near: Callable[[Node], bool], known: dict[str, object]) -> None:
        if not self.idle or self.canceling:
            raise Rejected(ErrorKind.OTHER_ORDER, f"order {self.order_id} is not finished", known)
        if not near(order.nodes[0]):
            first = order.nodes[0].node_id
            raise Rejected(
                ErrorKind.START_TOO_FAR, f"node {first} is too far from the robot", {**known, "nodeId": first}
            )

    def _check_update(self, order: OrderMessage, known: dict[str, object]) -> None:
        if order.order_update_id < self.update_id:
            raise Rejected(ErrorKind.OUTDATED, f"update {self.update_id} was accepted already", known)
        if self.cancelled or self.canceling:
            raise Rejected(ErrorKind.AFTER_CANCEL, f"order {self.order_id} was cancelled", known)
        first, decision = order.nodes[0], self.decision
        if decision is None or (first.node_id, first.sequence_id) != (decision.node_id, decision.sequence_id):
            where = f"{decision.node_id} ({decision.sequence_id})" if decision else "no node"
            raise Rejected(
                ErrorKind.NOT_A_CONTINUATION, f"the update must begin with {where}", {**known, "nodeId": first.node_id}
            )
        if sum(node.released for node in self.nodes) + len(order.nodes) - 1 > NODES_MAX:
            raise Rejected(ErrorKind.NOT_A_CONTINUATION, f"an order has at most {NODES_MAX} nodes left", known)
        new = {action.action_id for part in order.parts if part is not first for action in part.actions}
        if reused := sorted(new & (self.actions.keys() - self._horizon())):
            raise Rejected(
                ErrorKind.NOT_A_CONTINUATION, "an actionId was used before", {**known, "actionId": reused[0]}
            )

    def _extend(self, order: OrderMessage, nodes: tuple[Node, ...]) -> None:
        self.nodes += nodes
        self.edges += order.edges
        parts: tuple[OrderPart, ...] = (*nodes, *order.edges)
        for part in parts:
            for action in part.actions:
                self.actions[action.action_id] = ActionState(action)
        forget_oldest(self.actions)
        released = [node for node in order.nodes if node.released]
        self.decision = released[-1]

    def _drop_horizon(self) -> None:
        for key in self._horizon():
            self.actions.pop(key, None)
        self.nodes = [node for node in self.nodes if node.released]
        self.edges = [edge for edge in self.edges if edge.released]

    def _horizon(self) -> set[str]:
        """Return the ids of the actions that are not released."""
        parts: tuple[OrderPart, ...] = (*self.nodes, *self.edges)
        return {action.action_id for part in parts if not part.released for action in part.actions}

    def pass_node(self, node: Node) -> None:
        """Note that the robot is at ``node`` and has passed all nodes before it."""
        self.nodes = [left for left in self.nodes if left.sequence_id > node.sequence_id]
        self.edges = [left for left in self.edges if left.sequence_id > node.sequence_id]
        self.place_at(node.node_id, node.sequence_id)

    def place_at(self, node_id: str, sequence_id: int) -> None:
        """Note that the robot is at that node."""
        self.last_node, self.last_sequence, self.placed_at = node_id, sequence_id, self.measure()

    @property
    def way_since_node(self) -> float | None:
        """Distance driven since the last node (m); None before the first node."""
        return None if self.placed_at is None else self.measure() - self.placed_at

    def drop_rest(self) -> None:
        """Drop the rest of the order for cancelOrder; waiting actions fail."""
        self.nodes, self.edges, self.cancelled = [], [], True
        for state in self.actions.values():
            if not state.status.ended:
                state.status, state.result = ActionStatus.FAILED, "the order was cancelled"
