"""Watches one robot for a recording: exchanges at its doors, events, sensor data and poses."""

from __future__ import annotations

import asyncio
import time
from typing import Any

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.lease import Lease
from roboglot.model.components.system.link import Link, is_current
from roboglot.model.events import ActionChanged, Event, ScanTaken
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.model.inputs.external import Input
from roboglot.model.robot import Robot
from roboglot.model.sensing import LaserScan
from roboglot.model.tap import Exchange
from roboglot.recording.entries import Entry, Put
from roboglot.recording.messages import plain
from roboglot.recording.readings import readings_of
from roboglot.recording.redaction import FILES, without_picture

POSE_PERIOD = 0.1  # s
CAMERA_PERIOD = 1.0  # s between two checks for a camera
STATE_BEATS = 10  # poses between two readings of values that change rarely
MAP_BEATS = 50


class Stamps:
    """Robot time as nanoseconds since 1970, and the machine's own time beside it."""

    def __init__(self, robot: Robot) -> None:
        self._clock = robot.clock
        self._epoch = round((robot.clock.epoch() - robot.clock.time()) * 1e6) * 1000

    def at(self, stamp: float) -> int:
        """Return a robot time (s) as ns since 1970."""
        return self._epoch + round(stamp * 1e9)

    def now(self) -> tuple[int, int]:
        """Return robot time and the machine's time, both in ns since 1970."""
        return self.at(self._clock.time()), time.time_ns()


