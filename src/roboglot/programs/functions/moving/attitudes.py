"""cyberdog.motion: height and attitude of the body above its feet (4.4.04). Metres and degrees.

Roll to the right, pitch down and yaw to the left are positive, as in the model. Table 4.1 limits the parameters; within
them, a body that cannot reach a pose goes as far as it can.
"""

from __future__ import annotations

import math

from roboglot.model.components.motion.legs import BodyPose, LegLimits, Legs
from roboglot.model.geometry import Orientation, Point, bounded
from roboglot.programs.functions.moving.limits import LIMITS, outside
from roboglot.programs.functions.moving.outcomes import result
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

ABSOLUTE_FORCE, RELATIVE_FORCE, ABSOLUTE_POSITION, RELATIVE_POSITION = 201, 202, 211, 212  # MotionId
HEIGHT = LIMITS["centroid_z"].default


@ABILITIES.on("cyberdog.motion.absolute_attitude", needs=(Legs,))
async def absolute_attitude(
    session: Session,
    centroid_z: float = HEIGHT,
    roll: float = 0.0,
    pitch: float = 0.0,
    yaw: float = 0.0,
    duration: float = 0.0,
) -> Record:
    """Move the body to this height and attitude within ``duration`` s (0: as fast as possible), and hold it."""
    wrong = outside(centroid_z=centroid_z, roll=roll, pitch=pitch, yaw=yaw, duration=duration)
    body = BodyPose(centroid_z, _attitude(roll, pitch, yaw))
    return await result(session, ABSOLUTE_FORCE, _hold(session, body, duration), wrong)


@ABILITIES.on("cyberdog.motion.transition_standing", needs=(Legs,))
async def transition_standing(session: Session, centroid_z: float = HEIGHT, duration: float = 1.0) -> Record:
    """Stand straight at this height within ``duration`` s."""
    wrong = outside(centroid_z=centroid_z, duration=duration)
    return await result(session, ABSOLUTE_POSITION, _hold(session, BodyPose(centroid_z), duration), wrong)


@ABILITIES.on("cyberdog.motion.relatively_force_control_attitude", needs=(Legs,))
async def relatively_force_control_attitude(
    session: Session,
    centroid_x: float = 0.0,
    centroid_y: float = 0.0,
    centroid_z: float = 0.0,
    roll: float = 0.0,
    pitch: float = 0.0,
    yaw: float = 0.0,
    duration: float = 1.0,
) -> Record:
    """Move the body by these amounts from its present pose, within ``duration`` s."""
    wrong = _outside(centroid_x, centroid_y, centroid_z, roll, pitch, yaw, duration)
    body = BodyPose(centroid_z, _attitude(roll, pitch, yaw), Point(centroid_x, centroid_y))
    return await result(session, RELATIVE_FORCE, _hold(session, body, duration, relative=True), wrong)


@ABILITIES.on("cyberdog.motion.relatively_position_control_attitude", needs=(Legs,))
async def relatively_position_control_attitude(
    session: Session,
    centroid_x: float = 0.0,
    centroid_y: float = 0.0,
    centroid_z: float = 0.0,
    roll: float = 0.0,
    pitch: float = 0.0,
    yaw: float = 0.0,
    fulcrum_x: float = 0.0,
    fulcrum_y: float = 0.0,
    fulcrum_z: float = 0.0,
    duration: float = 1.0,
) -> Record:
    """Move the body by these amounts, turned about the fulcrum (m from its middle), within ``duration`` s."""
    wrong = _outside(centroid_x, centroid_y, centroid_z, roll, pitch, yaw, duration)
    wrong = wrong or outside(fulcrum_x=fulcrum_x, fulcrum_y=fulcrum_y, fulcrum_z=fulcrum_z)
    attitude = _attitude(roll, pitch, yaw)
    fulcrum = (fulcrum_x, fulcrum_y, fulcrum_z)
    # A turn about a fixed fulcrum moves the centre by the fulcrum minus the turned fulcrum.
    x, y, z = (was - is_now for was, is_now in zip(fulcrum, _turned(fulcrum, attitude), strict=True))
    body = BodyPose(centroid_z + z, attitude, Point(centroid_x + x, centroid_y + y))
    return await result(session, RELATIVE_POSITION, _hold(session, body, duration, relative=True), wrong)


def held(body: BodyPose, limits: LegLimits) -> BodyPose:
    """Return ``body``, clamped to the legs' limits."""
    turn, shift, height = body.attitude, body.shift, body.height
    return BodyPose(
        None if height is None else max(limits.lowest, min(limits.highest, height)),
        Orientation(*(bounded(angle, limits.angle) for angle in (turn.roll, turn.pitch, turn.yaw))),
        Point(bounded(shift.x, limits.shift), bounded(shift.y, limits.shift)),
    )


async def _hold(session: Session, body: BodyPose, duration: float, *, relative: bool = False) -> None:
    legs = session.robot[Legs]
    if not relative:
        body = held(body, legs.limits)
    await session.complete(legs.hold(body, duration=duration, relative=relative, source=session.source))


def _outside(x: float, y: float, z: float, roll: float, pitch: float, yaw: float, duration: float) -> str:
    return outside(
        centroid_x=x,
        centroid_y=y,
        relative_centroid_z=z,
        relative_roll=roll,
        relative_pitch=pitch,
        relative_yaw=yaw,
        duration=duration,
    )


def _attitude(roll: float, pitch: float, yaw: float) -> Orientation:
    return Orientation(math.radians(roll), math.radians(pitch), math.radians(yaw))


def _turned(point: tuple[float, float, float], by: Orientation) -> tuple[float, float, float]:
    """Return ``point`` turned about the fixed axes x, y, z in this order."""
    x, y, z = point
    y, z = _around(y, z, by.roll)
    z, x = _around(z, x, by.pitch)
    x, y = _around(x, y, by.yaw)
    return x, y, z


def _around(a: float, b: float, angle: float) -> tuple[float, float]:
    return a * math.cos(angle) - b * math.sin(angle), a * math.sin(angle) + b * math.cos(angle)
