"""Sleep of the physics: while everything rests and no input changes, steps are left out, as they would change nothing.

A step of bodies at rest moves them by rounding only. That is undone, so that a world with such steps (to search for
contacts) stays identical.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mujoco import MjData, MjModel

RESTS = 1e-12  # m/s, rad/s and their rates up to which a body counts as at rest: rounding leaves less than 1e-13


class Sleep:
    """Positions, velocities and inputs at which everything came to rest."""

    def __init__(self, model: MjModel, data: MjData) -> None:
        self._data = data
        gains, forces = model.actuator_gainprm.ravel(), model.actuator_forcerange.ravel()
        self.now = data.qpos, data.qvel, data.ctrl, data.qfrc_applied, gains, forces  # views
        self.kept = tuple(array.copy() for array in self.now)  # as they were when everything came to rest
        self._bytes: list[bytes] = []  # of these
        self.holds = False  # whether they count: nothing has moved since

    @property
    def lasts(self) -> bool:
        """True while nothing has changed since everything came to rest."""
        return self.holds and all(now.tobytes() == kept for now, kept in zip(self.now, self._bytes, strict=True))

    def wake(self) -> None:
        """Note that something moves."""
        self.holds = False

    def settle(self, *, rests: bool) -> bool:
        """Check a step, after which no velocity is above RESTS (``rests``) or some are.

        Return whether everything rested before and after it, and its rounding was undone.
        """
        data = self._data
        if not rests or data.nefc or not tiny(data.qacc.tolist()):
            self.holds = False
            return False
        places = self.kept[0]
        if self.holds and self._same_inputs and abs(data.qpos - places).max() <= RESTS:
            data.qpos[:], data.qvel[:] = self.kept[:2]
            return True
        for kept, now in zip(self.kept, self.now, strict=True):
            kept[:] = now
        self._bytes = [kept.tobytes() for kept in self.kept]
        self.holds = True
        return False

    @property
    def _same_inputs(self) -> bool:
        return all(now.tobytes() == kept for now, kept in zip(self.now[2:], self._bytes[2:], strict=True))


def tiny(numbers: list[float]) -> bool:
    """Return whether all are within RESTS of 0; False if there are none."""
    return bool(numbers) and max(numbers) <= RESTS and min(numbers) >= -RESTS
