"""Chapter "motion", POST actions: to other floors by lift, and into and out of a car called by others."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from roboglot.confirmation import confirmed
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import settle
from roboglot.model.components.mapping.mapping import abort_with_map
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.errors import Blocked, InvalidGoal, NotFound, RobotError, Unreachable
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.motion.car_exit import CROSS_SECONDS, CarExit
from roboglot.protocols.slamware.chapters.motion.errands import PART, Errand, run_errand
from roboglot.protocols.slamware.chapters.motion.home_docks import NAME
from roboglot.protocols.slamware.chapters.motion.homing import head_home
from roboglot.protocols.slamware.chapters.motion.moves import navigate, navigation_options
from roboglot.protocols.slamware.chapters.multi_floor.elevators import (
    Elevator,
    car_around,
    elevator_called,
    elevators_here,
    elevators_of,
)
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, FloorName
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.errors import HttpError
from roboglot.protocols.slamware.vocabulary import pose_of
from roboglot.wire.slamware.chapters.motion import (
    Door,
    EnterElevator,
    EnterElevatorOptions,
    GoHome,
    GoHomeOptions,
    LeaveElevator,
    LeaveElevatorOptions,
    MoveOptions,
    MultiFloorMoveOptions,
    StoppingYaw,
)
from roboglot.wire.slamware.chapters.platform import ElevatorEvent


def multi_floor_move(context: Context, options: MultiFloorMoveOptions) -> Action:
    """Drive to a place by its name, or to a pose on a floor, by lift if need be."""
    how, target = options.move_options or MoveOptions(), options.target
    navigation_options(context.robot, how, None)
    if not target.poi_name and target.pose is None:
        raise InvalidGoal("a target needs a poi_name, or a floor and a pose")

    async def work(errand: Errand) -> None:
        await settle(context.robot)
        floor, pose = _place(context, target.poi_name) if target.poi_name else (None, None)
        if pose is None and target.pose is not None:
            floor, pose = _floor(context, target.building, target.floor), pose_of(target.pose)
        assert pose is not None
        await change_floor(context, errand, floor)
        yaw = pose.yaw if how.has("with_yaw") and how.yaw is None else None
        await errand.do(navigate(errand.robot, [pose.point], how, source=PART, yaw=yaw))

    action = run_errand(context.robot, "move to a floor", work, target)
    return action if target.poi_name else abort_with_map(context.robot, action, ActionStatus.EXECUTING)


def multi_floor_back_home(context: Context, options: GoHomeOptions) -> Action:
    """Drive to the bound dock, or the next best one, on any floor."""
    wanted = options.gohome_options or GoHome()
    navigation_options(context.robot, wanted.move_options or MoveOptions(), None)

    async def work(errand: Errand) -> None:
        await settle(context.robot)
        await change_floor(context, errand, home_floor(context))
        await head_home(errand, wanted)

    return run_errand(context.robot, "go home over floors", work)


def home_floor(context: Context) -> FloorMap | None:
    """Return the start floor if it has a dock; else None, which is this one, or the first that has one."""
    start, docked = context.maps.start_floor, [floor for floor in context.maps.floors if floor.annotations.docks]
    if start in docked:
        return start
    return docked[0] if docked and context.robot[Docking].home is None else None


def _place(context: Context, name: str) -> tuple[FloorMap, Pose]:
    """Return the loaded place of that name or id, preferably on this floor."""
    floors = sorted(context.maps.floors, key=lambda floor: floor.name != context.maps.current)
    for floor in floors:
        for place in floor.places:
            if name in (place.metadata.get(NAME), place.id):
                return floor, place.pose
    raise NotFound("POI not found")


def _floor(context: Context, building: str, floor: str) -> FloorMap | None:
    """Return the loaded floor; None if the robot is on it."""
    here = context.maps.current
    if floor in ("", here.floor) and building in ("", here.building):
        return None
    for loaded in context.maps.floors:
        if loaded.name.floor == floor and loaded.name.building == (building or here.building):
            return loaded
    raise NotFound(f"no floor {floor} is loaded")


async def change_floor(context: Context, errand: Errand, floor: FloorMap | None) -> None:
    """Take the lift to a floor, and switch to its map; on it already, or for None, only get out of a car.

    Out of a car, as after a ride that was given up there, the robot drives straight through the door, held open.
    """
    await settle(context.robot)
    robot, maps = context.robot, context.maps
    name = maps.current if floor is None else floor.name
    if floor is None or name == maps.current:
        car = car_to_leave(context)
        if car is None:
            return
        lift = landing = car
    else:
        shared = shared_elevators(robot, floor)
        if not shared or Floors not in robot:
            raise Unreachable(f"no elevator leads from {maps.current.floor} to {name.floor}")
        lift, landing = shared[0]
    floors, goal = robot[Floors], stop_at(context, name)
    floors.begin_on(stop_at(context, maps.current))
    floors.set_lift(lift.entrance, lift.aboard)
    await errand.do(floors.ride(goal, redraw=False, source=PART))  # on arrival the floor is entered, drawings and all
    if name != maps.current:
        await maps.enter(name.building, name.floor, landing.entrance)
    elif robot[Localization].lost is not None:
        async with confirmed():
            robot[Localization].set_pose(landing.entrance)


def car_to_leave(context: Context) -> Elevator | None:
    """Return the elevator that the robot is in, if it can have its door held open here; None outside."""
    robot, here = context.robot, context.maps.current
    if Floors not in robot or (here.floor not in robot[LiftClient].floors and len(context.maps.floors) < 2):
        return None
    return car_around(robot)


def shared_elevators(robot: Robot, floor: FloorMap) -> list[tuple[Elevator, Elevator]]:
    """Return the elevators that stop here and at ``floor``, as drawn on both maps."""
    here, there = elevators_here(robot), elevators_of(floor.annotations)
    return [(a, b) for a in here for b in there if a.id == b.id]


def stop_at(context: Context, name: FloorName) -> int:
    """Return the lift's number for a floor: by name, else by its order among the loaded floors."""
    stops = context.robot[LiftClient].floors
    if name.floor in stops:
        return stops.index(name.floor)
    names = [floor.name for floor in context.maps.floors]
    if name not in names or len(names) > len(stops):
        raise Unreachable(f"the elevator does not stop at {name.floor}")
    return names.index(name)


