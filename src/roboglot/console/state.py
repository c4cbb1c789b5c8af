"""Snapshot of a robot's state for pages, as plain values from its components."""

from __future__ import annotations

from roboglot.console import plain_values
from roboglot.console.verbs.orders import orders_of
from roboglot.console.verbs.robots import VERBS
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.interaction.light import Light
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.arm import Arm
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.gripper import Gripper
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.lease import Lease
from roboglot.model.components.system.link import Link, was_heard
from roboglot.model.robot import Robot

PARTS = {  # by which a page chooses its panels
    "arm": Arm,
    "battery": Battery,
    "blaster": Blaster,
    "camera": Camera,
    "docking": Docking,
    "driving": Driving,
    "emergency_stop": EmergencyStop,
    "gimbal": Gimbal,
    "gripper": Gripper,
    "legs": Legs,
    "lidar": Lidar,
    "light": Light,
    "localization": Localization,
    "mapping": Mapping,
    "microphone": Microphone,
    "navigation": Navigation,
    "speaker": Speaker,
}


def state_of(robot: Robot) -> dict[str, object]:
    """Return the slowly changing state; each key is sent again when its value changes."""
    return {
        "about": _about(robot),
        "parts": [name for name, interface in PARTS.items() if interface in robot],
        "absent": [
            verb.key for verb in VERBS if any(part not in robot for part in verb.needs)
        ],  # verbs of missing parts
        "actions": [plain_values.action(action, robot.clock.time()) for action in robot.actions.running()],
        "history": [plain_values.action(action, robot.clock.time()) for action in reversed(robot.actions.history)],
        "orders": orders_of(robot),
        "control": _control(robot),
        "faults": _faults(robot),
        "battery": _battery(robot),
        "place": _place(robot),
        "safety": _safety(robot),
        "body": _body(robot),
    }


def _about(robot: Robot) -> dict[str, object]:
    plate = robot.description
    firmware = robot[Firmware].version if Firmware in robot else plate.software_version
    limits = robot[Base].limits if Base in robot else None
    recorded = robot.responder.recorded if robot.responder is not None else None
    return {
        "maker": plate.maker,
        "model": plate.model,
        "serial": plate.serial,
        "firmware": firmware,
        "recorded": recorded.path.name if recorded is not None else "",
        "radius": plate.radius,
        "speed": limits.twist.x if limits else 0.0,
        "yaw_speed": limits.twist.yaw if limits else 0.0,
        "holonomic": bool(limits and limits.holonomic),
    }


def _control(robot: Robot) -> dict[str, object]:
    lease = robot[Lease]
    holder = lease.holder
    return {
        "holder": holder.who if holder else "",
        "doing": holder.doing if holder else "",
        "taken_by": lease.taken_by,
        "last": lease.last.who,
        "link": link_of(robot),
    }


def link_of(robot: Robot) -> str:
    """Return the state of a real robot's link, with the reason; empty for a simulated one."""
    if Link not in robot:
        return ""
    state, reason = robot[Link].state, robot[Link].reason
    return f"{state}: {reason}" if reason else str(state)


def _faults(robot: Robot) -> list[dict[str, object]]:
    faults = robot[Health].faults if Health in robot else []
    return [
        {"id": f.id, "name": f.name, "component": f.component, "level": f.level.name, "message": f.message}
        for f in faults
    ]


def _battery(robot: Robot) -> dict[str, object] | None:
    if Battery not in robot or not was_heard(robot):
        return None
    state = robot[Battery].state
    return {
        "charge": round(state.percentage, 3),
        "volts": round(state.voltage, 1),
        "amperes": round(state.current, 1),
        "celsius": round(state.temperature),
        "charging": state.charging,
        "supply": str(state.supply),
        "low": state.percentage <= robot[Battery].low,
        "remaining": None if state.remaining is None else round(state.remaining / 60) * 60,
    }


def _place(robot: Robot) -> dict[str, object]:
    known = Localization in robot and was_heard(robot)
    lost = robot[Localization].lost if known else None
    return {
        "quality": round(robot[Localization].quality, 2) if known else None,
        "lost": str(lost) if lost else "",
        "mapping": robot[Mapping].enabled if Mapping in robot else None,
        "floor": robot[Floors].current if Floors in robot else None,
        "home": plain_values.pose(home) if Docking in robot and (home := robot[Docking].home) else None,
    }


def _safety(robot: Robot) -> dict[str, object]:
    known = EmergencyStop in robot
    return {
        "emergency_stop": known and robot[EmergencyStop].engaged,
        "brake_released": known and robot[EmergencyStop].brake_released,
        "docked": robot[DockContact].docked if DockContact in robot and was_heard(robot) else None,
        "power": str(robot[Power].mode) if Power in robot else "",
    }


def _body(robot: Robot) -> dict[str, object]:
    """Return the state of optional parts."""
    body: dict[str, object] = {}
    if Camera in robot and (delay := robot[Camera].delay):
        body["camera"] = delay
    if Legs in robot:
        body["posture"] = str(robot[Legs].posture)
    if Gimbal in robot:
        angles, limits = robot[Gimbal].angles, robot[Gimbal].limits
        body["gimbal"] = {"pitch": round(angles.pitch, 2), "yaw": round(angles.yaw, 2)}
        low, high = limits.lowest, limits.highest
        body["gimbal_reach"] = [round(v, 2) for v in (low.pitch, high.pitch, low.yaw, high.yaw)]
    if Arm in robot:
        position = robot[Arm].position
        body["arm"] = {"x": round(position.x, 3), "z": round(position.z, 3)}
    if Gripper in robot:
        body["gripper"] = str(robot[Gripper].status)
    if Blaster in robot:
        body["ammo"] = robot[Blaster].ammo
    if Light in robot:
        body["lights"] = sorted(robot[Light].zones)
    if Speaker in robot:
        body["volume"] = round(robot[Speaker].volume, 2)
    return body
