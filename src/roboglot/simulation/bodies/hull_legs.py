"""The legs of a hull in the physics: a servo that holds the torso, and a chassis that steps over low obstacles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from roboglot.simulation.bodies.body import Body
from roboglot.simulation.bodies.support import GRAVITY

if TYPE_CHECKING:
    from mujoco import MjData, MjModel

LEG_GAIN = 8000.0  # N/m, of the servo that holds the torso
TORSO = 0.4  # of the mass; the rest is the chassis


class HullLegs:
    """``torso`` and ``sinking``: indices of the torso's underside in MuJoCo's positions and velocities.

    ``servo``: that of its control.
    """

    def __init__(self, model: MjModel, data: MjData, name: str, body: Body) -> None:
        self._model, self._section = model, body.hull
        self._positions, self._ctrl = data.qpos, data.ctrl  # views of the current values
        torso, self.servo = model.joint(f"{name} torso"), model.actuator(f"{name} torso").id
        self.torso, self.sinking = int(torso.qposadr[0]), int(torso.dofadr[0])
        self._gains = (model.actuator_gainprm[self.servo].copy(), model.actuator_biasprm[self.servo].copy())
        self._sag = body.hull.mass * TORSO * GRAVITY / LEG_GAIN
        self._chassis = model.geom(f"{name} chassis").id

    def hold(self, height: float | None, *, weightless: bool = False) -> None:
        """Hold the torso at ``height`` m, or let it sink (None); ``weightless``: in free fall it needs no support."""
        limp = height is None
        self._model.actuator_gainprm[self.servo] = 0.0 if limp else self._gains[0]
        self._model.actuator_biasprm[self.servo] = 0.0 if limp else self._gains[1]
        if height is not None:
            self._ctrl[self.servo] = height + (0.0 if weightless else self._sag)

    def put(self, height: float) -> None:
        """Set the torso's height (m) at once."""
        self._positions[self.torso] = height
        self.hold(height)

    def step_over(self, height: float) -> float:
        """Let obstacles lower than ``height`` m pass under the chassis; return the resulting clearance, m."""
        section, geom, model = self._section, self._chassis, self._model
        half = max(0.01, (section.clearance + section.chassis_height - height) / 2)
        clearance = section.clearance + section.chassis_height - 2 * half
        model.geom_size[geom][1], model.geom_pos[geom][2] = half, clearance + half
        model.geom_rbound[geom] = math.hypot(section.radius, half)
        model.geom_aabb[geom] = [0, 0, 0, section.radius, section.radius, half]
        return clearance
