"""cyberdog.motion: turning and walking, each in its gait (4.4.04).

Each gait limits its speed axis by axis; parameters outside of table 4.1 are refused. A body without legs drives
instead: it has no gait and lifts no feet.
"""

from __future__ import annotations

import math

from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.gaits import Gait
from roboglot.model.components.motion.legs import FootLift, Legs
from roboglot.model.components.motion.motion_status import check_on_floor
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Busy, InvalidGoal, RobotError
from roboglot.model.geometry import Pose, Twist
from roboglot.programs.functions.moving.limits import LIMITS, outside
from roboglot.programs.functions.moving.outcomes import servo
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

SINGLE_COMMAND = 0.2  # s of a walk without distance and duration
LOOK_EVERY = 0.02  # s
STUCK_AFTER = 2.0  # s without a centimetre of progress

# The firmware's number of each walk (response.motion_id) and its gait.
VARIABLE = 304
WALKS = {
    "trot_walking": (303, Gait.TROT_SLOW),
    "automatic_frequency_conversion_walking": (VARIABLE, Gait.TROT_ADAPTIVE),
    "run_fast_walking": (305, Gait.TROT_FAST),
}
JUMPS = {"jump_back_and_forth": (301, Gait.BOUND), "small_jump_walking": (302, Gait.PRONK)}


@ABILITIES.on("cyberdog.motion.turn", needs=(Driving,))
async def turn(session: Session, angle: float = 0.0, duration: float = 1.0) -> Record:
    """Turn by ``angle`` degrees (left positive) within ``duration`` s, or as fast as table 4.1 allows if longer."""
    wrong = outside(angle=angle, duration=duration)
    top = LIMITS["z_velocity"].maximum
    rate = min(abs(angle) / duration, top) if duration > 0 else top

    async def do() -> None:
        driving = session.robot[Driving]
        if angle:
            yaw, speed = math.radians(angle), math.radians(rate)
            await session.complete(driving.move_by(Pose(yaw=yaw), yaw_speed=speed, source=session.source))

    return await servo(session, VARIABLE, do(), wrong)


@ABILITIES.on("cyberdog.motion.go_straight", needs=(Base, Driving, Odometry))
async def go_straight(
    session: Session, x_velocity: float = 0.0, distance: float = 0.0, duration: float = 1.0
) -> Record:
    """Walk ahead (m/s, negative: back) for ``distance`` m, else for ``duration`` s."""
    wrong = outside(x_velocity=x_velocity, distance=distance, walk_duration=duration)
    return await servo(
        session, VARIABLE, _walk(session, Gait.TROT_ADAPTIVE, Twist(x_velocity), distance, duration), wrong
    )


@ABILITIES.on("cyberdog.motion.lateral_movement", needs=(Base, Driving, Odometry))
async def lateral_movement(
    session: Session, y_velocity: float = 0.0, distance: float = 0.0, duration: float = 1.0
) -> Record:
    """Walk to the left (m/s, negative: right) for ``distance`` m, else for ``duration`` s."""
    wrong = outside(y_velocity=y_velocity, distance=distance, walk_duration=duration)
    return await servo(
        session, VARIABLE, _walk(session, Gait.TROT_ADAPTIVE, Twist(y=y_velocity), distance, duration), wrong
    )


def _declare_walk(name: str, motion: int, gait: Gait) -> None:
    @ABILITIES.on(f"cyberdog.motion.{name}", needs=(Base, Driving, Odometry))
    async def walk(
        session: Session,
        x_velocity: float = 0.0,
        y_velocity: float = 0.0,
        z_velocity: float = 0.0,
        front_leg_lift: float = 0.03,
        back_leg_lift: float = 0.03,
        distance: float = 0.0,
        duration: float = 1.0,
    ) -> Record:
        """Walk (m/s; z in degrees/s, left positive) for ``distance`` m, else for ``duration`` s."""
        velocity = {"x_velocity": x_velocity, "y_velocity": y_velocity, "z_velocity": z_velocity}
        lift = FootLift(front_leg_lift, back_leg_lift)
        return await _walk_in_gait(session, motion, gait, velocity, lift, distance, duration)


