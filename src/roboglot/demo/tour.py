"""The tour: each client in turn finds free space, drives there, and all four say where the robot is now."""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import Awaitable, Callable
from itertools import pairwise
from pathlib import Path

from roboglot.demo.clients.phone import Phone
from roboglot.demo.clients.robomaster import RoboMasterClient
from roboglot.demo.clients.slamware import SlamwareClient
from roboglot.demo.picture import Track, draw
from roboglot.demo.reports import Report, agree, apart, from_cyberdog, from_program, from_robomaster, from_slamware
from roboglot.model.geometry import Point, Pose, wrap_angle
from roboglot.model.maps import OccupancyGrid
from roboglot.wire.slamware.chapters.slam.explore_map import decode_explore_map

HALF_WIDTH = 0.45  # m that must be free on either side of the route
WAY_MAX = 2.5  # m: the longest drive of a client
AHEAD = 1.2  # m that must be free beyond the goal
STEP = 0.5  # m: the steps of a client without sensors
LEG_MIN = 0.2  # m below which the drive proves nothing
TRIES = 3
LOOKS_MAX = 12  # while a person is in the way
CLEAR = 1.4  # m that must be free before such a step, since people may approach meanwhile
BEND = 0.4  # m of free room that justify a bend of one rad: straight drives cannot reveal wrong signs
BACK = math.radians(120)  # routes that lead back are the last choice

WHERE = """
cyberdog.task.block('where am I');
p = cyberdog.odometer.data.pose.pose
cyberdog.task.block('%.4f %.4f %.4f %.4f' % (p.position.x, p.position.y, p.orientation.z, p.orientation.w));
"""
TURN = """
cyberdog.task.block('stand up');
cyberdog.motion.resume_standing();
cyberdog.task.block('turn');
cyberdog.motion.turn({degrees:.1f}, 1);
"""
WALK = """
cyberdog.task.block('walk');
cyberdog.motion.go_straight(0.4, {distance:.2f}, 0);
"""


