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
        self._inputs = data.ctrl, data.qfrc_applied, model.actuator_gainprm, model.actuator_forcerange
        self._state = data.qpos, data.qvel
        self._kept: tuple[bytes, bytes, bytes, bytes] | None = None  # None: something moved
        self._places, self._rates = data.qpos.copy(), data.qvel.copy()
        self._there = b"", b""  # the bytes of these two

    @property
    def lasts(self) -> bool:
        """True while nothing has changed since everything came to rest."""
        if not self._kept:
            return False
        (qpos, qvel), (places, rates) = self._state, self._there
        return qpos.tobytes() == places and qvel.tobytes() == rates and self._same

    def settle(self, *, rests: bool) -> bool:
        """Check a step, after which no velocity is above RESTS (``rests``) or some are.

        Return whether everything rested before and after it, and its rounding was undone.
        """
        data = self._data
        if not rests or data.nefc or not tiny(data.qacc.tolist()):
            self._kept = None
            return False
        if self._kept and self._same and abs(data.qpos - self._places).max() <= RESTS:
            data.qpos[:], data.qvel[:] = self._places, self._rates
            return True
        self._places, self._rates = data.qpos.copy(), data.qvel.copy()
        self._there = self._places.tobytes(), self._rates.tobytes()
        controls, applied, gains, forces = self._inputs
        self._kept = controls.tobytes(), applied.tobytes(), gains.tobytes(), forces.tobytes()
        return False

    @property
    def _same(self) -> bool:
        if self._kept is None:
            return False
        (controls, applied, gains, forces), kept = self._inputs, self._kept
        return (
            controls.tobytes() == kept[0]
            and applied.tobytes() == kept[1]
            and gains.tobytes() == kept[2]
            and forces.tobytes() == kept[3]
        )


def tiny(numbers: list[float]) -> bool:
    """Return whether all are within RESTS of 0; False if there are none."""
    return bool(numbers) and max(numbers) <= RESTS and min(numbers) >= -RESTS
