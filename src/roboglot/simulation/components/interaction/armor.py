"""Armor plates as rectangles around the hull and at the gimbal, hit by beads, collisions and hands.

The sensitivity sets the least speed of a bead and force of a collision; a touch by a person always counts.
"""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from roboglot.model.components.interaction.armor import SENSITIVITY_MAX, Armor, HitKind, PlatePlace, check_sensitivity
from roboglot.model.errors import NotFound
from roboglot.model.events import ArmorHit, EventStream
from roboglot.simulation.bodies.hull import Hull, rotation
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative, Positive
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.components.motion.gimbal import SimulatedGimbal

PROUD = 0.005  # m by which plates protrude from the hull
SECTOR = math.tan(math.radians(40))  # a touch within 40 degrees of a plate's centre registers
DEAF = 0.2  # s after a push or a touch for which a plate registers no other
BEAD_SPEED = 22.0, 2.0  # m/s towards the plate that a bead needs, at sensitivity 0 and 10
FORCE, SOFTER = 200.0, 0.72  # N that a push needs at sensitivity 0, and its ratio from step to step
HIT_MAX = 64  # not published yet; more are dropped

Floats = NDArray[np.float64]
AROUND = {
    PlatePlace.FRONT: 0.0,
    PlatePlace.LEFT: math.pi / 2,
    PlatePlace.REAR: math.pi,
    PlatePlace.RIGHT: -math.pi / 2,
}
AT_GIMBAL = {PlatePlace.GIMBAL_LEFT: 1.0, PlatePlace.GIMBAL_RIGHT: -1.0}


class ArmorSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Four plates (width, height) around the hull, their middles ``above_floor``; two at the gimbal, if there is one.

    ``gimbal_side``: distance of the latter from the gimbal's middle. All in m.
    """

    size: tuple[Positive, Positive]
    above_floor: NotNegative
    gimbal_size: tuple[Positive, Positive] = (0.06, 0.06)
    gimbal_side: Positive = 0.08


class SimulatedArmor(Armor):
    """Armor that is also a target of beads."""

    def __init__(self, section: ArmorSection, hull: Hull, gimbal: SimulatedGimbal | None, events: EventStream) -> None:
        self.plates = (*AROUND, *AT_GIMBAL) if gimbal else (*AROUND,)
        self.hull = hull
        self._section, self._gimbal, self._events = section, gimbal, events
        self._sensitivity = 5
        self._deaf: dict[PlatePlace, float] = {}  # until when, robot time
        self._hits: list[tuple[PlatePlace, HitKind]] = []
        self.duty = Duty()  # active while the hull is touched or a plate has been hit
        hull.when_touched.append(self.duty)

    @property
    def sensitivity(self) -> int:
        return self._sensitivity

    def set_sensitivity(self, sensitivity: int) -> None:
        check_sensitivity(sensitivity)
        self._sensitivity = sensitivity

    def touch(self, place: PlatePlace) -> None:
        """Tap a plate by hand. Raises NotFound."""
        if place not in self.plates:
            raise NotFound(f"there is no plate {place}")
        self._note(place, HitKind.HAND)

    # -- beads --

    def meet(self, origin: Floats, way: Floats) -> tuple[float, str] | None:
        """Return the share of a bead's way (world, 0 to 1) to the first plate hit from outside, and its name."""
        to_body = rotation(self.hull.tilt, self.hull.turned)
        start, along = (origin - self.hull.position) @ to_body, way @ to_body
        best: tuple[float, str] | None = None
        for place in self.plates:
            middle, axes, (width, height) = self._plate(place)
            depth = float(along @ axes[:, 0])
            if depth >= -1e-12:  # from behind or along the plate
                continue
            share = float((middle - start) @ axes[:, 0]) / depth
            if not 0.0 <= share <= 1.0 or (best is not None and share >= best[0]):
                continue
            off = (start + share * along - middle) @ axes
            if abs(off[1]) <= width / 2 and abs(off[2]) <= height / 2:
                best = share, place
        return best

    def struck(self, plate: str, velocity: Floats) -> None:
        """Note a hit if the bead (velocity in world, m/s) was fast enough."""
        place = PlatePlace(plate)
        _, axes, _ = self._plate(place)
        towards = -float((velocity @ rotation(self.hull.tilt, self.hull.turned)) @ axes[:, 0])
        slow, fast = BEAD_SPEED[1], BEAD_SPEED[0]
        if towards >= fast + (slow - fast) * self._sensitivity / SENSITIVITY_MAX:
            self._note(place, HitKind.BEAD)

    def _plate(self, place: PlatePlace) -> tuple[Floats, Floats, tuple[float, float]]:
        """Return a plate's middle (m), axes (columns: outwards, sideways, up) in base_link, and size (m)."""
        section = self._section
        if place in AROUND:
            axes = rotation((0.0, 0.0), AROUND[place])
            middle = axes[:, 0] * (self.hull.body.hull.radius + PROUD)
            middle[2] = section.above_floor
            return middle, axes, section.size
        assert self._gimbal
        side = AT_GIMBAL[place]
        turned = self._gimbal.orientation
        axes = turned @ rotation((0.0, 0.0), side * math.pi / 2)
        return self._gimbal.pivot + axes[:, 0] * section.gimbal_side, axes, section.gimbal_size

    # -- pushes --

    def sense(self, stamp: float, seconds: float) -> None:
        """Check the hull's touches, and publish all hits since the last time."""
        if self.hull.touches:
            self._feel(stamp, seconds)
        if self._hits:
            hits, self._hits = self._hits, []
            for place, kind in hits:
                self._events.publish(ArmorHit(stamp=stamp, place=place, kind=kind))
        elif not self.hull.touches:
            self.duty.end()

    def _feel(self, stamp: float, seconds: float) -> None:
        hull = self.hull
        (vx, vy, *_), (ux, uy, *_) = hull.motion, hull.before
        force_x, force_y = (vx - ux) * hull.mass / seconds, (vy - uy) * hull.mass / seconds
        c, s = math.cos(hull.turned), math.sin(hull.turned)
        needed = FORCE * SOFTER**self._sensitivity
        for touch in hull.touches:
            along, aside = abs(touch.x), abs(touch.y)
            if along > aside:
                place = PlatePlace.FRONT if touch.x > 0.0 else PlatePlace.REAR
            else:
                place = PlatePlace.LEFT if touch.y > 0.0 else PlatePlace.RIGHT
            facing = AROUND[place]
            if min(along, aside) > SECTOR * max(along, aside) or self._deaf.get(place, -1.0) > stamp:
                continue
            nx, ny = math.cos(facing), math.sin(facing)
            inwards = -(force_x * (c * nx - s * ny) + force_y * (s * nx + c * ny))
            if touch.person or inwards >= needed:
                self._deaf[place] = stamp + DEAF
                self._note(place, HitKind.HAND if touch.person else HitKind.COLLISION)

    def _note(self, place: PlatePlace, kind: HitKind) -> None:
        if len(self._hits) < HIT_MAX:
            self._hits.append((place, kind))
            self.duty.begin()


def _fit(fit: Fitting) -> SimulatedArmor:
    armor = SimulatedArmor(fit.body[ArmorSection], fit.hull, fit.find(SimulatedGimbal), fit.robot.events)
    fit.world.beads.targets.append(armor)
    return armor


PART = Part(
    name="armor",
    interface=Armor,
    section=ArmorSection,
    fit=_fit,
    after=("gimbal", "bumper"),
    sense=SimulatedArmor.sense,
    duty=lambda armor: armor.duty,
)
