"""Drive along the base of an order: from node to node by the robot's navigation, with the actions at the nodes."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import field
from typing import Protocol

from roboglot.model.actions import Action as RobotAction
from roboglot.model.actions import ActionStatus as Goal
from roboglot.model.admission import Right
from roboglot.model.components.motion.navigation import Navigation, NavigationFeedback, NavigationOptions
from roboglot.model.errors import RobotError
from roboglot.model.events import ActionChanged
from roboglot.model.geometry import Point
from roboglot.protocols.vda5050.errors import Rejected, kind_of
from roboglot.protocols.vda5050.order_book import ActionStatus, OrderBook
from roboglot.protocols.vda5050.performing import Performer, Performing
from roboglot.protocols.vda5050.table import operation_of
from roboglot.values import dataclass
from roboglot.wire.vda5050.orders import Action, Edge, Node
from roboglot.wire.vda5050.versions import ErrorKind, Level

log = logging.getLogger(__name__)
TOLERANCE = 0.05  # m: tolerance where the order allows no deviation
LEG_MAX = 100  # nodes; no robot's navigation takes fewer goals at once
STANDS = ("SOFT", "HARD")  # blocking types of actions that require standstill
ALONE = ("SINGLE", "HARD")  # blocking types of actions that exclude all others


@dataclass(slots=True)
class Leg:
    """Nodes that are driven through without a stop."""

    nodes: list[Node] = field(default_factory=list)
    speed: float = 1.0

    @property
    def options(self) -> NavigationOptions:
        """Navigation options: the last node's heading, the narrowest deviation."""
        places = [node.node_position for node in self.nodes]
        reach = min(place.reach for place in places if place is not None)
        last = places[-1]
        yaw = last.theta if last is not None else None
        return NavigationOptions(yaw=yaw, speed_ratio=self.speed, tolerance=max(TOLERANCE, reach))

    @property
    def points(self) -> list[Point]:
        """Positions of the nodes."""
        return [Point(node.node_position.x, node.node_position.y) for node in self.nodes if node.node_position]


class Driven(Performing, Protocol):
    """The context that a route belongs to."""

    book: OrderBook
    performer: Performer
    paused: bool

    def speed_ratio(self, edge: Edge | None) -> float:
        """Return the share of the top speed to drive an edge with."""