def _declare_jump(name: str, motion: int, gait: Gait) -> None:
    @ABILITIES.on(f"cyberdog.motion.{name}", needs=(Base, Driving, Odometry))
    async def jump(
        session: Session,
        x_jump_velocity: float = 0.0,
        y_jump_velocity: float = 0.0,
        z_jump_velocity: float = 0.0,
        front_leg_lift: float = 0.03,
        back_leg_lift: float = 0.03,
        distance: float = 0.0,
        duration: float = 1.0,
    ) -> Record:
        """Walk in jumps (m/s; z in degrees/s, left positive) for ``distance`` m, else for ``duration`` s."""
        velocity = {
            "x_jump_velocity": x_jump_velocity,
            "y_jump_velocity": y_jump_velocity,
            "z_jump_velocity": z_jump_velocity,
        }
        lift = FootLift(front_leg_lift, back_leg_lift)
        return await _walk_in_gait(session, motion, gait, velocity, lift, distance, duration)


for _name, _of in WALKS.items():
    _declare_walk(_name, *_of)
for _name, _of in JUMPS.items():
    _declare_jump(_name, *_of)


async def _walk_in_gait(
    session: Session,
    motion: int,
    gait: Gait,
    velocity: dict[str, float],
    lift: FootLift,
    distance: float,
    duration: float,
) -> Record:
    """Walk unless a parameter is wrong. ``velocity``: ahead and to the left (m/s), turning (degrees/s), by name."""
    lifts = {"front_leg_lift": lift.front, "back_leg_lift": lift.rear}
    wrong = outside(**velocity, **lifts, distance=distance, walk_duration=duration)
    x, y, turn_rate = velocity.values()
    walk = _walk(session, gait, Twist(x, y, math.radians(turn_rate)), distance, duration, lift)
    return await servo(session, motion, walk, wrong)


async def _walk(
    session: Session, gait: Gait, twist: Twist, distance: float, duration: float, lift: FootLift | None = None
) -> None:
    """Walk for a distance (m, by odometry), else for a time (s), else for one command."""
    driving = session.robot[Driving]
    check_on_floor(session.robot)
    if distance > 0 and not twist.speed:
        raise InvalidGoal("a distance needs a velocity other than 0")
    if Legs in session.robot:
        session.robot[Legs].walk(gait, lift)
    if distance > 0 and not twist.yaw:
        way = distance / twist.speed
        move = driving.move_by(Pose(twist.x * way, twist.y * way), speed=twist.speed, source=session.source)
        await session.complete(move)
    elif distance > 0:
        await _walk_along(session, twist, distance)
    elif duration > 0:
        await session.hold(driving.drive(twist, source=session.source), duration)
        check_on_floor(session.robot)  # it may have been taken up meanwhile
    else:
        driving.drive(twist, lifetime=SINGLE_COMMAND, source=session.source)


async def _walk_along(session: Session, twist: Twist, distance: float) -> None:
    """Walk an arc of this length, m, by odometry. Raises RobotError if stuck."""
    odometry = session.robot[Odometry]
    top = session.robot[Base].limits.twist
    action = session.robot[Driving].drive(twist, source=session.source)
    start = best = odometry.reading.distance
    waited = 0.0
    patience = STUCK_AFTER + 0.1 / min(twist.speed, top.x)
    try:
        while (gone := odometry.reading.distance) - start < distance:
            if action.status.ended:
                raise action.error.again() if action.error else Busy(f"{action.name} was cancelled")
            best, waited = (gone, 0.0) if gone - best > 0.01 else (best, waited + LOOK_EVERY)
            if waited > patience:
                raise RobotError(f"stuck {distance - gone + start:.2f} m before the end")
            check_on_floor(session.robot)
            await session.sleep(LOOK_EVERY)
    finally:
        action.cancel()
    await action.done()
