"""Words and units of VDA 5050: the messages that the robot sends, in both versions. Takes values, knows no socket."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from typing import Any

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.emergency_stop import is_stopped
from roboglot.model.components.sensing.bumper import Bumper
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.lease import Lease
from roboglot.model.components.system.link import is_current, was_heard
from roboglot.model.errors import Refused
from roboglot.model.geometry import wrap_angle
from roboglot.model.robot import Robot
from roboglot.protocols.vda5050.order_book import ActionState, OrderBook
from roboglot.protocols.vda5050.table import AT_NODES, INSTANT, ONLY_IN, TABLE
from roboglot.wire.vda5050.orders import ACTIONS_MAX, MESSAGE_MAX, NODES_MAX, PARAMETERS_MAX, Edge, Node
from roboglot.wire.vda5050.versions import Version

JACK_POSITION = "jack"  # the one load handling device, and the one load position
SHELF = "shelf"  # the one station type for loads
NUMBERS = ("x", "y", "theta", "height", "depth")  # parameters of actions that are not text
STILL = 0.01  # m/s and rad/s below which the robot counts as standing
DOOR = "vda5050"


def timestamp(epoch: float) -> str:
    """Return UTC with milliseconds."""
    return datetime.fromtimestamp(epoch, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def position(robot: Robot, version: Version, map_id: str) -> dict[str, object]:
    """Return the robot's position under the version's name; nothing without localization or before the first report."""
    if Localization not in robot or not was_heard(robot):
        return {}
    localization = robot[Localization]
    pose = localization.pose
    known = "localized" if version.new_words else "positionInitialized"
    name = "mobileRobotPosition" if version.new_words else "agvPosition"
    deviation = {} if localization.deviation is None else {"deviationRange": round(localization.deviation, 3)}
    return {
        name: {
            "x": round(pose.x, 4),
            "y": round(pose.y, 4),
            "theta": round(wrap_angle(pose.yaw), 5),
            "mapId": map_id,
            known: localization.started and localization.lost is None,
            "localizationScore": round(min(1.0, max(0.0, localization.quality)), 3),
            **deviation,
        }
    }


def velocity(robot: Robot) -> dict[str, object]:
    """Return the robot's velocity in base_link; nothing without a link."""
    if Odometry not in robot or not is_current(robot):
        return {}
    twist = robot[Odometry].reading.twist
    return {"velocity": {"vx": round(twist.x, 3), "vy": round(twist.y, 3), "omega": round(twist.yaw, 3)}}


def is_driving(robot: Robot) -> bool:
    """Return True if the robot moves or turns, for any client."""
    if Odometry not in robot or not is_current(robot):
        return False
    twist = robot[Odometry].reading.twist
    return math.hypot(twist.x, twist.y) > STILL or abs(twist.yaw) > STILL


def operating_mode(robot: Robot) -> str:
    """AUTOMATIC while fleet control may move the robot and no other client does."""
    if Lease not in robot:
        return "AUTOMATIC"
    lease = robot[Lease]
    holder = lease.holder
    taken = bool(lease.taken_by) and not lease.may_move(DOOR) and not lease.taken_by.startswith(DOOR)
    others = holder is not None and not holder.who.startswith(DOOR)
    return "MANUAL" if taken or others else "AUTOMATIC"


def power(robot: Robot, version: Version) -> dict[str, object]:
    """Return the battery's state; a robot without one is always full."""
    state = robot[Battery].state if Battery in robot else None
    charge = round(100 * state.percentage, 1) if state else 100.0
    charging = bool(state and state.charging)
    volts = {"batteryVoltage": round(state.voltage, 2)} if state else {}
    if version.new_words:
        return {"powerSupply": {"stateOfCharge": charge, "charging": charging, **volts}}
    return {"batteryState": {"batteryCharge": charge, "charging": charging, **volts}}


def safety(robot: Robot, version: Version) -> dict[str, object]:
    """Return emergency stop and contact."""
    name = "activeEmergencyStop" if version.new_words else "eStop"
    touched = Bumper in robot and bool(robot[Bumper].pressed)
    return {"safetyState": {name: "MANUAL" if is_stopped(robot) else "NONE", "fieldViolation": touched}}


def loads(robot: Robot, known: Mapping[str, str]) -> dict[str, object]:
    """Return the jack's load, with fleet control's own data about it; nothing where that is unknown."""
    if (loaded := is_loaded(robot)) is None:
        return {}
    return {"loads": [{**known, "loadPosition": JACK_POSITION}] if loaded else []}


def is_loaded(robot: Robot) -> bool | None:
    """Return whether the jack carries a load; None without a jack, and for a real one that does not report it."""
    try:
        return robot[Jack].loaded if Jack in robot else None
    except Refused:
        return None


def progress(book: OrderBook) -> dict[str, object]:
    """Return the rest of the order."""
    way = book.way_since_node
    return {
        **({} if way is None else {"distanceSinceLastNode": round(way, 3)}),
        "orderId": book.order_id,
        "orderUpdateId": book.update_id,
        "lastNodeId": book.last_node,
        "lastNodeSequenceId": book.last_sequence,
        "nodeStates": [_node(node) for node in book.nodes],
        "edgeStates": [_edge(edge) for edge in book.edges],
    }


def _node(node: Node) -> dict[str, object]:
    return {"nodeId": node.node_id, "sequenceId": node.sequence_id, "released": node.released}