class Route:
    """Current drive of the robot for one context."""

    def __init__(self, context: Driven) -> None:
        self._context = context
        self._task: asyncio.Task[None] | None = None
        self._beside: set[asyncio.Task[None]] = set()
        self._driving: RobotAction | None = None
        self._more = asyncio.Event()

    def begin(self, first: Node) -> None:
        """Drive a new order, which begins at the robot's place."""
        self._more.clear()
        self._task = asyncio.get_running_loop().create_task(self._guarded(first))

    def go_on(self) -> None:
        """Continue with an extended order."""
        self._more.set()
        if self._task is None or self._task.done():
            self._task = asyncio.get_running_loop().create_task(self._guarded(None))

    def pause(self, on: bool) -> None:
        """Pause in place, or continue. Raises Refused."""
        if not on:
            self._more.set()
        if self._driving is not None:
            if on:
                self._driving.pause()
            else:
                self._driving.resume()

    async def stop(self) -> None:
        """End the drive; returns when the robot stands."""
        doomed = [task for task in (self._task, *self._beside) if task is not None and not task.done()]
        for task in doomed:
            task.cancel()
        await asyncio.gather(*doomed, return_exceptions=True)
        if (driving := self._driving) is not None:
            driving.cancel("fleet control cancelled the order")
            await driving.done()
        self._task = self._driving = None

    async def _guarded(self, first: Node | None) -> None:
        """Drive, and report an unexpected error: an order must not stop silently."""
        try:
            await self._run(first)
        except Exception as error:
            context = self._context
            log.exception("robot %s: driving order %s crashed", context.robot.id, context.book.order_id)
            references = {"orderId": context.book.order_id}
            context.errors.report(
                ErrorKind.UNREACHABLE, Level.CRITICAL, f"internal error while driving: {error}", references
            )

    async def _run(self, first: Node | None) -> None:
        """Do the first node's actions, then leg after leg until nothing released is left."""
        if first is not None:
            await self._act(first.actions)
        while True:
            self._more.clear()
            if self._context.paused:
                await self._more.wait()
                continue
            leg = self._next_leg()
            if leg is None:
                break
            if not await self._drive(leg):
                return
            await self._act(leg.nodes[-1].actions)
        self._context.touch()

    def _next_leg(self) -> Leg | None:
        """Return the nodes up to the next one with actions, a heading or another speed, LEG_MAX at most."""
        leg = Leg()
        for edge, node in self._context.book.base:
            speed = self._context.speed_ratio(edge)
            if leg.nodes and (speed != leg.speed or len(leg.nodes) == LEG_MAX):
                break
            leg.nodes.append(node)
            leg.speed = speed
            if node.actions or (node.node_position and node.node_position.theta is not None):
                break
        return leg if leg.nodes else None

    async def _drive(self, leg: Leg) -> bool:
        """Drive the leg and pass its nodes; False, with an error, if the order cannot go on."""
        context = self._context
        try:
            context.check("order", Right.DRIVE)
            action = context.robot[Navigation].navigate_to(leg.points, leg.options, source="vda5050")
        except Rejected as rejected:
            context.errors.refuse(rejected)
            return False
        except RobotError as error:
            self._give_up(leg.nodes[0], error)
            return False
        self._driving = action
        passed = 0
        try:
            with context.robot.events.subscribe(ActionChanged) as changes:
                while not action.status.ended:
                    passed = self._pass(leg, passed, _reached(action, len(leg.nodes)))
                    await changes.next()
        finally:
            if not action.status.ended:
                action.cancel("fleet control cancelled the order")
                await action.done()
            self._driving = None
        if action.status is Goal.SUCCEEDED:
            self._pass(leg, passed, len(leg.nodes))
            return True
        at = leg.nodes[min(passed, len(leg.nodes) - 1)]
        self._give_up(at, action.error or RobotError("something else moved the robot"))
        return False

    def _pass(self, leg: Leg, before: int, now: int) -> int:
        for node in leg.nodes[before:now]:
            self._context.book.pass_node(node)
            self._context.touch()
        return max(before, now)

    def _give_up(self, node: Node, error: RobotError) -> None:
        """Report that the order cannot go on; it is kept until fleet control cancels it."""
        book = self._context.book
        references = {"orderId": book.order_id, "orderUpdateId": str(book.update_id), "nodeId": node.node_id}
        self._context.errors.report(kind_of(error), Level.CRITICAL, str(error), references)

    async def _act(self, actions: tuple[Action, ...]) -> None:
        """Do the actions of a node in order; returns when the robot may drive on."""
        parallel: list[tuple[Action, asyncio.Task[None]]] = []
        for action in actions:
            if action.blocking_type in ALONE:
                await asyncio.gather(*(task for _, task in parallel))
                parallel.clear()
            task = asyncio.get_running_loop().create_task(self._perform(action))
            self._beside.add(task)
            task.add_done_callback(self._beside.discard)
            if action.blocking_type in ALONE:
                await task
            else:
                parallel.append((action, task))
        await asyncio.gather(*(task for action, task in parallel if action.blocking_type in STANDS))

    async def _perform(self, action: Action) -> None:
        state = self._context.book.actions.get(action.action_id)
        operation = operation_of(action.action_type, self._context.version.level)
        if state is None or state.status is not ActionStatus.WAITING:
            return
        if operation is None:
            self._context.errors.report(ErrorKind.ORDER_ACTION, Level.WARNING, f"there is no {action.action_type}")
            return
        await self._context.performer.perform(state, operation)


def _reached(action: RobotAction, count: int) -> int:
    """Return how many of ``count`` goals the navigation has passed."""
    feedback = action.feedback
    return count - len(feedback.milestones) if isinstance(feedback, NavigationFeedback) else 0
