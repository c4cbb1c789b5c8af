"""Prediction of contacts between robots; while none is possible, the physics looks for none.

The search for contacts is half of a step of the physics, wherever everything is.
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

Floats = NDArray[np.float64]

ROOM = 0.02  # m that are kept free of doubt: more than contacts reach beyond the shapes
PERSON_MAX = 3.0  # m/s
STILL = 1e-6  # m/s
HORIZON, FAR = 1.0, 1000.0  # s, m
AGAIN, AGAIN_MAX = 0.06, 0.5  # s until it is looked again after something was near: the first time; at most
WORTH = 0.06  # s: for less it does not pay to look
NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


class Meetings:
    """Counts everything as round, and all floors as one."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, hulls: Sequence[Hull], props: Props, *, possible: bool
    ) -> None:
        """``possible``: whether there may be moments without contacts at all in this world."""
        self._model, self._data, self._hulls, self._props, self._possible = model, data, hulls, props, possible
        bodies = np.flatnonzero(model.body_mocapid >= 0)
        bodies = bodies[np.argsort(model.body_mocapid[bodies])]
        self._geoms = model.body_geomadr[bodies]
        self._round = model.geom_type[self._geoms] == mujoco.mjtGeom.mjGEOM_CAPSULE  # people; else boxes
        self._radii = np.array([hull.body.hull.radius for hull in hulls])
        self._pulls = np.array([hull.body.base.traction * GRAVITY for hull in hulls])  # m/s2 that wheels can give
        self._revision = -1
        self._others: tuple[NDArray[np.int64], Floats, Floats] | None = None  # see ``_there``
        self._off = False  # whether it looks for none now
        self._left = 0.0  # s until it has to be looked again
        self._wait = AGAIN

    def forget(self) -> None:
        """Something was put elsewhere at once."""
        self._switch(off=False)
        self._left, self._others = 0.0, None

    def look(self, seconds: float) -> None:
        """Before a step of so many ``seconds``: have the physics look for contacts in it, or not."""
        if not self._possible:
            return
        revision = sum(self._props.revisions.values())
        if revision != self._revision or (self._off and not all(map(self._as_expected, self._hulls))):
            self._revision = revision
            self.forget()
        self._left -= seconds
        if self._left >= 0.0 or not self._hulls:  # real and recorded robots are in no world
            return
        free = self._free() if self._is_calm() else 0.0
        self._switch(off=bool(free >= WORTH))
        self._wait = AGAIN if self._off else min(2.0 * self._wait, AGAIN_MAX)
        self._left = free - seconds if self._off else self._wait

    def _switch(self, *, off: bool) -> None:
        if off is not self._off:
            self._off = off
            flags = int(self._model.opt.disableflags)
            self._model.opt.disableflags = flags | NO_CONTACTS if off else flags & ~NO_CONTACTS

    def _as_expected(self, hull: Hull) -> bool:
        return hull.support.sprung and not (hull.disturbed or (hull.rests and hull.pulls))

    def _is_calm(self) -> bool:
        """Return whether all robots stand on springs and nothing is pressed; notes which of them rest."""
        for hull in self._hulls:
            vx, vy, _, _ = hull.motion
            hull.rests = not hull.pulls and abs(vx) < STILL and abs(vy) < STILL
            hull.disturbed = False
        return not self._data.nefc and all(hull.support.sprung and not hull.touches for hull in self._hulls)

    def _there(self) -> tuple[NDArray[np.int64], Floats, Floats]:
        """Return the present movable bodies, their radii around the middle (m), and their top speeds (m/s)."""
        there = np.flatnonzero(self._data.mocap_pos[:, 2] > AWAY[2] / 2)
        people, sizes = self._round[there], self._model.geom_size[self._geoms[there]]
        radii = np.where(people, sizes[:, 0], np.hypot(sizes[:, 0], sizes[:, 1]))
        return there, radii, np.where(people, PERSON_MAX, 0.0)

    def _free(self) -> float:
        """Seconds in which nothing can come to touch a robot, HORIZON at most."""
        if self._others is None:
            self._others = self._there()
        there, radii, people = self._others
        places = self._data.mocap_pos[there]
        hulls = np.array([(hull.x, hull.y) for hull in self._hulls])
        rest = np.array([hull.rests for hull in self._hulls])
        speeds = np.where(rest, 0.0, [math.hypot(*hull.motion[:2]) for hull in self._hulls])
        pulls = np.where(rest, 0.0, self._pulls)
        away = np.hypot(hulls[:, 0, None] - places[:, 0], hulls[:, 1, None] - places[:, 1])
        gaps = away - radii - self._radii[:, None] - ROOM
        free = min(HORIZON, _soonest(gaps, speeds[:, None] + people, pulls[:, None] + 0.0 * people))
        moving = np.flatnonzero(~rest)
        walls = [hull.walls.gap(hull.x, hull.y, hull.floor) - ROOM for hull in self._hulls]
        free = min(free, _soonest(np.array(walls)[moving], speeds[moving], pulls[moving]))
        if len(hulls) > 1:
            first, second = np.triu_indices(len(hulls), 1)
            away = np.hypot(*(hulls[first] - hulls[second]).T)
            gaps = away - self._radii[first] - self._radii[second] - ROOM
            free = min(free, _soonest(gaps, speeds[first] + speeds[second], pulls[first] + pulls[second]))
        return free


def _soonest(gaps: Floats, speeds: Floats, pulls: Floats) -> float:
    """Return when the first of the gaps (m) may close, at speeds (m/s) growing so fast (m/s2); inf: never."""
    moving = (speeds > 0.0) | (pulls > 0.0)
    gap, speed, pull = np.clip(gaps[moving], 0.0, FAR), speeds[moving], pulls[moving]
    ways = speed + np.sqrt(speed * speed + 2.0 * pull * gap)
    return float(np.min(2.0 * gap / np.maximum(ways, 1e-9), initial=math.inf))
