"""The radio between robots: received at once, through walls, within its range."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Annotated

from msgspec import Meta, Struct

from roboglot.model.components.logistics.traffic_radio import CLAIM_MAX, CLAIMS_MAX, WAY_MAX, Announcement, TrafficRadio
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Pose
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.radio.radio import Claimant


class TrafficRadioSection(Struct, frozen=True, forbid_unknown_fields=True):
    """A radio that sends claims and announcements to other robots within ``range`` m."""

    range: Annotated[float, Meta(gt=0, le=10_000)] = 500.0


class SimulatedTrafficRadio(TrafficRadio):
    """Radio of one robot. ``air``: all radios of the world."""

    def __init__(self, section: TrafficRadioSection, hull: Hull, air: list[Claimant]) -> None:
        self._section, self._hull, self._air = section, hull, air
        self._claims: frozenset[str] = frozenset()
        self._announced: Announcement | None = None
        air.append(self)

    @property
    def pose(self) -> Pose:
        """Pose of the robot, world frame."""
        return self._hull.pose

    @property
    def claims(self) -> frozenset[str]:
        return self._claims

    def claim(self, names: Collection[str]) -> None:
        if len(names) > CLAIMS_MAX or any(len(name) > CLAIM_MAX for name in names):
            raise InvalidGoal(f"the radio carries {CLAIMS_MAX} claims of {CLAIM_MAX} characters")
        self._claims = frozenset(names)

    def others(self, name: str) -> int:
        return sum(name in radio.claims for radio in self._in_range())

    @property
    def announced(self) -> Announcement | None:
        """Last announcement of this robot."""
        return self._announced

    def announce(self, announcement: Announcement | None) -> None:
        if announcement is not None and len(announcement.way) > WAY_MAX:
            raise InvalidGoal(f"the radio carries routes of {WAY_MAX} points")
        self._announced = announcement

    def heard(self) -> Sequence[Announcement]:
        return [radio.announced for radio in self._in_range() if radio.announced is not None]

    def _in_range(self) -> Sequence[Claimant]:
        here, reach = self._hull.pose, self._section.range
        return [radio for radio in self._air if radio is not self and radio.pose.distance_to(here) <= reach]


def _fit(fit: Fitting) -> SimulatedTrafficRadio:
    return SimulatedTrafficRadio(fit.body[TrafficRadioSection], fit.hull, fit.world.gadgets.radio.traffic)


PART = Part(name="traffic_radio", interface=TrafficRadio, section=TrafficRadioSection, fit=_fit)
