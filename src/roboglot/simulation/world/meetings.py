"""Prediction of contacts of robots; while none is possible, the physics does not search for contacts.

The search takes half of the time of a physics step, even if everything is far apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.support import GRAVITY
from roboglot.simulation.building.props import AWAY, Props
from roboglot.simulation.world.gliding import Gliding

ROOM = 0.02  # m of safety margin: more than contacts extend beyond the shapes
PERSON_MAX = 3.0  # m/s
STILL = 1e-6  # m/s
HORIZON, FAR = 1.0, 1000.0  # s, m
AGAIN, AGAIN_MAX = 0.06, 0.5  # s until the next check after an object was near: at first; at most
WORTH = 0.06  # s below which a check does not pay
NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


class Meetings:
    """Switches the search for contacts. Treats everything as round, and all floors as one."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        hulls: Sequence[Hull],
        props: Props,
        gliding: Gliding | None,
    ) -> None:
        """``gliding``: None if this world cannot be without contacts at all."""
        self._model, self._data, self._hulls, self._props, self._gliding = model, data, hulls, props, gliding
        bodies = np.flatnonzero(model.body_mocapid >= 0)
        bodies = bodies[np.argsort(model.body_mocapid[bodies])]
        self._geoms = model.body_geomadr[bodies]
        self._round = model.geom_type[self._geoms] == mujoco.mjtGeom.mjGEOM_CAPSULE  # people; the others are boxes
        self._radii = np.array([hull.body.hull.radius for hull in hulls])
        self._pulls = np.array([hull.body.base.traction * GRAVITY for hull in hulls])  # m/s2 that the wheels can apply
        self._revision = -1
        self._pairs = np.triu_indices(len(hulls), 1)
        self._others: tuple[NDArray[np.int64], list[float], list[float]] | None = None  # see ``_there``
        self.off = False  # whether the search is switched off
        self._left = 0.0  # s until the next check
        self._wait = AGAIN

    def forget(self) -> None:
        """Search again: something was moved at once."""
        self.switch(off=False)
        self._left, self._others = 0.0, None

    def look(self, seconds: float, *, touched: bool = False) -> None:
        """Decide whether the physics searches for contacts in a step of ``seconds``; ``touched``: some hull is."""
        if self._gliding is None:
            return
        if self._gliding.loaded:  # looks at everything in every tick
            if not touched:
                touched = not self._gliding.clear(seconds, known=(known := self.known))
                if not known:
                    self.note()
            self.switch(off=not touched)
            return
        revision = self._changes()
        if revision != self._revision or (self.off and not all(map(self._as_expected, self._hulls))):
            self._revision = revision
            self.forget()
            self._left = seconds  # search once: robots that rest may have been reached
        self._left -= seconds
        if self._left >= 0.0 or not self._hulls:  # real and recorded robots are not in any world
            return
        free = self._free() if self._is_calm() else 0.0
        self.switch(off=bool(free >= WORTH))
        self._wait = AGAIN if self.off else min(2.0 * self._wait, AGAIN_MAX)
        self._left = free - seconds if self.off else self._wait

    @property
    def known(self) -> bool:
        """True if nothing but people has jumped since the last ``note``."""
        return self._changes() == self._revision and not any(hull.disturbed for hull in self._hulls)

    def note(self) -> None:
        """Note that contacts were searched for, or found impossible, with everything at its present place."""
        self._revision = self._changes()
        for hull in self._hulls:
            hull.disturbed = False

    def _changes(self) -> int:
        return sum(self._props.revisions.values())

    def switch(self, *, off: bool) -> None:
        """Search for contacts in the next steps, or do not."""
        if off is not self.off:
            self.off = off
            flags = int(self._model.opt.disableflags)
            self._model.opt.disableflags = flags | NO_CONTACTS if off else flags & ~NO_CONTACTS

    def _as_expected(self, hull: Hull) -> bool:
        return hull.support.sprung and not (hull.disturbed or (hull.rests and not rests(hull)))

    def _is_calm(self) -> bool:
        """Return whether all robots stand on springs without contact forces; note which of them rest."""
        for hull in self._hulls:
            hull.rests, hull.disturbed = rests(hull), False
        return not self._data.nefc and all(hull.support.sprung and not hull.touches for hull in self._hulls)

    def _there(self) -> tuple[NDArray[np.int64], list[float], list[float]]:
        """Return the present movable bodies, their radii around the middle (m), and their top speeds (m/s)."""
        there = np.flatnonzero(self._data.mocap_pos[:, 2] > AWAY[2] / 2)
        people, sizes = self._round[there], self._model.geom_size[self._geoms[there]]
        radii = np.where(people, sizes[:, 0], np.hypot(sizes[:, 0], sizes[:, 1]))
        return there, radii.tolist(), np.where(people, PERSON_MAX, 0.0).tolist()

    def _free(self) -> float:
        """Return the seconds during which nothing can touch a robot, HORIZON at most; inexact below WORTH."""
        hulls = self._hulls
        free = self._free_of_each_other() if len(hulls) > 1 else HORIZON
        for hull, radius, pull in zip(hulls, self._radii.tolist(), self._pulls.tolist(), strict=True):
            if free >= WORTH and not hull.rests:
                room = hull.walls.gap(hull.x, hull.y, hull.floor) - ROOM
                free = min(free, _soonest(room, math.hypot(*hull.motion[:2]), pull))
            if free >= WORTH:
                free = min(free, self._free_of_others(hull, radius, pull))
        return free

    def _free_of_others(self, hull: Hull, radius: float, pull: float) -> float:
        """Return the same for one robot against people and props."""
        if self._others is None:
            self._others = self._there()
        there, radii, people = self._others
        x, y, free = hull.x, hull.y, HORIZON
        speed, pull = (0.0, 0.0) if hull.rests else (math.hypot(*hull.motion[:2]), pull)
        for place, size, person in zip(self._data.mocap_pos[there].tolist(), radii, people, strict=True):
            gap = math.hypot(x - place[0], y - place[1]) - size - radius - ROOM
            free = min(free, _soonest(gap, speed + person, pull))
        return free

    def _free_of_each_other(self) -> float:
        """Return the same for all pairs of robots."""
        first, second = self._pairs
        places = np.array([(hull.x, hull.y) for hull in self._hulls])
        rest = np.array([hull.rests for hull in self._hulls])
        speeds = np.where(rest, 0.0, [math.hypot(*hull.motion[:2]) for hull in self._hulls])
        pulls = np.where(rest, 0.0, self._pulls)
        (x, y), radii = places.T, self._radii
        gaps = np.hypot(x[first] - x[second], y[first] - y[second]) - radii[first] - radii[second] - ROOM
        speed, pull = speeds[first] + speeds[second], pulls[first] + pulls[second]
        gap = np.clip(gaps, 0.0, FAR)
        ways = speed + np.sqrt(speed * speed + 2.0 * pull * gap)
        times = np.where((speed > 0.0) | (pull > 0.0), 2.0 * gap / np.maximum(ways, 1e-9), HORIZON)
        return min(HORIZON, float(times.min()))


def rests(hull: Hull) -> bool:
    """Return whether a robot neither drives nor moves, its torso included."""
    vx, vy, vz, _ = hull.motion
    return not hull.pulls and max(abs(vx), abs(vy), abs(vz)) < STILL


def _soonest(gap: float, speed: float, pull: float) -> float:
    """Return the least time (s) to close a gap (m) at speed (m/s) and acceleration ``pull`` (m/s2); HORIZON: never."""
    if not (speed > 0.0 or pull > 0.0):
        return HORIZON
    gap = min(max(gap, 0.0), FAR)
    return 2.0 * gap / max(speed + math.sqrt(speed * speed + 2.0 * pull * gap), 1e-9)