class Sampler:
    """Samples one robot until ``close``."""

    def __init__(self, robot: Robot, put: Put, *, video: bool = False, photos: bool = False) -> None:
        """``video``: record the camera; ``photos``: record photos of a real robot, too."""
        self._robot, self._put, self._photos = robot, put, photos
        self._stamps = Stamps(robot)
        self._topic, self._pose_topic, self._scan_topic = f"/{robot.id}", f"/{robot.id}/pose", f"/{robot.id}/scan"
        self._map, self._odom, self._base, self._laser = (
            f"{robot.id}/{frame}" for frame in ("map", "odom", "base_link", "laser")
        )
        self._before: dict[str, object] = {}
        self._scan_mount: Pose = ORIGIN
        self._shown = False
        self._leave = [
            robot.tap.listen(self._note_exchange),
            robot.events.listen(Event, self._note_event),
            robot.inputs.listen(self._note_input),
        ]
        self._filming: asyncio.Task[None] | None = None
        self.film(video)

    def close(self) -> None:
        """Stop sampling and filming."""
        for leave in self._leave:
            leave()
        self.film(False)

    def film(self, on: bool) -> None:
        """Start or stop recording the camera; no effect if it is so already."""
        if on and self._filming is None:
            self._filming = asyncio.get_running_loop().create_task(self._film(), name="film")
        elif not on and self._filming is not None:
            self._filming.cancel()
            self._filming = None

    def again(self) -> None:
        """Report latched values again, as another recording begins."""
        self._before.clear()
        self._shown = False

    def beat(self, number: int, put: Put | None = None) -> None:
        """Sample poses; every ``STATE_BEATS`` beats the other values, too. ``put`` gets them, if given."""
        at, wall = self._stamps.now()
        self._note_places(at, wall, put or self._put)
        if number % STATE_BEATS == 0:
            self._note_state(at, wall)
        if number % MAP_BEATS == 0:
            self._note_map(at, wall)

    def _send(self, topic: str, kind: str, value: object, at: int, wall: int) -> None:
        self._put(Entry(f"{self._topic}/{topic}", kind, at, wall, value))

    # -- events --

    def _note_exchange(self, exchange: Exchange) -> None:
        if not self._photos and exchange.operation in FILES and Link in self._robot:  # it is a real one
            exchange = without_picture(exchange)
        self._send(exchange.door, "exchange", exchange, self._stamps.at(exchange.stamp), time.time_ns())

    def _note_input(self, given: Input) -> None:
        self._send("inputs", "input", given, self._stamps.at(given.stamp), time.time_ns())

    def _note_event(self, event: Event) -> None:
        if isinstance(event, ScanTaken):
            self._note_scan(event.scan, time.time_ns())
            return
        at, wall = self._stamps.now()
        match event:
            case ActionChanged():
                self._send("actions", "action", _action(event), at, wall)
            case _:
                self._send("events", "event", {"event": type(event).__name__, **plain(event)}, at, wall)

    def _note_scan(self, scan: LaserScan, wall: int) -> None:
        at, self._scan_mount = self._stamps.at(scan.stamp), scan.mount
        self._send_changed("lidar", "lidar", self._limits_of(scan), at, wall)
        self._put(Entry(self._scan_topic, "scan", at, wall, (self._laser, scan)))

    def _limits_of(self, scan: LaserScan) -> dict[str, float]:
        """Return what Foxglove's message of a scan has no fields for: m, s from ray to ray, and turns a second."""
        return {
            "range_min": scan.range_min,
            "range_max": scan.range_max,
            "clear_range": scan.clear_range,
            "time_increment": scan.time_increment,
            "rate": self._robot[Lidar].rate if Lidar in self._robot else 0.0,
        }

    async def _film(self) -> None:
        from roboglot.media.video import VideoStream  # the libraries are an extra

        while VideoStream not in self._robot:  # a real robot's video appears with its link
            await self._robot.clock.sleep(CAMERA_PERIOD)
        frame = f"{self._robot.id}/camera"
        with self._robot[VideoStream].subscribe() as packets:
            async for packet in packets:
                at, wall = self._stamps.now()
                self._send("camera", "video", (frame, packet.data), at, wall)

    # -- readings --

    def _note_places(self, at: int, wall: int, put: Put) -> None:
        robot = self._robot
        if not is_current(robot):
            return
        odometry = robot[Odometry].reading.pose if Odometry in robot else None
        pose = robot[Localization].pose if Localization in robot else None
        if pose is not None:
            put(Entry(self._pose_topic, "pose", at, wall, (self._map, pose)))
        if (place := odometry or pose) is None:
            return
        frames = [(self._odom, self._base, place), (self._base, self._laser, self._scan_mount)]
        if pose is not None:
            origin = ORIGIN if odometry is None else pose.compose(odometry.inverse())
            frames.insert(0, (self._map, self._odom, origin))
        put(Entry("/tf", "transforms", at, wall, tuple(frames)))

    def _note_state(self, at: int, wall: int) -> None:
        robot = self._robot
        if not self._shown:
            self._shown = True
            plate = robot.description
            figure = (robot.id, self._base, ORIGIN, plate.radius, plate.height, True)
            self._send("body", "scene", (figure,), at, wall)
        if Battery in robot and is_current(robot):
            self._send_changed("battery", "battery", plain(robot[Battery].state), at, wall)
        for topic, reading in readings_of(robot) if is_current(robot) else ():
            self._send(topic, topic, plain(reading), at, wall)
        if Health in robot:
            self._send_changed("faults", "state", {"faults": plain(robot[Health].faults)}, at, wall)
        if Lease in robot:
            lease = robot[Lease]
            holder = lease.holder
            control = {"holder": holder.who if holder else "", "taken_by": lease.taken_by}
            self._send_changed("control", "state", control, at, wall)
        if Link in robot:
            link = robot[Link]
            self._send_changed("link", "state", {"state": str(link.state), "reason": link.reason}, at, wall)

    def _note_map(self, at: int, wall: int) -> None:
        if Mapping in self._robot:
            mapping = self._robot[Mapping]
            if self._before.get("map") != mapping.revision and (grid := mapping.grid).width:
                self._before["map"] = mapping.revision
                self._send("map", "grid", (self._map, grid), at, wall)

    def _send_changed(self, topic: str, kind: str, value: object, at: int, wall: int) -> None:
        if self._before.get(topic) != value:
            self._before[topic] = value
            self._send(topic, kind, value, at, wall)


def _action(event: ActionChanged) -> dict[str, object]:
    """Return a copy of an action's state, as the action itself changes later."""
    action: Any = event.action
    return {
        "id": action.id,
        "name": action.name,
        "status": action.status.name.lower(),
        "source": action.source,
        "client": action.client,
        "reason": action.reason,
        "paused": action.paused,
        "goal": plain(action.goal),
        "feedback": plain(action.feedback),
    }
