"""Check of each order, before it begins: can this robot drive it and do its actions?"""

from __future__ import annotations

from roboglot.model.components.motion.base import Base
from roboglot.model.robot import Robot
from roboglot.operations import BadParameters
from roboglot.protocols.vda5050.errors import Rejected
from roboglot.protocols.vda5050.table import AT_NODES, operation_of
from roboglot.wire.vda5050.orders import Action, Edge, OrderMessage
from roboglot.wire.vda5050.versions import ErrorKind, Level, Version


def check_order(order: OrderMessage, robot: Robot, version: Version, map_id: str) -> None:
    """Raise Rejected for fields that this robot cannot use and actions that it cannot do."""
    if order.zone_set_id:
        raise _unsupported("this robot uses no zones", {"zoneSetId": order.zone_set_id})
    for node in order.nodes:
        place = node.node_position
        if place is None:
            raise _unsupported("nodePosition is required", {"nodeId": node.node_id})
        if place.map_id != map_id:
            why = f"there is no map {place.map_id!r}; the robot's map is {map_id!r}"
            raise Rejected(ErrorKind.UNKNOWN_MAP, why, {"mapId": place.map_id, "nodeId": node.node_id})
        for action in node.actions:
            _check_action(action, robot, version)
    for edge in order.edges:
        _check_edge(edge, robot)


def _check_action(action: Action, robot: Robot, version: Version) -> None:
    operation = operation_of(action.action_type, version.level)
    if operation is None or action.action_type not in AT_NODES:
        raise Rejected(
            ErrorKind.ORDER_ACTION,
            f"this robot cannot do {action.action_type} at a node",
            {"actionId": action.action_id, "actionType": action.action_type},
        )
    if lacking := [kind.__name__ for kind in operation.needs if kind not in robot]:
        raise Rejected(ErrorKind.ORDER_ACTION, f"this robot has no {lacking[0]}", {"actionId": action.action_id})
    try:
        operation.parse(action.values)
    except BadParameters as bad:
        raise Rejected(ErrorKind.ORDER_ACTION, str(bad), {"actionId": action.action_id}) from None


def _check_edge(edge: Edge, robot: Robot) -> None:
    unusable = {
        "trajectory": edge.trajectory,
        "corridor": edge.corridor,
        "orientation": edge.orientation,
        "direction": edge.direction or None,
        "rotationAllowed": True if edge.rotation_allowed is False else None,
    }
    if named := [name for name, value in unusable.items() if value is not None]:
        raise _unsupported(f"this robot plans its own route: {named[0]} cannot be used", {"edgeId": edge.edge_id})
    if edge.actions:
        first = edge.actions[0]
        raise Rejected(
            ErrorKind.ORDER_ACTION,
            f"this robot cannot do {first.action_type} on an edge",
            {"actionId": first.action_id},
        )
    if edge.height is not None and edge.height < robot.description.height:
        high = robot.description.height
        raise _unsupported(f"the robot is {high} m high, the edge allows {edge.height}", {"edgeId": edge.edge_id})
    if edge.device_height > 0:
        raise _unsupported("this robot's load handling device has no height", {"edgeId": edge.edge_id})
    turning = robot[Base].limits.twist.yaw if Base in robot else 0.0
    if edge.rotation_speed is not None and edge.rotation_speed < turning:
        why = f"the robot turns at up to {turning:g} rad/s, the edge allows {edge.rotation_speed:g}"
        raise _unsupported(why, {"edgeId": edge.edge_id})
    if edge.speed is not None and edge.speed <= 0:
        raise _unsupported("the speed must be above 0", {"edgeId": edge.edge_id})


def _unsupported(why: str, references: dict[str, object]) -> Rejected:
    return Rejected(ErrorKind.UNSUPPORTED, why, references, Level.CRITICAL)
