"""Switches the physics' search for contacts: off while the kernels see that no robot can touch anything.

The search takes half of the time of a physics step, even if everything is far apart.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco

from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.building.props import Props
from roboglot.simulation.world.free_motion import FreeMotion

STILL = 1e-6  # m/s
NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


class ContactSwitch:
    """Switch of the search. ``off``: whether it is off; without the kernels it never is."""

    def __init__(
        self, model: mujoco.MjModel, hulls: Sequence[Hull], props: Props, free_motion: FreeMotion | None
    ) -> None:
        """``free_motion``: None if this world cannot be without contacts at all."""
        self._model, self._hulls, self._props, self._free_motion = model, hulls, props, free_motion
        self._revision = -1
        self.off = False

    def look(self, seconds: float, *, touched: bool = False) -> None:
        """Decide whether the physics searches for contacts in a step of ``seconds``; ``touched``: some hull is."""
        if self._free_motion is None or not self._free_motion.loaded:
            return
        if not touched:
            touched = not self._free_motion.clear(seconds, known=(known := self.known))
            if not known:
                self.note()
        self.switch(off=not touched)

    @property
    def known(self) -> bool:
        """True if nothing but people has jumped since the last ``note``."""
        for hull in self._hulls:
            if hull.disturbed:
                return False
        return self._changes() == self._revision

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


def rests(hull: Hull) -> bool:
    """Return whether a robot neither drives nor moves, its torso included."""
    vx, vy, vz, _ = hull.motion
    return not hull.pulls and max(abs(vx), abs(vy), abs(vz)) < STILL
