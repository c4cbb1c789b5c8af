"""cyberdog.odometer, cyberdog.imu and cyberdog.lidar (4.4.14, 4.4.16, 4.4.17)."""

from __future__ import annotations

import math
from collections.abc import Callable

from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.link import require_current
from roboglot.model.geometry import Orientation, Vector3
from roboglot.programs.functions.results import header, point, quaternion, vector
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

TIMEOUT_MAX = 300  # s
LOOK_EVERY = 0.02  # s


@ABILITIES.on("cyberdog.odometer.data", needs=(Odometry,))
async def odometer(session: Session) -> Record:
    """Odometry (attribute): pose in odom, m; twist in base_link, m/s and rad/s. Zero covariances mean unknown."""
    require_current(session.robot)
    reading = session.robot[Odometry].reading
    pose, twist = reading.pose, reading.twist
    turned = quaternion(Orientation(yaw=pose.yaw))
    linear, angular = vector(Vector3(twist.x, twist.y)), vector(Vector3(z=twist.yaw))
    return Record(
        "Odometry",
        {
            "header": header(epoch(session, reading.stamp), "odom"),
            "child_frame_id": "base_link",
            "pose": Record(
                "PoseWithCovariance",
                {"pose": Record("Pose", {"position": point(pose.x, pose.y), "orientation": turned})},
            ),
            "twist": Record("TwistWithCovariance", {"twist": Record("Twist", {"linear": linear, "angular": angular})}),
        },
    )


@ABILITIES.on("cyberdog.imu.data", needs=(Imu,))
async def imu(session: Session) -> Record:
    """Imu (attribute): attitude, rad/s and m/s2 (gravity included) in base_link. Zero covariances mean unknown."""
    require_current(session.robot)
    reading = session.robot[Imu].reading
    return Record(
        "Imu",
        {
            "header": header(epoch(session, reading.stamp), "base_link"),
            "orientation": quaternion(reading.orientation),
            "angular_velocity": vector(reading.angular_velocity),
            "linear_acceleration": vector(reading.linear_acceleration),
        },
    )


@ABILITIES.on("cyberdog.lidar.data", needs=(Lidar,))
async def lidar(session: Session) -> Record:
    """LaserScan (attribute): m, rad counter-clockwise from straight ahead; inf without an echo.

    Before the first turn all fields have their defaults and ``cyberdog.lidar.state`` says no_data_update.
    """
    part = session.robot[Lidar]
    scan = part.scan
    if scan is None:
        return Record("LaserScan")
    ranges = [float(distance) for distance in scan.ranges]
    return Record(
        "LaserScan",
        {
            "header": header(epoch(session, scan.stamp), "lidar"),
            "angle_min": scan.angle_min,
            "angle_max": scan.angle_min + scan.angle_increment * max(0, len(ranges) - 1),
            "angle_increment": scan.angle_increment,
            "time_increment": 1.0 / part.rate / max(1, len(ranges)),
            "scan_time": 1.0 / part.rate,
            "range_min": scan.range_min,
            "range_max": scan.range_max,
            "ranges": ranges,
        },
    )


@ABILITIES.on("cyberdog.odometer.get_data", needs=(Odometry,))
async def next_odometry(session: Session, timeout: int = 5) -> Record:
    """Return the next Odometry, or the last known one after ``timeout`` seconds."""
    part = session.robot[Odometry]
    await newer(session, lambda: part.reading.stamp, timeout)
    return await odometer(session)


@ABILITIES.on("cyberdog.imu.get_data", needs=(Imu,))
async def next_imu(session: Session, timeout: int = 5) -> Record:
    """Return the next Imu, or the last known one after ``timeout`` seconds."""
    part = session.robot[Imu]
    await newer(session, lambda: part.reading.stamp, timeout)
    return await imu(session)


@ABILITIES.on("cyberdog.lidar.get_data", needs=(Lidar,))
async def next_scan(session: Session, timeout: int = 5) -> Record:
    """Return the next LaserScan, or the last known one after ``timeout`` seconds."""
    part = session.robot[Lidar]
    await newer(session, lambda: part.scan.stamp if part.scan else -math.inf, timeout)
    return await lidar(session)


async def newer(session: Session, stamp: Callable[[], float], timeout: int) -> None:
    """Wait for a newer reading than the current one, at most ``timeout`` seconds."""
    present, until = stamp(), session.awake + min(timeout, TIMEOUT_MAX)
    while stamp() == present and session.awake < until:
        await session.sleep(LOOK_EVERY)


def epoch(session: Session, stamp: float) -> float:
    """Return a moment of robot time as Unix time, both in s."""
    clock = session.robot.clock
    return clock.epoch() - clock.time() + stamp