def _elevator(context: Context, id: str) -> Elevator:
    try:
        return elevator_called(context.robot, id)
    except HttpError as error:
        raise InvalidGoal(error.detail) from None


def enter_elevator(context: Context, options: EnterElevatorOptions) -> Action:
    """Drive into a car called by others, through its open door; 400 for an unknown one."""
    _elevator(context, options.elevator_id)
    how, note = options.enter_elevator_options or EnterElevator(), context.events.note

    async def work(errand: Errand) -> None:
        await settle(context.robot)
        elevator = _elevator(context, options.elevator_id)  # on the map that is in use by now
        yaw = elevator.inward
        if how.elevator_stopping_yaw is StoppingYaw.FRONT:
            yaw = wrap_angle(yaw + math.pi)
        await _cross(errand, elevator, how.elevator_door_flag)
        note(ElevatorEvent.WAIT_ELEVATOR)
        note(ElevatorEvent.ENTER_ELEVATOR)
        with _noting(note, ElevatorEvent.ENTER_ELEVATOR_OCCUPIED, ElevatorEvent.ENTER_ELEVATOR_FAILED):
            goal = elevator.inside.point
            if how.use_conservative_mode is False:
                rear = how.elevator_door_flag is Door.REAR
                goal = elevator.deep(errand.robot.description.radius, rear=rear)
            into = navigate(errand.robot, [goal], MoveOptions(), source=PART)
            await errand.do(into, within=how.timeout_in_ms / 1000 or CROSS_SECONDS)
        note(ElevatorEvent.IN_ELEVATOR)
        note(ElevatorEvent.TURNING_ROUND_IN_ELEVATOR)
        turn = wrap_angle(yaw - errand.robot[Localization].pose.yaw)
        await errand.do(errand.robot[Driving].move_by(Pose(yaw=turn), source=PART))

    return run_errand(context.robot, "enter elevator", work, options.elevator_id)


@contextmanager
def _noting(note: Callable[[ElevatorEvent], None], occupied: ElevatorEvent, failed: ElevatorEvent) -> Iterator[None]:
    """Note why the door could not be crossed."""
    try:
        yield
    except RobotError as error:
        for event in (occupied, ElevatorEvent.TAKE_ELEVATOR_OCCUPIED) if isinstance(error, Blocked) else ():
            note(event)
        note(failed)
        raise


async def _cross(errand: Errand, elevator: Elevator, door: Door) -> None:
    """Drive to the waiting place at a door."""
    waiting = elevator.waiting(rear=door is Door.REAR)
    await errand.do(navigate(errand.robot, [waiting.point], MoveOptions(), source=PART, yaw=waiting.yaw))


def leave_elevator(context: Context, options: LeaveElevatorOptions) -> Action:
    """Leave the car to the waiting place, and drive on to the target, if given; 400 for an unknown elevator."""
    _elevator(context, options.elevator_id)
    how, note = options.leave_elevator_options or LeaveElevator(), context.events.note
    onward = how.move_options or MoveOptions()
    navigation_options(context.robot, onward, None)

    async def work(errand: Errand) -> None:
        await settle(context.robot)
        find = partial(_elevator, context, options.elevator_id)
        find()
        note(ElevatorEvent.LEAVE_ELEVATOR)
        with _noting(note, ElevatorEvent.LEAVE_ELEVATOR_OCCUPIED, ElevatorEvent.LEAVE_ELEVATOR_FAILED):
            await CarExit(errand, find, how).drive_out()
        note(ElevatorEvent.OUT_OF_ELEVATOR)
        if options.target is not None and how.if_need_reach_milestone:
            goal = pose_of(options.target)
            yaw = goal.yaw if onward.has("with_yaw") and onward.yaw is None else None
            await errand.do(navigate(errand.robot, [goal.point], onward, source=PART, yaw=yaw))

    action = run_errand(context.robot, "leave elevator", work, options.elevator_id)
    return abort_with_map(context.robot, action, ActionStatus.EXECUTING) if options.target is not None else action
