"""A lithium battery: drains with the robot's load, sags, warms, charges on the dock."""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import Annotated, Literal

from msgspec import Meta, Struct

from roboglot.model.components.energy.battery import Battery
from roboglot.model.events import BatteryChanged
from roboglot.model.robot import Robot
from roboglot.model.sensing import BatteryState, Supply
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Fraction, NotNegative, Positive
from roboglot.simulation.bodies.support import GRAVITY
from roboglot.simulation.components.energy.dock_contact import SimulatedDockContact
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.motion.drive_locks import hold_still, let_move

# Open-circuit voltage of a lithium cell by its charge.
CHARGES = (0.0, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 0.9, 1.0)
VOLTS = (3.0, 3.3, 3.45, 3.58, 3.68, 3.8, 3.97, 4.07, 4.18)
AMBIENT = 25.0  # Celsius
HEAT_CAPACITY = 700.0  # J/K
COOLING = 0.8  # W/K
FULL, RECHARGE = 0.999, 0.97  # charging ends at the first and resumes below the second
REVIVED = 0.02  # charge at which an empty battery lets the robot drive again
NOMINAL = 3.743  # V per cell: mean of VOLTS over the charge, so that Wh and Ah are the same capacity
AGED = 0.8  # remaining capacity at the end of a battery's life
BUZZING = 0.05  # charge below which it beeps
MINUTE = 60.0  # s over which the usual load is averaged
LOCK, UNLOCK = 50.0, 45.0  # Celsius above which the guard blocks charging, and below which it allows it again
TAPER = 0.9  # charge from which the charger reduces its current


class BatterySection(Struct, frozen=True, forbid_unknown_fields=True):
    """Capacity in Wh; powers in W; ``resistance`` (ohm) makes the voltage sag and the cells warm.

    ``dock``: charged through "contacts" or "wireless", by a coil. ``life``: cycles after which four fifths of the
    capacity are left.
    """

    capacity: Positive
    cells: Annotated[int, Meta(ge=1, le=100)]
    charge: Fraction
    idle_power: NotNegative
    efficiency: Annotated[float, Meta(gt=0, le=1)]
    rolling_resistance: NotNegative
    charge_power: NotNegative
    resistance: NotNegative
    cycles: Annotated[int, Meta(ge=0)]
    dock: Literal["contacts", "wireless"] = "contacts"
    life: Annotated[int, Meta(ge=1, le=100_000)] = 800


