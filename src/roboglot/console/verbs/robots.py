"""Verbs of a robot for pages and scripts. Each goes through the model like any client's request.

The handlers' first parameter is the robot; the others come from JSON by name, in SI units and the map frame.
"""

from __future__ import annotations

from dataclasses import astuple
from typing import Annotated

import msgspec

from roboglot.model.actions import Action
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.interaction.light import Colour, Light, LightEffect
from roboglot.model.components.interaction.speaker import TEXT_MAX, Speaker
from roboglot.model.components.motion.arm import Arm, ArmPosition
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.gripper import Gripper
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.system import stopping
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.lease import Lease
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.geometry import Point, Twist
from roboglot.model.robot import Robot
from roboglot.operations import OperationTable, Right

SOURCE = "console"
WAYPOINTS_MAX = 100
Meters = Annotated[float, msgspec.Meta(ge=-10_000, le=10_000)]
Radians = Annotated[float, msgspec.Meta(ge=-1000, le=1000)]
Byte = Annotated[int, msgspec.Meta(ge=0, le=255)]
Text = Annotated[str, msgspec.Meta(min_length=1, max_length=TEXT_MAX)]
Speed = Annotated[float, msgspec.Meta(ge=-10, le=10)]  # m/s, rad/s; a robot's own limits are narrower
Moment = Annotated[float, msgspec.Meta(gt=0, le=2)]  # s
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=80)]
Spot = tuple[Meters, Meters]
Spots = Annotated[list[Spot], msgspec.Meta(min_length=1, max_length=WAYPOINTS_MAX)]


def visible(name: str) -> str:
    """Return the name of a new thing without blanks around it. Raises InvalidGoal if people could not read it."""
    if not (name := name.strip()) or not name.isprintable():
        raise InvalidGoal("a name has letters, and no line breaks or invisible characters")
    return name


VERBS: OperationTable[str] = OperationTable("console", Right.DRIVE, exact=True)


class Started(msgspec.Struct):
    """An accepted action; its progress is in the robot's state."""

    action: int


def started(action: Action) -> Started:
    """Answer with the action's number."""
    return Started(action.id)


@VERBS.on("go_to", needs=(Navigation,))
async def go_to(robot: Robot, *, points: Spots, yaw: Radians | None = None) -> Started:
    """Drive through ``points`` (map, m) in turn; ``yaw``: final heading, rad."""
    goals = [Point(x, y) for x, y in points]
    return started(robot[Navigation].navigate_to(goals, NavigationOptions(yaw=yaw), source=SOURCE))


@VERBS.on("drive", needs=(Driving,))
async def drive(robot: Robot, *, x: Speed = 0.0, y: Speed = 0.0, yaw: Speed = 0.0, seconds: Moment = 1.0) -> Started:
    """Drive with this velocity (base_link, m/s, rad/s) for at most two seconds, then brake."""
    return started(robot[Driving].drive(Twist(x, y, yaw), lifetime=seconds, source=SOURCE))


@VERBS.on("dock", needs=(Docking,))
async def dock(robot: Robot) -> Started:
    """Drive home and onto the charging contacts."""
    return started(robot[Docking].dock(source=SOURCE))


@VERBS.on("undock", needs=(Docking,))
async def undock(robot: Robot) -> Started:
    """Leave the charging contacts."""
    return started(robot[Docking].undock(source=SOURCE))


@VERBS.on("stop")
async def stop(robot: Robot) -> None:
    """Cancel everything that moves the robot, for any client, end its programs, and hold its orders.

    Returns when it stands.
    """
    await stopping.stop(robot, reason="stopped at the console", moving=True)


@VERBS.on("cancel")
async def cancel(robot: Robot, *, action: int) -> None:
    """Cancel one action."""
    robot.actions.get(action).cancel("cancelled at the console")


@VERBS.on("pause")
async def pause(robot: Robot, *, action: int) -> None:
    """Hold an action where it is, if it is under way and can stand still."""
    _under_way(robot, action).pause()


@VERBS.on("resume")
async def resume(robot: Robot, *, action: int) -> None:
    """Go on with a paused action."""
    _under_way(robot, action).resume()


