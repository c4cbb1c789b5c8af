"""Declarative descriptions of robot bodies: their parts and parameters. SI units.

The sections that the physics needs (hull, base, legs) are here; every other section is beside its component in
``simulation/components``. ``bodies.files`` reads the files.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, TypeVar

from msgspec import Struct

from roboglot.model.components.motion.gaits import Gait
from roboglot.model.components.motion.legs import LegLimits
from roboglot.model.robot import Description
from roboglot.simulation.bodies.quantities import Fraction, NotNegative, Positive
from roboglot.values import dataclass

S = TypeVar("S", bound=Struct)


class HullSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Two cylinders, chassis and torso, of equal radius around base_link."""

    radius: Positive
    height: Positive
    mass: Positive
    clearance: Positive
    chassis_height: Positive
    torso_height: Positive


class BaseSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Four mecanum wheels at the corners of ``wheel_base`` x ``track``, or one driven wheel at each side, ``track``
    apart; top speeds and accelerations. ``braking``: in an emergency, m/s2.
    """

    speed: Positive
    yaw_speed: Positive
    acceleration: Positive
    yaw_acceleration: Positive
    wheel_radius: Positive
    wheel_base: Positive
    track: Positive
    traction: Positive
    braking: Positive | None = None
    drive: Literal["mecanum", "differential"] = "mecanum"


class LegsSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Belly heights (m) and times to change between them (s); ``lowest`` to ``highest``: heights held while standing.

    ``angle_max`` (rad) and ``shift_max`` (m) of the body relative to the feet; powers in W; no motion is performed at a
    charge up to ``tired_below``; without a ``gait`` the body rolls on its wheels. ``reach``: largest distance of a foot
    from the place below its hip, m.
    """

    standing: Positive
    lying: Positive
    stand_time: Positive
    lie_time: Positive
    lowest: Positive = 0.10
    highest: Positive = 0.30
    angle_max: Positive = 0.45
    shift_max: Positive = 0.10
    reach: Positive = 0.15
    perform_power: NotNegative = 60.0
    tired_below: Fraction = 0.20
    gait: Gait | None = None

    @property
    def limits(self) -> LegLimits:
        """Limits of the legs."""
        return LegLimits(
            lowest=self.lowest, highest=self.highest, angle=self.angle_max, shift=self.shift_max, reach=self.reach
        )


@dataclass(frozen=True, slots=True)
class Body:
    """A kind of robot: ``body[LidarSection]`` is a section, ``body.get(LidarSection)`` is None without it."""

    maker: str
    model: str
    hardware_version: str
    hull: HullSection
    sections: Mapping[type[Struct], Struct]

    def __hash__(self) -> int:
        return hash((self.maker, self.model, self.hull))  # sections may hold mappings

    def get(self, section: type[S]) -> S | None:
        """Return the section of this type; None if the robot has no such part."""
        found = self.sections.get(section)
        return found if isinstance(found, section) else None

    def __getitem__(self, section: type[S]) -> S:
        found = self.get(section)
        if found is None:
            raise KeyError(section.__name__)
        return found

    @property
    def base(self) -> BaseSection:
        """The section of the base, which moves the hull over the floor."""
        return self[BaseSection]

    @property
    def legs(self) -> LegsSection | None:
        """The section of the legs; None: it has none."""
        return self.get(LegsSection)

    @property
    def walks(self) -> bool:
        """True if the body walks on feet, without wheels."""
        return self.legs is not None and self.legs.gait is not None

    def describe(self, serial: str, software_version: str) -> Description:
        """Return the name plate of one robot of this kind."""
        return Description(
            maker=self.maker,
            model=self.model,
            serial=serial,
            hardware_version=self.hardware_version,
            software_version=software_version,
            radius=self.hull.radius,
            height=self.hull.height,
        )
