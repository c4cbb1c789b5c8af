"""``roboglot mirror URL``: live state of a real robot, or of another roboglot, in the terminal. Moves nothing."""

from __future__ import annotations

import asyncio
import contextlib
import math
import sys
from collections.abc import Callable
from typing import Annotated

import typer
from rich.live import Live
from rich.table import Table
from rich.text import Text

from roboglot.drivers.urls import Drivers
from roboglot.hosting.escaping import in_line
from roboglot.model.clock import RealClock
from roboglot.model.components.component import Component
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link, LinkState, is_current
from roboglot.model.errors import RobotError
from roboglot.model.geometry import Pose
from roboglot.model.robot import Description, Robot

PERIOD = 0.2  # s between two pictures
PIPE_PERIOD = 1.0  # s between two looks where there is no terminal
CONNECT_SECONDS = 12.0  # for --once; a dog that does not call back is given up after 10
AGES = ("last news", "old")
UNKNOWN = Description(maker="", model="", serial="", hardware_version="", software_version="", radius=0.25, height=0.3)


def command(
    url: Annotated[str, typer.Argument(help="slamware://HOST, robomaster://HOST …; as `roboglot scan` prints them.")],
    once: Annotated[bool, typer.Option("--once", help="Print the state once and end.")] = False,
) -> None:
    """Show the live state of a robot until Ctrl-C; in a pipe, each value that has changed within a second."""
    with contextlib.suppress(KeyboardInterrupt):
        sys.exit(asyncio.run(_mirror(url, once)))


async def _mirror(url: str, once: bool) -> int:
    robot, drivers = Robot("mirrored", UNKNOWN, RealClock()), Drivers(touches=False)
    try:
        drivers.add(robot, url)
    except ValueError as error:
        print(f"roboglot mirror: {error}", file=sys.stderr)
        return 1
    (driver,) = drivers.all
    await driver.start(wait=False)
    try:
        if once:
            return await _once(robot)
        return await (_live(robot) if sys.stdout.isatty() else _print_changes(robot))
    finally:
        await driver.close()


async def _once(robot: Robot) -> int:
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(CONNECT_SECONDS):
            while robot[Link].state is not LinkState.UP:  # noqa: ASYNC110 - a few looks
                await asyncio.sleep(0.05)
            await asyncio.sleep(0.5)  # pushes arrive a little later
    for name, words in rows(robot):
        print(in_line(f"{name:14} {words}"))
    return 0 if robot[Link].state is LinkState.UP else 1


async def _live(robot: Robot) -> int:
    with Live(refresh_per_second=1 / PERIOD) as screen:
        while True:
            table = Table(title=robot[Link].address, show_header=False, min_width=60)
            for name, words in rows(robot):
                table.add_row(name, Text(in_line(words)))  # no markup
            screen.update(table)
            await asyncio.sleep(PERIOD)


async def _print_changes(robot: Robot) -> int:
    shown: dict[str, str] = {}
    while True:
        for name, words in changes(robot, shown):
            print(in_line(f"{name:14} {words}"), flush=True)
        await asyncio.sleep(PIPE_PERIOD)


def changes(robot: Robot, shown: dict[str, str]) -> list[tuple[str, str]]:
    """Return the values, without their ages, that differ from those ``shown``, and add them there."""
    found = [row for row in rows(robot) if row[0] not in AGES and shown.get(row[0]) != row[1]]
    shown.update(found)
    return found


def rows(robot: Robot) -> list[tuple[str, str]]:
    """Return the current values in words, with the age of stale ones."""
    plate, link = robot.description, robot[Link]
    values = [
        ("robot", f"{plate.maker} {plate.model} {plate.software_version}".strip() or "?"),
        ("link", f"{link.state}{': ' if link.reason else ''}{link.reason}"),
        ("last news", "never" if math.isinf(link.age()) else f"{link.age():.2f} s ago"),
    ]
    if math.isinf(link.age()):
        return values
    values.append(("moved by", link.holder or "no client"))
    for name, interface, words in VALUES:
        if interface in robot:
            try:
                values.append((name, words(robot)))
            except RobotError as error:
                values.append((name, str(error)))
    old = ", ".join(f"{what} {age:.1f} s" for what, age in link.ages.items() if age > 10)
    if old:
        values.append(("old", old))
    return values


def _pose(pose: Pose) -> str:
    return f"x {pose.x:+z.2f} m  y {pose.y:+z.2f} m  yaw {math.degrees(pose.yaw):+z.0f}°"


def _battery(robot: Robot) -> str:
    state = robot[Battery].state
    docked = DockContact in robot and robot[DockContact].docked
    return f"{state.percentage:.0%}{' charging' if state.charging else ''}{' on the dock' if docked else ''}"


def _twist(robot: Robot) -> str:
    if not is_current(robot):
        return "unknown"
    twist = robot[Odometry].reading.twist
    return f"{twist.x:+z.2f} m/s ahead  {twist.y:+z.2f} m/s left  {math.degrees(twist.yaw):+z.0f}°/s"


def _map(robot: Robot) -> str:
    grid = robot[Mapping].grid
    return f"{grid.width * grid.resolution:.1f} x {grid.height * grid.resolution:.1f} m"


def _scan(robot: Robot) -> str:
    scan = robot[Lidar].scan
    return "none yet" if scan is None else f"{len(scan.ranges)} points, nearest {scan.ranges.min():.2f} m"


def _attitude(robot: Robot) -> str:
    tilt = robot[Imu].reading.orientation
    return f"roll {math.degrees(tilt.roll):+z.0f}°  pitch {math.degrees(tilt.pitch):+z.0f}°"


def _gimbal(robot: Robot) -> str:
    angles = robot[Gimbal].angles
    return f"pitch {-math.degrees(angles.pitch):+z.0f}° up  yaw {math.degrees(angles.yaw):+z.0f}° left"


VALUES: tuple[tuple[str, type[Component], Callable[[Robot], str]], ...] = (
    ("in the map", Localization, lambda robot: _pose(robot[Localization].pose)),
    ("by odometry", Odometry, lambda robot: _pose(robot[Odometry].reading.pose)),
    ("speed", Odometry, _twist),
    ("battery", Battery, _battery),
    ("tilt", Imu, _attitude),
    ("gimbal", Gimbal, _gimbal),
    ("scan", Lidar, _scan),
    ("map", Mapping, _map),
    ("faults", Health, lambda robot: "; ".join(fault.message for fault in robot[Health].faults) or "none"),
)