def _under_way(robot: Robot, id: int) -> Action:
    """Return a running action. Raises NotFound, Refused if it has ended."""
    action = robot.actions.get(id)
    if action.status.ended:
        raise Refused(f"{action.name} has ended")
    return action


@VERBS.on("emergency_stop", needs=(EmergencyStop,))
async def emergency_stop(robot: Robot, *, engage: bool) -> None:
    """Engage or release the emergency stop."""
    if engage:
        robot[EmergencyStop].engage()
    else:
        robot[EmergencyStop].release()


@VERBS.on("give_control", needs=(Lease,))
async def give_control(robot: Robot, *, to: Name) -> None:
    """Let only ``to`` (a client's name, such as "robomaster 10.0.0.7") move the robot."""
    await robot[Lease].take(to)


@VERBS.on("release_control", needs=(Lease,))
async def release_control(robot: Robot) -> None:
    """Let every client move the robot again; the newest command counts."""
    await robot[Lease].release()


@VERBS.on("dismiss_fault", needs=(Health,))
async def dismiss_fault(robot: Robot, *, fault: int) -> None:
    """Hide a fault; it comes back if its cause lasts."""
    robot[Health].dismiss(fault)


@VERBS.on("stand", needs=(Legs,))
async def stand(robot: Robot) -> Started:
    """Stand up."""
    return started(robot[Legs].stand(source=SOURCE))


@VERBS.on("lie_down", needs=(Legs,))
async def lie_down(robot: Robot) -> Started:
    """Brake and lie down."""
    return started(robot[Legs].lie_down(source=SOURCE))


@VERBS.on("aim", needs=(Gimbal,))
async def aim(robot: Robot, *, pitch: Radians | None = None, yaw: Radians | None = None) -> Started:
    """Turn the gimbal to these angles against the body, rad."""
    return started(robot[Gimbal].move_to(pitch=pitch, yaw=yaw, source=SOURCE))


@VERBS.on("recenter_gimbal", needs=(Gimbal,))
async def recenter_gimbal(robot: Robot) -> Started:
    """Turn the gimbal to the body's front."""
    return started(robot[Gimbal].recenter(source=SOURCE))


@VERBS.on("move_arm", needs=(Arm,))
async def move_arm(robot: Robot, *, x: Meters = 0.0, z: Meters = 0.0) -> Started:
    """Move the arm's end point by so much, m."""
    return started(robot[Arm].move_by(ArmPosition(x, z), source=SOURCE))


@VERBS.on("recenter_arm", needs=(Arm,))
async def recenter_arm(robot: Robot) -> Started:
    """Fold the arm."""
    return started(robot[Arm].recenter(source=SOURCE))


@VERBS.on("grip", needs=(Gripper,))
async def grip(robot: Robot, *, close: bool) -> Started:
    """Close or open the gripper's jaws."""
    gripper = robot[Gripper]
    return started(gripper.close(source=SOURCE) if close else gripper.open(source=SOURCE))


@VERBS.on("fire", needs=(Blaster,))
async def fire(robot: Robot) -> int:
    """Fire one shot; the answer is how many beads leave."""
    return robot[Blaster].fire()


@VERBS.on("shine", needs=(Light,))
async def shine(
    robot: Robot,
    *,
    red: Byte,
    green: Byte,
    blue: Byte,
    zone: Name | None = None,
    effect: LightEffect = LightEffect.SOLID,
) -> None:
    """Light one zone, or all that can show the effect."""
    light, colour = robot[Light], Colour(red, green, blue)
    for each in [zone] if zone else sorted(light.zones):
        light.shine(each, colour, effect if any(astuple(colour)) else LightEffect.OFF)


@VERBS.on("say", needs=(Speaker,))
async def say(robot: Robot, *, text: Text) -> Started:
    """Speak a text."""
    return started(robot[Speaker].say(text, source=SOURCE))


@VERBS.on("volume", needs=(Speaker,))
async def volume(robot: Robot, *, to: Annotated[float, msgspec.Meta(ge=0, le=1)]) -> None:
    """Set the loudspeaker, 0 silent to 1 loudest."""
    await robot[Speaker].set_volume(to)
