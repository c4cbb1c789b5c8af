"""Polled status of a dog (1001): network, battery, motors, volume, low power."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from typing import Any

from roboglot.clients.cyberdog import CyberDogClient, NoAnswer
from roboglot.drivers.capabilities import ABSENT
from roboglot.drivers.cyberdog.state import ReportedState
from roboglot.drivers.reported_network import ReportedNetwork
from roboglot.model.components.motion.motors import Motors
from roboglot.model.components.system.link import Link
from roboglot.model.components.system.network import NetworkMode
from roboglot.model.robot import Robot
from roboglot.wire.cyberdog.chapters.system import LEGS

UNSUPPORTED = (*ABSENT, NoAnswer)  # errors for functions that a dog lacks
PERIOD = 2.0  # s between two polls
TOPICS = ("wifi", "bat_info", "motor_temper", "volume", "lowpower_control")
JOINTS = {"hip": "hip", "thigh": "thigh", "crus": "knee"}


class CyberDogMotors(Motors):
    """Temperatures of the twelve motors, polled every two seconds."""

    def __init__(self) -> None:
        self.warm: dict[str, float] = {}

    @property
    def temperatures(self) -> Mapping[str, float]:
        return self.warm


class StatusPoll:
    """Polls ``motors``, ``network``, ``volume`` (percent; None if silent) and ``saves`` (automatic low power)."""

    def __init__(self, robot: Robot, client: CyberDogClient, link: Link, reported: ReportedState) -> None:
        self._client, self._clock, self._link, self._reported = client, robot.clock, link, reported
        self.motors, self.network = CyberDogMotors(), ReportedNetwork(robot)
        self.volume: int | None = None
        self.saves = False

    async def ask(self) -> None:
        """Poll once. Raises ClientError."""
        reply = await self._client.information(*TOPICS)
        with contextlib.suppress(TypeError, ValueError, AttributeError):
            self._take_battery(reply.get("bat_info") or {})
        with contextlib.suppress(TypeError, ValueError, AttributeError):
            self._take_network(reply.get("wifi") or {})
        with contextlib.suppress(TypeError, ValueError, AttributeError):
            self.motors.warm = temperatures_of(reply.get("motor_temper") or {})
        volume = reply.get("volume")
        self.volume = volume if isinstance(volume, int) and 0 <= volume <= 100 else None
        self.saves = reply.get("lowpower_control") is True
        self._link.note_update("condition")

    async def run(self) -> None:
        """Poll every two seconds. Raises LinkLost; unanswered values age."""
        async for _ in self._clock.every(PERIOD):
            with contextlib.suppress(*UNSUPPORTED):
                await self.ask()

    def _take_network(self, reply: Mapping[str, Any]) -> None:
        beat = self._client.heartbeat
        internet = beat is not None and beat.internet
        name, address, mac = (str(reply.get(key) or "") for key in ("name", "ip", "mac"))
        self.network.take(NetworkMode.STATION, name, address, mac, float(reply.get("strength") or 0), internet=internet)

    def _take_battery(self, reply: Mapping[str, Any]) -> None:
        if reply:
            self._reported.battery_details = {
                "voltage": float(reply["voltage"]) / 1000,
                "temperature": float(reply["temperature"]),
                "capacity": float(reply["capacity"]) / 1000,
                "remaining": float(reply["discharge_time"]) * 60 or None,
            }


def temperatures_of(reply: Mapping[str, object]) -> dict[str, float]:
    """Return temperatures (degrees Celsius) by motor name; missing motors are left out."""
    warm = {}
    for joint, name in JOINTS.items():
        values = reply.get(joint)
        for leg, value in zip(LEGS, values if isinstance(values, list) else (), strict=False):
            with contextlib.suppress(TypeError, ValueError):
                warm[f"{leg} {name}"] = float(value)
    return warm