def _edge(edge: Edge) -> dict[str, object]:
    return {"edgeId": edge.edge_id, "sequenceId": edge.sequence_id, "released": edge.released}


def action_states(states: Iterable[ActionState], version: Version) -> list[dict[str, Any]]:
    """Return the states of actions."""
    result = "actionResult" if version.new_words else "resultDescription"
    return [
        {"actionId": state.action.action_id, "actionType": state.action.action_type, "actionStatus": state.status.value}
        | ({result: state.result} if state.result else {})
        for state in states
    ]


def factsheet(robot: Robot, version: Version, state_period: float, visualization_period: float) -> dict[str, object]:
    """Return the factsheet, which describes the robot before any order."""
    new = version.new_words
    robot_word = "mobileRobot" if new else "agv"
    return {
        "typeSpecification": {
            "seriesName": robot.description.model,
            f"{robot_word}Kinematics" if new else "agvKinematic": _kinematics(robot, new),
            f"{robot_word}Class": "CARRIER",
            "maximumLoadMass" if new else "maxLoadMass": 0.0,
            "localizationTypes": ["NATURAL"],
            "navigationTypes": ["FREELY_NAVIGATING" if new else "AUTONOMOUS"],
            **({"supportedZones": []} if new else {}),
        },
        "physicalParameters": _physical_parameters(robot, new),
        "protocolLimits": _limits(new, state_period, visualization_period),
        "protocolFeatures": {
            "optionalParameters": [
                {"parameter": "order.nodes.nodePosition", "support": "REQUIRED"},
                {"parameter": "order.nodes.nodePosition.theta", "support": "SUPPORTED"},
                {"parameter": "order.nodes.nodePosition.allowedDeviationXY", "support": "SUPPORTED"},
                {"parameter": "order.edges.maximumSpeed" if new else "order.edges.maxSpeed", "support": "SUPPORTED"},
                {"parameter": "order.edges.maximumHeight" if new else "order.edges.maxHeight", "support": "SUPPORTED"},
            ],
            f"{robot_word}Actions": [_described(name, new) for name in _actions(robot, version)],
        },
        f"{robot_word}Geometry": {},
        "loadSpecification": {"loadPositions": [JACK_POSITION]} if Jack in robot else {},
    }


def _kinematics(robot: Robot, new: bool) -> str:
    if Base in robot and robot[Base].limits.holonomic:
        return "OMNIDIRECTIONAL" if new else "OMNI"
    return "DIFFERENTIAL" if new else "DIFF"


def _physical_parameters(robot: Robot, new: bool) -> dict[str, float]:
    limits, description = robot[Base].limits if Base in robot else None, robot.description
    speed, acceleration = (limits.twist.x, limits.linear_acceleration) if limits else (0.0, 0.0)
    across = round(2 * description.radius, 3)
    return {
        "minimumSpeed" if new else "speedMin": 0.0,
        "maximumSpeed" if new else "speedMax": speed,
        "maximumAcceleration" if new else "accelerationMax": acceleration,
        "maximumDeceleration" if new else "decelerationMax": acceleration,
        "minimumHeight" if new else "heightMin": description.height,
        "maximumHeight" if new else "heightMax": description.height,
        "width": across,
        "length": across,
    }


def _limits(new: bool, state_period: float, visualization_period: float) -> dict[str, object]:
    strings, arrays = ("maximumStringLengths", "maximumArrayLengths") if new else ("maxStringLens", "maxArrayLens")
    length, names = ("maximumMessageLength", "maximumIdLength") if new else ("msgLen", "idLen")
    interval = (
        ("minimumOrderInterval", "minimumStateInterval", "defaultStateInterval")
        if new
        else ("minOrderInterval", "minStateInterval", "defaultStateInterval")
    )
    return {
        strings: {length: MESSAGE_MAX, names: 256},
        arrays: {
            "order.nodes": NODES_MAX,
            "order.edges": NODES_MAX,
            "node.actions": ACTIONS_MAX,
            "edge.actions": 0,
            "actions.actionsParameters": PARAMETERS_MAX,
            "instantActions": ACTIONS_MAX,
        },
        "timing": dict(zip(interval, (0.0, 0.05, state_period), strict=True))
        | {"visualizationInterval": visualization_period},
    }


def _actions(robot: Robot, version: Version) -> list[str]:
    """Return the actions that this robot has in this version."""
    return [
        operation.key
        for operation in TABLE
        if operation.key in AT_NODES | INSTANT
        and ONLY_IN.get(operation.key, version.level) == version.level
        and all(kind in robot for kind in operation.needs)
    ]


def _described(name: str, new: bool) -> dict[str, object]:
    operation = TABLE.get(name)
    assert operation is not None
    scopes = ["INSTANT"] * (name in INSTANT) + ["NODE"] * (name in AT_NODES)
    parameters = [
        {"key": key, "valueDataType": "NUMBER" if key in NUMBERS else "STRING"}
        | {"isOptional": not operation.requires(key)}
        for key in operation.names
    ]
    # Version 2.1's schema wants a string in blockingTypes, its text an array, so the field is omitted.
    more = {
        "pauseAllowed": False,
        "cancelAllowed": name in AT_NODES,
        "blockingTypes": ["NONE", "SOFT", "SINGLE", "HARD"],
    }
    return {
        "actionType": name,
        "actionDescription": operation.summary,
        "actionScopes": scopes,
        "actionParameters": parameters,
        **(more if new else {}),
    }
