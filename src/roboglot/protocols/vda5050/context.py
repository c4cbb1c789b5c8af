"""State of this door for one robot: its order, actions and errors; takes messages, and has orders driven.

Reports facts only: a node is passed when navigation reports that the robot was there, an action is finished when it
has ended.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from roboglot.model.admission import Forbidden, Right
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import NotReady
from roboglot.model.events import JackChanged
from roboglot.model.geometry import Point
from roboglot.model.robot import Robot
from roboglot.protocols.vda5050.error_book import ErrorBook
from roboglot.protocols.vda5050.errors import Ignored, Rejected
from roboglot.protocols.vda5050.hibernation import Hibernation
from roboglot.protocols.vda5050.maps import Maps
from roboglot.protocols.vda5050.order_book import ActionState, ActionStatus, OrderBook, forget_oldest
from roboglot.protocols.vda5050.order_check import check_order
from roboglot.protocols.vda5050.performing import Performer
from roboglot.protocols.vda5050.route import Route
from roboglot.protocols.vda5050.table import INSTANT, PROMPT, operation_of
from roboglot.protocols.vda5050.vocabulary import DOOR, is_loaded
from roboglot.wire.vda5050.orders import Edge, InstantActions, Malformed, Node, OrderMessage, read
from roboglot.wire.vda5050.versions import ErrorKind, Level, Version

SOURCE = DOOR
UNDER_WAY_MAX = 128  # instant actions, which each state lists; two messages may have so many
START_REACH = 0.5  # m from an order's first node that count as being there


class Context:
    """Context of every handler: one robot and its fleet control."""

    def __init__(
        self, robot: Robot, version: Version, map_id: str, send_factsheet: Callable[[], Awaitable[None]]
    ) -> None:
        self.robot, self.version = robot, version
        self.maps = Maps(robot, map_id)
        self.send_factsheet = send_factsheet
        self.book = OrderBook(measure=self._metres)
        self.instant: dict[str, ActionState] = {}
        self.paused = False
        self.hibernation = Hibernation(robot, self.touch)
        self.leaving = False  # the robot is switching off: the door disconnects from the broker
        self.load: dict[str, str] = {}  # fleet control's description of the picked load
        self.changed = asyncio.Event()
        self.errors = ErrorBook(robot, version, self.changed)
        self._forget_load = robot.events.listen(JackChanged, self._jack_changed)
        self._trigger = asyncio.Event()
        self._tasks: set[asyncio.Future[None]] = set()
        self._route = Route(self)
        self.performer = Performer(self)

    @property
    def map_id(self) -> str:
        """Id (mapId) of the map in use."""
        return self.maps.in_use

    def _metres(self) -> float:
        return self.robot[Odometry].reading.distance if Odometry in self.robot else 0.0

    def _jack_changed(self, _: JackChanged) -> None:
        if not is_loaded(self.robot):  # the next load is another, whichever door set this one down
            self.load = {}

    def touch(self) -> None:
        """Schedule a state message."""
        self.changed.set()

    def check(self, operation: str, right: Right | None) -> None:
        """Raise Rejected unless fleet control has the right, and the robot is up."""
        try:
            self.robot.admission.check(DOOR, operation, right)
            self.robot.starts.check(right)
        except Forbidden as refused:
            raise Rejected(ErrorKind.FORBIDDEN, str(refused)) from None
        except NotReady as down:
            raise Rejected(ErrorKind.NOT_AVAILABLE, str(down)) from None

    def take_order(self, payload: bytes) -> None:
        """Take an order or an update and drive it. Raises Rejected, Ignored."""
        if self.hibernation.on:
            raise Ignored("the robot hibernates")
        order = self._read(payload, OrderMessage)
        check_order(order, self.robot, self.version, self.map_id)
        new = order.order_id != self.book.order_id
        if not self.book.take(order, self.near):
            return
        self.errors.forget_order()
        if new:
            self._trigger.clear()
            self.book.pass_node(order.nodes[0])
            self._route.begin(order.nodes[0])
        else:
            self._route.go_on()
        self.touch()

    def near(self, node: Node) -> bool:
        """Return True if the robot is within the allowed deviation of ``node``."""
        place = node.node_position
        if place is None or Localization not in self.robot:
            return False
        pose = self.robot[Localization].pose
        return bool(pose.point.distance_to(_point(node)) <= max(START_REACH, place.reach))

    def take_instant_actions(self, payload: bytes) -> None:
        """Begin each of the actions; those that cannot begin are FAILED, with an error. Raises Rejected, Ignored."""
        message = self._read(payload, InstantActions)
        self.errors.forget_kind(ErrorKind.INSTANT_ACTION)
        ignored: list[str] = []
        for action in message.actions:
            if action.action_id in self.instant:
                continue  # already known
            if self.hibernation.on and action.action_type != "stopHibernation":
                ignored.append(action.action_type)
                continue
            state = self.instant[action.action_id] = ActionState(action)
            forget_oldest(self.instant)
            if action.action_type not in PROMPT and self._under_way > UNDER_WAY_MAX:
                self._fail_instantly(state, f"at most {UNDER_WAY_MAX} instant actions are under way")
            else:
                self.run_beside(self._do_instantly(state))
        if ignored:
            raise Ignored(f"the robot hibernates: {', '.join(ignored)}")

    @property
    def _under_way(self) -> int:
        return sum(not state.status.ended for state in self.instant.values())

    def run_beside(self, work: Awaitable[None]) -> asyncio.Future[None]:
        """Run ``work`` until it ends or the door closes."""
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    def _read(self, payload: bytes, kind: type[Any]) -> Any:
        try:
            message = read(payload, kind)
        except Malformed as malformed:
            raise Rejected(ErrorKind.MALFORMED, str(malformed)) from None
        if message.version.partition(".")[0] != self.version.number.partition(".")[0]:
            why = f"the message is of version {message.version}, this robot speaks {self.version.number}"
            raise Rejected(ErrorKind.MALFORMED, why, {"version": message.version})
        return message

    async def _do_instantly(self, state: ActionState) -> None:
        name = state.action.action_type
        operation = operation_of(name, self.version.level) if name in INSTANT else None
        if operation is None:
            self._fail_instantly(state, f"this robot has no instant action {name}")
        else:
            await self.performer.perform(state, operation, instant=True)

    def _fail_instantly(self, state: ActionState, why: str) -> None:
        """Have an instant action fail that cannot begin."""
        state.status, state.result = ActionStatus.FAILED, why
        self.errors.report(
            ErrorKind.INSTANT_ACTION, Level.WARNING, why, {"actionId": state.action.action_id}, order=False
        )

    def speed_ratio(self, edge: Edge | None) -> float:
        """Return the share of the robot's top speed that an edge allows."""
        if edge is None or edge.speed is None or Base not in self.robot:
            return 1.0
        top = self.robot[Base].limits.twist.x
        return min(1.0, edge.speed / top) if top > 0 else 1.0

    @property
    def needs_base(self) -> bool:
        """Return True if the robot is at, or drives to, the last released node of an order with a horizon."""
        nodes = self.book.nodes
        return bool(nodes) and sum(node.released for node in nodes) <= 1 and not nodes[-1].released

    def pause(self, on: bool) -> None:
        """Pause or continue all motion. Raises Refused if the robot moves in a way that cannot be paused."""
        self._route.pause(on)
        self.performer.pause(on)
        self.paused = on
        self.touch()

    async def cancel_order(self, order_id: str) -> None:
        """Stop and drop the rest of the order; returns when the robot stands. Raises Rejected if nothing is left."""
        if self.book.idle or self.book.canceling or order_id not in ("", self.book.order_id):
            raise Rejected(ErrorKind.NO_ORDER, "there is no such order to cancel")
        await self.clear_order()

    async def clear_order(self) -> None:
        """Stop the robot, and drop the rest of the order."""
        self.book.canceling = True
        try:
            await self._route.stop()
            self.book.drop_rest()
        finally:
            self.book.canceling = False
        self.errors.forget_order()
        self.pause(False)

    def clear_instant_actions(self) -> None:
        """Remove ended instant actions."""
        self.instant = {key: state for key, state in self.instant.items() if not state.status.ended}

    def release_trigger(self) -> None:
        """Resume the action that waits for the trigger. Raises Rejected if none does."""
        waiting = [
            state
            for state in self.book.actions.values()
            if state.action.action_type == "waitForTrigger" and state.status is ActionStatus.RUNNING
        ]
        if not waiting:
            raise Rejected(ErrorKind.INSTANT_ACTION, "no action waits for a trigger")
        self._trigger.set()

    async def wait_for_trigger(self) -> None:
        """Wait for the trigger and consume it."""
        self._trigger.clear()
        await self._trigger.wait()

    async def close(self) -> None:
        """Stop everything that fleet control began."""
        self._forget_load()
        await self._route.stop()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)


def _point(node: Node) -> Point:
    assert node.node_position is not None
    return Point(node.node_position.x, node.node_position.y)