class Tour:
    """Connect with ``open``, drive with ``run``; ``say`` gets every line for people."""

    def __init__(self, address: str, phone: Phone, say: Callable[[str], None]) -> None:
        self._rest = SlamwareClient(address)
        self._master = RoboMasterClient(address)
        self._phone = phone
        self._say = say
        self._tracks: dict[str, list[tuple[float, float]]] = {}

    async def close(self) -> None:
        """Hang up on all lines."""
        await self._rest.close()
        await self._master.close()

    async def run(self) -> bool:
        """Four legs; True if all reports agreed after each."""
        await self._rest.wait_for_map()
        await self._phone.relocalise()
        agreed = [
            await self._leg("Slamware REST: MoveTo", self._by_rest),
            await self._leg("RoboMaster text: chassis move, by robomasterpy", self._by_text),
            await self._leg("CyberDog gRPC: AB navigation", self._by_phone),
            await self._leg("block program: turn and walk", self._by_program),
        ]
        await self._phone.leave_navigation()
        return all(agreed)

    async def picture(self, path: Path, title: str) -> None:
        """Draw the robot's map and the clients' tracks."""
        explored = decode_explore_map(await self._rest.map())
        grid = OccupancyGrid(-explored.cells, explored.resolution, Point(explored.x, explored.y))
        tracks: dict[str, Track] = {name.partition(":")[0]: track for name, track in self._tracks.items()}
        draw(grid, tracks, title, path)

    async def _leg(self, name: str, drive: Callable[[float, float], Awaitable[None]]) -> bool:
        """Let one client drive to where there is room, then compare what all say."""
        track = self._tracks[name] = []
        watching = asyncio.ensure_future(self._watch(track))
        try:
            for _ in range(TRIES):
                angle, distance = free_way(await self._rest.scan())
                self._say(f"\n{name}: {distance:.1f} m at {math.degrees(angle):.0f}°")
                await drive(angle, distance)
                if length(track) >= LEG_MIN:
                    break
            await asyncio.sleep(0.7)  # wait for another scan at standstill
        finally:
            watching.cancel()
            await asyncio.wait([watching])
        reports = [
            from_slamware(*await self._rest.pose()),
            from_robomaster(*await self._master.position()),
            from_cyberdog(*await self._phone.pose()),
            from_program(await self._phone.run(WHERE)),
        ]
        return self._compare(reports, length(track))

    def _compare(self, reports: list[Report], leg: float) -> bool:
        for report in reports:
            self._say(f"  {report.protocol:14} {report.words}")
        metres, degrees = apart(reports)
        driven = sum(map(length, self._tracks.values()))
        good = agree(reports, driven)
        verdict = "they agree" if good else "THEY DISAGREE"
        self._say(f"  {verdict}: at most {metres * 100:.1f} cm and {degrees:.1f}° apart after {driven:.1f} m")
        if leg < LEG_MIN:
            self._say("  but the way stayed blocked, and nothing was driven")
        return good and leg >= LEG_MIN

    async def _watch(self, track: list[tuple[float, float]]) -> None:
        """Record the pose while the robot drives, as a dashboard would."""
        with contextlib.suppress(asyncio.CancelledError):
            while True:
                x, y, _ = await self._rest.pose()
                track.append((x, y))
                await asyncio.sleep(0.1)

    async def _by_rest(self, angle: float, distance: float) -> None:
        goal = Pose(*await self._rest.pose()).compose(Pose(yaw=angle)).compose(Pose(distance))
        await self._rest.move_to(goal.x, goal.y, goal.yaw)

    async def _by_text(self, angle: float, distance: float) -> None:
        await self._master.turn(angle)
        await self._step_by_step(self._master.ahead, distance)

    async def _by_phone(self, angle: float, distance: float) -> None:
        goal = Pose(*await self._phone.pose()).compose(Pose(yaw=angle)).compose(Pose(distance))
        await self._phone.navigate(goal.x, goal.y, goal.yaw)

    async def _by_program(self, angle: float, distance: float) -> None:
        await self._phone.run(TURN.format(degrees=math.degrees(angle)))
        await self._step_by_step(lambda step: self._phone.run(WALK.format(distance=step)), distance)

    async def _step_by_step(self, go: Callable[[float], Awaitable[object]], distance: float) -> None:
        """Two of the protocols drive blindly: look before each step; people may pass."""
        for _ in range(math.ceil(distance / STEP)):
            looks = 0
            while room(await self._rest.scan(), 0.0) < CLEAR:
                if (looks := looks + 1) > LOOKS_MAX:
                    self._say("  the way stays blocked: this is far enough")
                    return
                await asyncio.sleep(0.3)
            await go(distance / math.ceil(distance / STEP))


def length(track: Track) -> float:
    """Metres along it."""
    return sum(math.dist(a, b) for a, b in pairwise(track))


def free_way(scan: list[tuple[float, float]]) -> tuple[float, float]:
    """Return a free direction, with a bend if possible: rad from ahead, and the distance (m); back only if needed."""
    best = (-math.inf, 0.0, 0.0)
    for degrees in range(-180, 180, 10):
        angle = math.radians(degrees)
        free = room(scan, angle)
        merit = free + BEND * min(abs(angle), math.radians(70)) - (3.0 if abs(angle) > BACK else 0.0)
        best = max(best, (merit, angle, min(WAY_MAX, free - AHEAD)))
    return best[1], max(0.3, best[2])


def room(scan: list[tuple[float, float]], angle: float) -> float:
    """Metres free towards ``angle`` (rad from ahead), ``HALF_WIDTH`` to each side, as far as it matters."""
    free = WAY_MAX + AHEAD
    for bearing, distance in scan:
        off = wrap_angle(bearing - angle)
        if abs(off) < math.pi / 2 and abs(distance * math.sin(off)) < HALF_WIDTH:
            free = min(free, distance * math.cos(off))
    return free
