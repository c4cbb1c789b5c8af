"""Chapter "platform": what the robot says happened."""

from __future__ import annotations

from enum import StrEnum

import msgspec


class GeneralEvent(StrEnum):
    """The general event types that this robot has causes for."""

    START_CHARGING = "START_CHARGING"
    STOP_CHARGING = "STOP_CHARGING"
    ON_DOCK = "ON_DOCK"
    OFF_DOCK = "OFF_DOCK"
    PATH_OCCUPIED = "PATH_OCCUPIED"
    ROBOT_BLOCKED = "ROBOT_BLOCKED"
    MOVE_TO_LANDING_POINT_FAILED = "MOVE_TO_LANDING_POINT_FAILED"
    SEARCH_DOCK_FAILED = "SEARCH_DOCK_FAILED"
    BUMPER_TRIGGERED = "BUMPER_TRIGGERED"
    SET_MAP_DONE = "SET_MAP_DONE"
    DEVICE_ERROR = "DEVICE_ERROR"
    BRAKE_RELEASED = "BRAKE_RELEASED"
    CLIFF_DETECTED = "CLIFF_DETECTED"
    POWER_OFF = "POWER_OFF"
    UPGRADE = "UPGRADE"
    MAP_LOOP_CLOSURE = "MAP_LOOP_CLOSURE"


class ElevatorEvent(StrEnum):
    """What happens on a ride. This robot drives out backwards, so it never turns round in the car."""

    WAIT_ELEVATOR = "WAIT_ELEVATOR"
    ENTER_ELEVATOR_PATH_FOUND = "ENTER_ELEVATOR_PATH_FOUND"
    ENTER_ELEVATOR = "ENTER_ELEVATOR"
    IN_ELEVATOR = "IN_ELEVATOR"
    LEAVE_ELEVATOR = "LEAVE_ELEVATOR"
    OUT_OF_ELEVATOR = "OUT_OF_ELEVATOR"
    SEARCH_ELEVATOR_PATH_FAILED = "SEARCH_ELEVATOR_PATH_FAILED"
    ENTER_ELEVATOR_OCCUPIED = "ENTER_ELEVATOR_OCCUPIED"
    ENTER_ELEVATOR_FAILED = "ENTER_ELEVATOR_FAILED"
    LEAVE_ELEVATOR_OCCUPIED = "LEAVE_ELEVATOR_OCCUPIED"
    LEAVE_ELEVATOR_FAILED = "LEAVE_ELEVATOR_FAILED"
    TAKE_ELEVATOR_OCCUPIED = "TAKE_ELEVATOR_OCCUPIED"


class RobotEvent(msgspec.Struct):
    """``timestamp``: milliseconds since the system started, as decimal text."""

    type: str
    timestamp: str