class SimulatedBattery(Battery):
    """Battery whose charge is the integral of its current; an empty one locks the base."""

    def __init__(
        self,
        section: BatterySection,
        hull: Hull,
        base: SimulatedBase,
        dock: SimulatedDockContact | None,
        robot: Robot,
    ) -> None:
        self._section, self._hull, self._base, self._dock, self._robot = section, hull, base, dock, robot
        self._charge = section.charge
        self._temperature = AMBIENT
        self._charging = False
        self._current = 0.0
        self._voltage = self._open_circuit()
        self._drawn = 0.0  # Wh since the start, for the cycles
        self._published: tuple[int, bool] | None = None
        self._wire = False
        self._usual = section.idle_power  # W drawn, averaged over the last minute
        self._locked = False  # by the guard
        self.unfed = False  # whether the dock supplies no current
        self.saving = 1.0  # factor on the robot's idle power

    @property
    def state(self) -> BatteryState:
        supply = self.supply
        return BatteryState(
            self._charge,
            self._voltage,
            self._current,
            self._temperature,
            self._charging,
            self._cycles,
            supply,
            capacity=self._capacity,
            health=self._health,
            remaining=self._remaining if supply is Supply.NONE else None,
            charge_locked=self._locked,
            buzzing=supply is Supply.NONE and self._charge < BUZZING,
        )

    @property
    def charge(self) -> float:
        """Charge, 0..1, as in the state."""
        return self._charge

    @property
    def temperature(self) -> float:
        """Temperature in Celsius, as in the state."""
        return self._temperature

    @property
    def _cycles(self) -> int:
        return self._section.cycles + int(self._drawn / self._section.capacity)

    @property
    def _health(self) -> float:
        """Share of the nominal capacity, falling linearly with the cycles."""
        return max(0.3, 1.0 - (1.0 - AGED) * self._cycles / self._section.life)

    @property
    def _capacity(self) -> float:
        """Charge of the full battery at its age, Ah."""
        return self._section.capacity * self._health / (NOMINAL * self._section.cells)

    @property
    def _remaining(self) -> float:
        """Time until it is empty at the usual load, s."""
        return self._charge * self._section.capacity * self._health / max(1e-3, self._usual) * 3600.0

    @property
    def _starved(self) -> bool:
        """True if the dock supplies no current and no wire is plugged in."""
        return self.unfed and not self._wire

    @property
    def supply(self) -> Supply:
        """Current source of power."""
        if self._wire:
            return Supply.WIRE
        docked = self._dock is not None and self._dock.docked
        return Supply(self._section.dock) if docked else Supply.NONE

    def plug(self, wire: bool) -> None:
        """Plug in a charger, or unplug it; a robot on a wire does not drive."""
        self._wire = wire
        if wire:
            self._base.locks.lock("wire", "the robot is charging by wire")
        else:
            self._base.locks.unlock("wire")

    def reset(self) -> None:
        """Set the charge of the start and unplug the wire; age and cycles stay."""
        self.plug(False)
        self.set_charge(self._section.charge)

    def set_charge(self, charge: float) -> None:
        """Set the charge (0..1) at once: for tests and faults. Raises ValueError."""
        if not 0.0 <= charge <= 1.0:
            raise ValueError("a charge must be between 0 and 1")
        self._charge = charge

    def warm(self, temperature: float) -> None:
        """Set the temperature (Celsius) at once: for tests."""
        self._temperature = temperature

    def sense(self, stamp: float, seconds: float) -> None:
        """Add or draw the energy of ``seconds``, then publish changes."""
        if self._published is None:
            self._published = self._words()  # not charging yet: a robot that starts on its dock begins to charge now
        load = self._load()
        docked = self._wire or (self._dock is not None and self._dock.docked)
        self._locked = self._temperature > (UNLOCK if self._locked else LOCK)
        self._charging = (
            docked and not (self._locked or self._starved) and self._charge < (FULL if self._charging else RECHARGE)
        )
        self._usual += (load - self._usual) * min(1.0, seconds / MINUTE)
        # On the dock the charger also supplies the robot.
        power = -load if not docked or self._starved else self._charger() if self._charging else 0.0
        self._feel(power, seconds)
        self._charge = min(1.0, max(0.0, self._charge + self._current * seconds / 3600.0 / self._capacity))
        self._drawn += max(0.0, -power) * seconds / 3600.0
        if self._charge == 0.0:
            hold_still(self._robot, self._base.locks, "battery", "the battery is empty")
        elif self._charge >= REVIVED:
            let_move(self._robot, self._base.locks, "battery")
        if (state := self._words()) != self._published:
            self._published = state
            self._robot.events.publish(BatteryChanged(stamp=stamp, percentage=self._charge, charging=self._charging))

    def _words(self) -> tuple[int, bool]:
        """Return the values whose changes are published: percent and charging."""
        return math.floor(self._charge * 100.0 + 1e-9), self._charging

    def _load(self) -> float:
        """Return the power that the robot draws, W."""
        rolling = self._section.rolling_resistance * self._hull.body.hull.mass * GRAVITY * self._base.velocity.speed
        moving = (self._hull.traction_power + rolling) / self._section.efficiency
        return self._section.idle_power * self.saving + moving + self._hull.effort

    def _charger(self) -> float:
        """Return the power into the cells, W: full power, then less towards the end."""
        rest = min(1.0, max(0.05, (1.0 - self._charge) / (1.0 - TAPER)))
        return self._section.charge_power * rest

    def _open_circuit(self) -> float:
        """Return the voltage without load, V."""
        part = min(bisect_right(CHARGES, self._charge), len(CHARGES) - 1) - 1
        slope = (VOLTS[part + 1] - VOLTS[part]) / (CHARGES[part + 1] - CHARGES[part])
        return (VOLTS[part] + slope * (self._charge - CHARGES[part])) * self._section.cells

    def _feel(self, power: float, seconds: float) -> None:
        """Update current, voltage and temperature for ``power`` (W; negative: drawn)."""
        inside = self._open_circuit()
        self._current = power / self._voltage
        self._voltage = max(1.0, inside + self._current * self._section.resistance)
        lost = self._current**2 * self._section.resistance
        self._temperature += (lost - COOLING * (self._temperature - AMBIENT)) / HEAT_CAPACITY * seconds


def _fit(fit: Fitting) -> SimulatedBattery:
    base, dock = fit.get(SimulatedBase), fit.find(SimulatedDockContact)
    return SimulatedBattery(fit.body[BatterySection], fit.hull, base, dock, fit.robot)


PART = Part(
    name="battery",
    interface=Battery,
    section=BatterySection,
    fit=_fit,
    after=("base", "dock_contact"),
    sense=SimulatedBattery.sense,
    every=5,
    first=5,
)
