"""The robot's radio to the lift: works within the Wi-Fi's range, receives the lift's broadcasts."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from roboglot.model.components.logistics.lift_client import LiftClient, LiftState
from roboglot.model.components.system.network import Network
from roboglot.model.errors import Refused
from roboglot.model.events import Event, LiftCalled
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.building.lift import LiftCar
from roboglot.simulation.components.system.network import SimulatedNetwork


class LiftClientSection(Struct, frozen=True, forbid_unknown_fields=True):
    """A radio that needs a Wi-Fi signal of ``signal_min`` dBm."""

    signal_min: Annotated[float, Meta(ge=-120, le=0)] = -85.0


class SimulatedLiftClient(LiftClient):
    """Client that keeps the last received state while out of reach."""

    def __init__(self, section: LiftClientSection, lift: LiftCar, robot: Robot) -> None:
        self._section, self._lift, self._robot = section, lift, robot
        self.floors = lift.names
        self._state = lift.state
        lift.listeners.append(self._on_event)

    @property
    def state(self) -> LiftState:
        if self._reached:
            self._state = self._lift.state
        return self._state

    def call(self, floor: int) -> None:
        self._reach()
        self._lift.call(floor)
        self._robot.events.publish(LiftCalled(stamp=self._robot.clock.time(), floor=floor))

    def hold_door(self, seconds: float) -> None:
        self._reach()
        self._lift.hold_door(seconds)

    def close_door(self) -> None:
        self._reach()
        self._lift.close_door()

    @property
    def _reached(self) -> bool:
        if Network not in self._robot:
            return True
        card = self._robot[Network]
        assert isinstance(card, SimulatedNetwork)
        return card.strongest >= self._section.signal_min

    def _reach(self) -> None:
        if not self._reached:
            raise Refused("the lift's radio is out of reach")

    def _on_event(self, event: Event) -> None:
        if self._reached:
            self._robot.events.publish(event)


def _fit(fit: Fitting) -> SimulatedLiftClient | None:
    lift = fit.world.building.lift
    return SimulatedLiftClient(fit.body[LiftClientSection], lift, fit.robot) if lift else None


PART = Part(name="lift_client", interface=LiftClient, section=LiftClientSection, fit=_fit)
