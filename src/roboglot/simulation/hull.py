"""One robot's body in the physics: where it is, how it is driven, what it touches. Truth, world frame.

The simulated components read and drive it; nothing outside the simulation sees it.
"""

from __future__ import annotations

import math
from typing import Any

from roboglot.model.geometry import Pose, Twist, wrap_angle
from roboglot.simulation.body import Body

GRAVITY = 9.81
LEG_GAIN = 8000.0  # N/m, of the servo that holds the torso
TORSO = 0.4  # of the mass; the rest is the chassis


class Hull:
    """Handles into MuJoCo's arrays for one robot."""

    def __init__(self, model: Any, data: Any, name: str, body: Body, elevations: list[float]) -> None:
        self._model, self._data, self._elevations = model, data, elevations
        self.body = body
        self._q = model.joint(f"{name} x").qposadr[0]
        self._v = model.joint(f"{name} x").dofadr[0]
        self._qpos, self._qvel = data.qpos, data.qvel
        first = model.actuator(f"{name} x").id
        self._drive = slice(first, first + 3)
        self._ctrl, self._force = data.ctrl, data.actuator_force
        self._solid = [model.geom(f"{name} {part}").id for part in ("chassis", "torso")]
        if body.legs:
            self._legs = model.actuator(f"{name} torso").id
            self._leg_gains = (model.actuator_gainprm[self._legs].copy(), model.actuator_biasprm[self._legs].copy())
        self._sag = body.hull.mass * TORSO * GRAVITY / LEG_GAIN
        self._coordinates = slice(self._q, self._q + (5 if body.legs else 4))
        self._rates = slice(self._v, self._v + (5 if body.legs else 4))
        self.floor = 0
        self.pose = Pose()  # base_link in world
        self.turned = 0.0  # yaw without wrapping, rad
        self.elevation = 0.0  # height of the floor under it, m
        self.belly = body.hull.height - body.hull.torso_height  # height of the torso's underside above the floor, m
        self.motion = (0.0, 0.0, 0.0, 0.0)  # along x, y and z (m/s, world; z of the torso), and the turn rate (rad/s)
        self.touches: list[tuple[float, float]] = []  # where solids touch the hull now, base_link, docks left out

    @property
    def geoms(self) -> list[int]:
        """The geoms that bump into things."""
        return self._solid

    # -- where it is -------------------------------------------------------------------------------------------------

    def place(self, pose: Pose, floor: int) -> None:
        """Put it there, standing still."""
        self._qpos[self._q : self._q + 4] = (pose.x, pose.y, self._elevations[floor], pose.yaw)
        self._qvel[self._v : self._v + 4] = 0.0
        self.floor = floor
        self.look()

    def look(self) -> None:
        """Read from the physics where it is and how it moves: once after every step, because reading is dear."""
        x, y, z, yaw, *belly = self._qpos[self._coordinates].tolist()
        vx, vy, vz, turn, *rising = self._qvel[self._rates].tolist()
        self.pose, self.turned = Pose(x, y, wrap_angle(yaw)), yaw
        self.motion = vx, vy, vz + sum(rising), turn
        if belly:
            self.belly = belly[0]
        if z != self.elevation:
            self.elevation = z
            self.floor = max((i for i, height in enumerate(self._elevations) if height <= z + 0.5), default=0)

    def covers(self, height: float) -> bool:
        """Whether chassis or torso reach to ``height`` m above the floor."""
        hull, belly = self.body.hull, self.belly
        return (
            hull.clearance <= height < hull.clearance + hull.chassis_height
            or belly <= height < belly + hull.torso_height
        )

    # -- how it moves ------------------------------------------------------------------------------------------------

    def drive(self, twist: Twist, seconds: float) -> None:
        """Let the wheels pull at ``twist`` (base_link) for the next ``seconds``."""
        yaw = self.turned + twist.yaw * seconds / 2
        c, s = math.cos(yaw), math.sin(yaw)
        self._ctrl[self._drive] = (c * twist.x - s * twist.y, s * twist.x + c * twist.y, twist.yaw)

    @property
    def traction_power(self) -> float:
        """What the wheels give now, W; slipping wheels work against the floor, braking gives nothing back."""
        return max(0.0, float(self._force[self._drive] @ self._ctrl[self._drive]))

    # -- legs --------------------------------------------------------------------------------------------------------

    def hold_belly(self, height: float | None) -> None:
        """Hold the torso at ``height`` m, or let it sink (None)."""
        limp = height is None
        self._model.actuator_gainprm[self._legs] = 0.0 if limp else self._leg_gains[0]
        self._model.actuator_biasprm[self._legs] = 0.0 if limp else self._leg_gains[1]
        if height is not None:
            self._ctrl[self._legs] = height + self._sag

    def put_belly(self, height: float) -> None:
        """Have the torso at ``height`` m at once."""
        self._qpos[self._q + 4] = height
        self.look()
        self.hold_belly(height)
