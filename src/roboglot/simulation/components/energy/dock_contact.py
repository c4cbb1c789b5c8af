"""The charging contacts at the rear, which touch a dock by geometry."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import chain

import numpy as np
from msgspec import Struct

from roboglot.kernels.layouts import (
    BATCHED,
    CONTACT_ANGLE,
    CONTACT_DISTANCE,
    CONTACT_MADE,
    CONTACT_WIDTH,
    DOCK_WIDTH,
    HULL_WIDTH,
    TOUCHED,
    USE,
)
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.events import DockContactChanged, EventStream
from roboglot.model.geometry import Pose
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.hull_state import TABLE as HULLS
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.simulation.bodies.tables import BatchedSense, Kernels, RobotTables, Sense, TickStage

TABLE = "dock contact"


class DockContactSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Tolerances of the rear contacts at a dock: ``distance`` (m) and ``angle`` (rad)."""

    distance: Positive
    angle: Positive


class SimulatedDockContact(DockContact):
    """Contact while the hull's rear is at the middle of a dock's front, within the tolerances."""

    def __init__(
        self, section: DockContactSection, hull: Hull, docks: Sequence[Sequence[Pose]], events: EventStream
    ) -> None:
        self._section, self._hull, self._events, self.docks = section, hull, events, docks
        self._row = hull.robot_rows.row(TABLE, CONTACT_WIDTH)
        self._row[USE] = BATCHED
        self._row[CONTACT_DISTANCE], self._row[CONTACT_ANGLE] = section.distance, section.angle
        self._row[CONTACT_MADE] = float(self._touches())

    @property
    def index(self) -> int:
        """Row of this part in the table of all robots."""
        return self._hull.robot_rows.index

    @property
    def docked(self) -> bool:
        return self._row[CONTACT_MADE] != 0.0

    def sense(self, stamp: float, _seconds: float) -> None:
        """Check for a dock, and publish changes."""
        touches = self._touches()
        if touches != self.docked:
            self._row[CONTACT_MADE] = float(touches)
            self._events.publish(DockContactChanged(stamp=stamp, docked=touches))

    def _touches(self) -> bool:
        """Return whether the robot touches a dock."""
        hull, section = self._hull, self._section
        radius, near = hull.body.hull.radius, section.distance
        for dock in self.docks[hull.floor]:
            seen = hull.pose.relative_to(dock)
            if abs(seen.x - radius) <= near and abs(seen.y) <= near and abs(seen.yaw) <= section.angle:
                return True
        return False


def _sense_all(tables: RobotTables, parts: Sequence[tuple[SimulatedDockContact, Sense]]) -> BatchedSense:
    """Return a function that checks for all robots in one call of the kernel, which leaves those that change."""
    hulls, contacts = tables.table(HULLS, HULL_WIDTH), tables.table(TABLE, CONTACT_WIDTH)
    docks = parts[0][0].docks if parts else ()
    known: list[Pose] = []
    table = np.zeros((sum(map(len, docks)), DOCK_WIDTH))

    def refresh() -> None:
        """Take over where the docks are now."""
        nonlocal known
        if (there := [*chain.from_iterable(docks)]) != known:  # one was moved
            known = there
            floors = ((number, dock) for number, those in enumerate(docks) for dock in those)
            for row, (at, dock) in zip(table, floors, strict=True):
                row[:] = dock.x, dock.y, math.cos(dock.yaw), math.sin(dock.yaw), dock.yaw, at

    def touch(kernels: Kernels, _stamp: float, _seconds: float) -> int:
        refresh()
        return kernels.find_docks(hulls, contacts, table, tables.others)

    leg = TickStage(TOUCHED, (contacts, table), refresh=refresh)
    return tables.sense({contact.index: sense for contact, sense in parts}, touch, leg)


def _fit(fit: Fitting) -> SimulatedDockContact:
    return SimulatedDockContact(fit.body[DockContactSection], fit.hull, fit.world.docks, fit.robot.events)


PART = Part(
    name="dock_contact",
    interface=DockContact,
    section=DockContactSection,
    fit=_fit,
    sense=SimulatedDockContact.sense,
    sense_all=_sense_all,
)
