"""Telemetry of an EP: receives pushes at 50 Hz and polls the rest, and updates the model."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Awaitable, Callable, Sequence

from roboglot.clients.errors import LinkLost, RefusedByRobot
from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.linked_base import LATENCY_SMOOTHING
from roboglot.drivers.robomaster.state import ReportedState
from roboglot.drivers.robomaster.vocabulary import (
    HITS,
    PLATES,
    angles_of,
    flags_of,
    orientation_of,
    pose_of,
    twist_of,
    wheels_of,
)
from roboglot.hosting.event_loop import together
from roboglot.model.components.system.link import Link
from roboglot.model.events import ArmorHit, BatteryChanged
from roboglot.model.geometry import ORIGIN, Orientation, Pose, Vector3, wrap_angle
from roboglot.model.robot import Robot
from roboglot.model.sensing import BatteryState, ImuReading, OdometryReading
from roboglot.values import dataclass
from roboglot.wire.robomaster import telemetry
from roboglot.wire.robomaster.telemetry import Telemetry

Refresh = Callable[[], Awaitable[None]]

PUSH_RATE = 50  # Hz
SPEED_PERIOD = 0.05  # s
BATTERY_EVERY, HEADING_EVERY, PARTS_EVERY = 20, 10, 2  # speeds
STEADY = 0.1  # rad/s: below this two consecutive answers report the same heading
SILENCE_MAX = 0.4  # s without any push until the link counts as lost
GRAVITY = 9.81  # m/s2


@dataclass(frozen=True, slots=True)
class PushedParts:
    """Optional pushes that the robot sends: our door in front of another robot may lack some."""

    attitude: bool = True
    status: bool = True
    gimbal: bool = True


class TelemetryListener:
    """Telemetry of one robot. ``parts``: what it pushes besides its position."""

    def __init__(
        self,
        robot: Robot,
        client: RoboMasterClient,
        link: Link,
        reported: ReportedState,
        refreshed: Sequence[Callable[[], Awaitable[None]]],
    ) -> None:
        self._robot, self._client, self._link, self._reported, self._refreshed = (
            robot,
            client,
            link,
            reported,
            refreshed,
        )
        self._forget: Callable[[], None] = lambda: None
        self._yaw = 0.0  # yaw of the position minus that of the attitude
        self._pushed = False  # whether this connection has received any push
        self.parts = PushedParts()

    async def begin(self) -> None:
        """Subscribe to pushes and poll everything once. Raises ClientError."""
        client, parts = self._client, self.parts
        self._forget()
        self._forget = client.listen(self._on_push)
        self._pushed = False
        await self._ask_battery()
        if parts.attitude:
            self._on_attitude(await client.chassis.get_attitude())
        self._moved(await self._ask_heading())
        await self._ask_speed()
        await client.chassis.push(
            position=True, attitude=parts.attitude or None, status=parts.status or None, freq=PUSH_RATE
        )
        if parts.gimbal:
            await client.gimbal.push(True, PUSH_RATE)

    async def run(self) -> None:
        """Run until the link breaks. Raises LinkLost."""
        await together(self._ask(), self._watch_silence())

    async def _ask(self) -> None:
        count = 0
        async for _ in self._robot.clock.every(SPEED_PERIOD):
            await self._ask_speed()
            count += 1
            if count % PARTS_EVERY == 0:
                for refresh in self._refreshed:
                    with contextlib.suppress(RefusedByRobot):  # the sensor is unplugged: its last reading ages
                        await refresh()
            steady = count % HEADING_EVERY == 0 and abs(self._reported.twist.yaw) < STEADY
            if steady or not self.parts.attitude:
                await self._ask_heading()
            if count % BATTERY_EVERY == 0:
                await self._ask_battery()

    async def _watch_silence(self) -> None:
        async for _ in self._robot.clock.every(SPEED_PERIOD):
            if self._link.age("position") > SILENCE_MAX:
                raise LinkLost(self._silence())

    def _silence(self) -> str:
        if self._pushed:
            return "the robot's pushes have stopped"
        return f"none of the robot's pushes arrive: let UDP port {self._client.push_port} of this machine be reached"

    def close(self) -> None:
        """Stop listening."""
        self._forget()

    async def _ask_speed(self) -> None:
        asked = self._robot.clock.time()
        speed = await self._client.chassis.get_speed()
        self._reported.latency += LATENCY_SMOOTHING * (self._robot.clock.time() - asked - self._reported.latency)
        self._reported.twist, self._reported.wheels = twist_of(speed), wheels_of(speed, self._client.as_robots)
        self._link.note_update("speed")

    async def _ask_heading(self) -> Pose:
        """Measure the yaw between position and attitude: they are zeroed at different times and the attitude drifts.

        Odometry uses the frame of the position. Its pushes carry no yaw, so the yaw comes from the attitude; from a
        robot without one it is polled.
        """
        pose = pose_of(await self._client.chassis.get_position())
        self._yaw = wrap_angle(pose.yaw - self._reported.imu.orientation.yaw)
        return pose

    async def _ask_battery(self) -> None:
        """Poll the charge; the text protocol reports neither voltage nor charging."""
        before, percent = self._reported.battery.percentage, await self._client.robot.get_battery()
        self._reported.battery = BatteryState(percent / 100, 0.0, 0.0, 0.0, False, 0)
        self._link.note_update("battery")
        if round(before * 100) != percent:
            stamp = self._robot.clock.time()
            self._robot.events.publish(BatteryChanged(stamp=stamp, percentage=percent / 100, charging=False))

    def _on_push(self, push: Telemetry) -> None:
        stamp = self._robot.clock.time()
        match push:
            case telemetry.ChassisPosition():
                self._pushed = True
                yaw = wrap_angle(self._reported.imu.orientation.yaw + self._yaw)
                self._moved(Pose(push.x, -push.y, yaw))
            case telemetry.ChassisAttitude():
                self._on_attitude(push)
            case telemetry.ChassisStatus():
                self._reported.flags = flags_of(push)
                self._link.note_update("status")
            case telemetry.GimbalAttitude():
                self._reported.gimbal = angles_of(push)
                self._link.note_update("gimbal")
            case telemetry.ArmorHit(index, kind) if index in PLATES and kind in HITS:
                self._robot.events.publish(ArmorHit(stamp=stamp, place=PLATES[index], kind=HITS[kind]))
            case _:
                return

    def _moved(self, pose: Pose) -> None:
        before = self._reported.odometry
        way = before.pose.distance_to(pose) if before.stamp or before.pose != ORIGIN else 0.0
        stamp = self._robot.clock.time()
        self._reported.odometry = OdometryReading(stamp, pose, self._reported.twist, before.distance + way)
        self._link.note_update("position")

    def _on_attitude(self, attitude: telemetry.ChassisAttitude) -> None:
        """Derive rates from two pushes; the acceleration is gravity alone, as for a robot at rest."""
        before, stamp, now = self._reported.imu, self._robot.clock.time(), orientation_of(attitude)
        seconds = stamp - before.stamp
        rates = _rates(before.orientation, now, seconds) if 0 < seconds < 1 else Vector3()
        gravity = Vector3(
            -GRAVITY * math.sin(now.pitch),
            GRAVITY * math.cos(now.pitch) * math.sin(now.roll),
            GRAVITY * math.cos(now.pitch) * math.cos(now.roll),
        )
        self._reported.imu = ImuReading(stamp, now, rates, gravity)
        self._link.note_update("attitude")


def _rates(before: Orientation, now: Orientation, seconds: float) -> Vector3:
    return Vector3(
        wrap_angle(now.roll - before.roll) / seconds,
        wrap_angle(now.pitch - before.pitch) / seconds,
        wrap_angle(now.yaw - before.yaw) / seconds,
    )
