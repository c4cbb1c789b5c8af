"""Riding the lift, and one map, dock and set of annotations per floor.

Those of other floors are kept on disk, too, and are restored after a restart when the robot gets there.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
from contextlib import ExitStack
from functools import partial

import numpy as np

from roboglot.autonomy.building.floor_storage import FloorStorage, Storey
from roboglot.autonomy.building.lift_queue import Turn, turn
from roboglot.autonomy.navigation.base_actions import PERIOD, stand_still, start_on_base
from roboglot.autonomy.navigation.context import Goal, NavigationContext
from roboglot.autonomy.navigation.navigation import GridNavigation
from roboglot.autonomy.slam.scan_points import ScanReader, sees
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.logistics.lift_client import LiftClient, LiftDoor
from roboglot.model.components.mapping.annotations import Annotations, MapAnnotations
from roboglot.model.components.mapping.floors import Floors, RideStage
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import exchange, settle
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.navigation import NavigationOptions
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.errors import Blocked, Expired, InvalidGoal, Refused, RobotError
from roboglot.model.events import FloorReached, MapReplaced, PoseJumped
from roboglot.model.geometry import STILL, Pose, Twist, bounded, wrap_angle
from roboglot.model.robot import Robot

COMES_MAX = 180.0  # s to wait for the lift
DOOR_HELD = 30.0  # s for which the door is held open at a time
SPEED, TURN_RATE = 0.3, 0.5  # m/s, rad/s through the door
GAIN, TURN_GAIN = 1.5, 2.0  # 1/s
LEAN, LEAN_MAX = 1.5, 0.3  # rad per m of offset from the straight line
THERE = 0.03  # m
ROOM = 0.08  # m that must stay free in front of the hull
PATIENCE = 20.0  # s without progress through the door
MOUTH = 1.5  # m in front of the waiting place that robots in a queue leave free …
BESIDE, LINE = 0.3, 0.2  # m … between two hulls, and m between its points
LOOKS = 1.0  # s until some scans have shown what stands around
TRIP_MAX = 10.0  # m between the waiting place and the car
STAY_PERIOD = 0.5  # s between two looks at a car in which the ride was given up


class LiftFloors(Floors):
    """Floors reached by lift: straight through the door by the lidar, without mapping in the car."""

    def __init__(self, robot: Robot, context: NavigationContext, navigation: GridNavigation) -> None:
        self.robot, self.belief, self.navigation = robot, context.belief, navigation
        self._context = context
        self._others = FloorStorage(robot)
        self._current = 0
        self._changing = asyncio.Lock()  # one exchange of floors at a time
        self._places: tuple[Pose, Pose] | None = None  # the waiting place, and the place inside the car
        self._stay: asyncio.Task[None] | None = None  # in the car, after a ride that was given up there …
        self._maps_outside = False  # … and that the robot mapped before
        self._closed = False
        self._redraws = False  # whether the last exchange of floors exchanged the annotations, too
        self._exchanging: asyncio.Task[None] | None = None  # the last one of a ride
        robot.events.listen(MapReplaced, self._replaced)

    @property
    def current(self) -> int:
        return self._current

    def begin_on(self, floor: int) -> None:
        self._check(floor)
        if self._stay is None:  # else the car decides
            self._current = floor

    async def be_carried(self, floor: int) -> None:
        self._check(floor)
        belief, mapped = self.belief, self._end_stay()
        belief.mapping = False
        try:
            with exchange(self.robot):
                if self._exchanging is not None:
                    await asyncio.wait([self._exchanging])
                async with self._changing:
                    now = self.robot.clock.time()
                    if floor != self._current:
                        await self._restore(floor, self._redraws, carried=True)
                        self.robot.events.publish(FloorReached(stamp=now, floor=floor, place=None))
                    elif self._places is not None and self._is_aboard:  # else it would believe to ride on
                        home = self.robot[Docking].home if Docking in self.robot else None
                        belief.take_pose(home or self._places[0])
                        self.robot.events.publish(PoseJumped(stamp=now, pose=belief.pose, given=True))
        finally:
            belief.mapping = mapped

    def set_lift(self, waiting: Pose, inside: Pose) -> None:
        numbers = (waiting.x, waiting.y, waiting.yaw, inside.x, inside.y, inside.yaw)
        if not all(map(math.isfinite, numbers)) or not 0.1 < waiting.distance_to(inside) < TRIP_MAX:
            raise InvalidGoal(f"not places in front of and in a lift: {waiting}, {inside}")
        yaw = waiting.point.bearing_to(inside)
        self._places = Pose(waiting.x, waiting.y, yaw), Pose(inside.x, inside.y, yaw)

    def _replaced(self, event: MapReplaced) -> None:
        """Keep the lift's places in the world when the map's origin moves."""
        if self._places is not None and event.origin is not None:
            waiting, inside = self._places
            self._places = waiting.relative_to(event.origin), inside.relative_to(event.origin)

    def ride(self, floor: int, *, redraw: bool = True, source: str = "") -> Action:
        self._check(floor)
        if self._places is None:
            raise InvalidGoal("the lift's place on this map is unknown")

        async def run(action: Action) -> None:
            await self._ride(action, floor, redraw)

        return start_on_base(self.robot, "ride the lift", run, goal=floor, source=source)

    def _check(self, floor: int) -> None:
        if not 0 <= floor < len(self.robot[LiftClient].floors):
            raise InvalidGoal(f"there is no floor {floor}")

    async def _ride(self, action: Action, floor: int, redraw: bool) -> None:
        if self._places is None:
            return
        aboard = self._is_aboard  # still there from the last try
        if aboard or floor != self._current:
            if not aboard:
                action.report(RideStage.APPROACHING)
            async with turn(self.robot, partial(self._make_way, action), aboard=aboard) as mine:
                await self._go(action, floor, redraw, mine)

    @property
    def _is_aboard(self) -> bool:
        assert self._places is not None
        waiting, inside = self._places
        return self.belief.pose.distance_to(inside) < waiting.distance_to(inside) / 2

    async def _make_way(self, action: Action) -> None:
        """Leave the way between the car and the floor in front of it, if the robot is in it and there is room."""
        assert self._places is not None
        waiting, inside = self._places
        reach = 2.0 * self.robot.description.radius + BESIDE
        steps = np.arange(0.0, waiting.distance_to(inside) + MOUTH, LINE)[:, None]
        out = np.array((-math.cos(inside.yaw), -math.sin(inside.yaw)))
        line = np.array((inside.x, inside.y)) + steps * out
        here = self.belief.pose
        if float(np.hypot(*(line - (here.x, here.y)).T).min()) > reach:
            return
        await self.robot.clock.sleep(LOOKS)  # on a floor that it does not know, it has no map yet
        planner, scan = await self._context.ready(), self.robot[Lidar].scan
        if scan is not None:  # it has not looked out for others since it got in
            planner.observe(self.belief.reader.read(scan), self.belief.pose, self.robot.clock.time())
        place = await self._context.waiting_place(here.point, [(line, reach)])
        if place is not None:
            with contextlib.suppress(RobotError):  # it is for others: the ride does not depend on it
                await self.navigation.drive(action, Goal((place,), NavigationOptions(tolerance=0.2)))

    async def _go(self, action: Action, floor: int, redraw: bool, mine: Turn) -> None:
        """Ride to ``floor`` from the floor here, or from the car. Raises what its steps do."""
        assert self._places is not None
        lift, belief = self.robot[LiftClient], self.belief
        while not mine.aboard:
            waiting, _ = self._places
            action.report(RideStage.APPROACHING)
            await self.navigation.drive(action, Goal((waiting.point,), NavigationOptions(yaw=waiting.yaw)))
            action.report(RideStage.CALLING)
            await self._comes(self._current)
            await mine.may_board()
        stay, mapped, start = self._stay, self._end_stay(), self._current
        belief.mapping = False  # doors open and close, and the car belongs to no floor
        try:
            if stay is not None:
                await asyncio.wait([stay])  # it may be changing floors
                await self._follow_car(redraw)
            action.report(RideStage.BOARDING)
            await self._through(backwards=False)
            lift.close_door()
            action.report(RideStage.RIDING)
            await self._comes(floor)
            if floor != self._current:
                await self._change_to(floor, redraw)
            await settle(self.robot)  # a store of the building's maps may have a better one
            action.report(RideStage.LEAVING)
            await self._through(backwards=True)
        except BaseException as error:
            closing = isinstance(error, asyncio.CancelledError) and action.status is not ActionStatus.CANCELING
            if not closing and (self._is_aboard or self._current != start):
                self._maps_outside, mapped = mapped, False
                self._begin_stay(redraw)
            raise
        finally:
            belief.mapping = mapped
        with contextlib.suppress(Refused):  # the robot is where it wanted to be, and a door closes by itself
            lift.close_door()
        action.report(RideStage.ARRIVED)

    def close(self) -> None:
        """End a stay in the car, and begin no more: the program ends."""
        self._closed = True
        self._end_stay()

    def _begin_stay(self, redraw: bool) -> None:
        if self._closed:
            return
        arrival = ExitStack()
        arrival.enter_context(exchange(self.robot))  # at once, before another action begins
        stay = self._stay_aboard(redraw, arrival)
        self._stay = asyncio.get_running_loop().create_task(stay, name=f"{self.robot.id} is in the lift")
        self._stay.add_done_callback(lambda _: arrival.close())

    async def _stay_aboard(self, redraw: bool, arrival: ExitStack) -> None:
        """Change floors with a car in which a ride was given up, until the robot is outside.

        Others wait for the map until the car was looked at once, which ends ``arrival``.
        """
        while True:
            await self._follow_car(redraw)
            arrival.close()
            if not self._is_aboard:
                break
            await self.robot.clock.sleep(STAY_PERIOD)
        self.belief.mapping = self._end_stay()

    async def _follow_car(self, redraw: bool) -> None:
        """Change to the floor at which the car stands, if the robot is in it."""
        with contextlib.suppress(Refused):  # out of reach
            state = self.robot[LiftClient].state
            if self._is_aboard and state.target is None and state.floor != self._current:
                await self._change_to(state.floor, redraw)

    def _end_stay(self) -> bool:
        """End a stay in the car; return whether the robot maps outside."""
        if self._stay is not None and self._stay is not asyncio.current_task():
            self._stay.cancel()
        maps = self.belief.mapping or self._maps_outside
        self._stay, self._maps_outside = None, False
        return maps

    async def _comes(self, floor: int) -> None:
        """Call the lift, or ride, to ``floor``; return when its door is open there. Raises Refused, Expired."""
        lift, clock = self.robot[LiftClient], self.robot.clock
        lift.call(floor)
        deadline = clock.time() + COMES_MAX
        while True:
            state = lift.state
            if state.floor == floor and state.target is None and state.door is LiftDoor.OPEN:
                return
            if not state.in_service:
                raise Refused("the lift is out of service")
            if clock.time() > deadline:
                raise Expired(f"the lift did not come to floor {floor} within {COMES_MAX:g} s")
            await clock.sleep(0.2)

    async def _through(self, *, backwards: bool) -> None:
        """Drive straight into the car, or ``backwards`` to the waiting place, holding the door. Raises Blocked."""
        robot, base, clock = self.robot, self.robot[Base], self.robot.clock
        way, held_until = (-1.0 if backwards else 1.0), -math.inf
        closest, closest_at = math.inf, clock.time()
        while True:
            assert self._places is not None
            waiting, inside = self._places  # the map's origin may move
            now, seen = clock.time(), robot[Localization].pose.relative_to(waiting if backwards else inside)
            left = -seen.x * way
            if left <= THERE:
                break
            if left < closest - THERE:
                closest, closest_at = left, now
            if now - closest_at > PATIENCE:
                raise Blocked("a person stands in the lift's door" if _sees(self.robot, way) else "the lidar is silent")
            if now > held_until - DOOR_HELD / 2:
                self._hold_door(needed=not backwards or self._is_aboard)
                held_until = now + DOOR_HELD
            if backwards and self._is_aboard and robot[LiftClient].state.floor != self._current:
                raise Refused("the lift left with the robot in it")
            speed = min(SPEED, GAIN * left) if self._room(way) > ROOM else 0.0
            lean = bounded(-LEAN * seen.y * way, LEAN_MAX)
            turn = bounded(TURN_GAIN * wrap_angle(lean - seen.yaw), TURN_RATE)
            base.set_velocity(Twist(way * speed, 0.0, turn))
            await clock.sleep(PERIOD)
        base.set_velocity(STILL)
        await stand_still(robot)

    def _hold_door(self, *, needed: bool) -> None:
        """Hold the door. Raises Refused, if it is ``needed``: a robot outside does not depend on the lift."""
        try:
            self.robot[LiftClient].hold_door(DOOR_HELD)
        except Refused:
            if needed:
                raise

    def _room(self, way: float) -> float:
        """Return the free distance ahead of the hull (``way`` 1) or behind (-1) by the lidar, m; 0 if it is blind."""
        scan, radius = self.robot[Lidar].scan, self.robot.description.radius
        if scan is None or not _sees(self.robot, way):
            return 0.0
        points = ScanReader().read(scan).points
        along = points[:, 0] * way
        ahead = along[(np.abs(points[:, 1]) < radius) & (along > 0.0)]
        return float(ahead.min()) - radius if len(ahead) else math.inf

    async def _change_to(self, floor: int, redraw: bool) -> None:
        """Exchange the floors to the end, even if the ride is given up meanwhile: half of it would mix them."""
        exchange = self._exchanging = asyncio.get_running_loop().create_task(self._exchange(floor, redraw))
        try:
            await asyncio.shield(exchange)
        except asyncio.CancelledError:
            await asyncio.wait([exchange])  # unlike awaiting it, a second cancellation does not end it
            raise

    async def _exchange(self, floor: int, redraw: bool) -> None:
        async with self._changing:
            if floor != self._current:  # else a ride that was given up has brought it
                with exchange(self.robot):
                    await self._restore(floor, redraw)
                    assert self._places is not None
                    now, place = self.robot.clock.time(), self.belief.pose.relative_to(self._places[1])
                    self.robot.events.publish(FloorReached(stamp=now, floor=floor, place=place))

    async def _restore(self, floor: int, redraw: bool, *, carried: bool = False) -> None:
        """Store the present floor's state and restore that of ``floor``.

        The robot keeps its place in the car, unless it was ``carried``: then it may be anywhere, as on its dock.
        """
        robot, belief, self._redraws = self.robot, self.belief, redraw
        drawn = robot[MapAnnotations].current if MapAnnotations in robot else Annotations()
        home = robot[Docking].home if Docking in robot else None
        if self._places is not None:
            old = Storey(belief.map, home, drawn, *self._places)
            # An operation that replaces the annotations also saves them in the building's map store.
            await self._others.put(self._current, old, lasting=redraw)
        new = await self._others.take(floor)
        here, stamp = belief.pose, robot.clock.time()
        if new is None:
            belief.forget_map()
        elif carried:
            belief.take_map(new.map, new.home or new.waiting)
        else:
            assert self._places is not None
            belief.take_map(new.map, new.inside.compose(here.relative_to(self._places[1])))
        if new is not None:
            self._places = new.waiting, new.inside
        elif carried:
            self._places = None
        elif self._places is not None:
            self._places = self._places[0].relative_to(here), self._places[1].relative_to(here)
        self._current = floor
        robot.events.publish(MapReplaced(stamp=stamp))
        robot.events.publish(PoseJumped(stamp=stamp, pose=belief.pose, given=carried))
        if Docking in robot:
            robot[Docking].set_home(new.home if new else None)
        kept = new.drawn if new else Annotations()
        if redraw and MapAnnotations in robot and drawn != kept:
            await robot[MapAnnotations].change(lambda _: kept)


def _sees(robot: Robot, way: float) -> bool:
    """Return whether the lidar sees ahead (``way`` 1) or behind (-1)."""
    return sees(robot[Lidar].scan, 0.0 if way > 0.0 else math.pi)
