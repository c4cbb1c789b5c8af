"""What a dog tells when it is asked (1001): its network, battery, motors, volume, low power."""

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

UNTOLD = (*ABSENT, NoAnswer)  # how dogs are silent about what they do not have
PERIOD = 2.0  # s between two questions
TOPICS = ("wifi", "bat_info", "motor_temper", "volume", "lowpower_control")
LEGS = ("left front", "right front", "left rear", "right rear")
JOINTS = {"hip": "hip", "thigh": "thigh", "crus": "knee"}


class CyberDogMotors(Motors):
    """Twelve, asked every two seconds."""

    def __init__(self) -> None:
        self.warm: dict[str, float] = {}

    @property
    def temperatures(self) -> Mapping[str, float]:
        return self.warm


class StatusPoll:
    """``motors``, ``volume`` (percent; None: it has no loudspeaker), ``saves``: whether it goes to low power alone."""

    def __init__(self, robot: Robot, client: CyberDogClient, link: Link, reported: ReportedState) -> None:
        self._client, self._clock, self._link, self._reported = client, robot.clock, link, reported
        self.motors, self.network = CyberDogMotors(), ReportedNetwork(robot)
        self.volume: int | None = None
        self.saves = False

    async def ask(self) -> None:
        """Once. Raises ClientError."""
        told = await self._client.information(*TOPICS)
        with contextlib.suppress(TypeError, ValueError, AttributeError):
            self._take_battery(told.get("bat_info") or {})
        with contextlib.suppress(TypeError, ValueError, AttributeError):
            self._take_network(told.get("wifi") or {})
        with contextlib.suppress(TypeError, ValueError, AttributeError):
            self.motors.warm = temperatures_of(told.get("motor_temper") or {})
        volume = told.get("volume")
        self.volume = volume if isinstance(volume, int) and 0 <= volume <= 100 else None
        self.saves = told.get("lowpower_control") is True
        self._link.heard("condition")

    async def run(self) -> None:
        """Every two seconds. Raises LinkLost; what it does not answer in time grows old."""
        async for _ in self._clock.every(PERIOD):
            with contextlib.suppress(*UNTOLD):
                await self.ask()

    def _take_network(self, told: Mapping[str, Any]) -> None:
        beat = self._client.heartbeat
        internet = beat is not None and beat.internet
        name, address, mac = (str(told.get(key) or "") for key in ("name", "ip", "mac"))
        self.network.take(NetworkMode.STATION, name, address, mac, float(told.get("strength") or 0), internet=internet)

    def _take_battery(self, told: Mapping[str, Any]) -> None:
        if told:
            self._reported.battery_details = {
                "voltage": float(told["voltage"]) / 1000,
                "temperature": float(told["temperature"]),
                "capacity": float(told["capacity"]) / 1000,
                "remaining": float(told["discharge_time"]) * 60 or None,
            }


def temperatures_of(told: Mapping[str, Any]) -> dict[str, float]:
    """Celsius by the motor's name; those that the dog does not know are left out."""
    warm = {}
    for joint, name in JOINTS.items():
        values = told.get(joint)
        for leg, value in zip(LEGS, values if isinstance(values, list) else (), strict=False):
            with contextlib.suppress(TypeError, ValueError):
                warm[f"{leg} {name}"] = float(value)
    return warm
