"""Motion of robots while nothing can touch them, without MuJoCo's steps; its results agree with them up to rounding.

Needs the compiled kernels; until they are loaded, MuJoCo moves all robots.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from roboglot.kernels import loading
from roboglot.kernels.arrays import FloatArray
from roboglot.simulation.bodies.sleep import RESTS
from roboglot.simulation.bodies.support import GRAVITY
from roboglot.simulation.building.props import AWAY
from roboglot.simulation.building.walls import Walls
from roboglot.values import dataclass

if TYPE_CHECKING:
    from mujoco import MjData, MjModel

LOWEST = AWAY[2] / 2  # m below which movable bodies are away
MARGIN = 0.012  # m around each robot: covers contacts beyond the shapes, and what speed gains in a tick


@dataclass(frozen=True, slots=True)
class _Kernels:
    """The compiled functions of ``kernels/free_motion.py``."""

    clear: Callable[..., bool]
    advance: Callable[..., bool]


class FreeMotion:
    """All robots of a world; its floors are level, and only robots and a lift's car move.

    ``scene``, ``geoms``, ``state``, ``servos`` and ``settings`` are what ``kernels/ticks.py`` takes.
    """

    def __init__(self, model: MjModel, data: MjData, hulls: FloatArray, walls: Walls, *, car: bool) -> None:
        """``hulls``: the table of all; ``car``: whether there is a lift."""
        self._kernels: _Kernels | None = None
        self._data = data
        movable = np.flatnonzero(model.body_mocapid >= 0)
        geoms = model.body_geomadr[movable[np.argsort(model.body_mocapid[movable])]].astype(np.int64)
        people = model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_CAPSULE
        shapes = model.geom_size, np.where(people, -1 - geoms, geoms)
        self.scene = walls.table, data.mocap_pos, data.mocap_quat, shapes[0]
        self.geoms = shapes[1]  # by movable body
        self.state = (
            data.qpos,
            data.qvel,
            data.ctrl,
            data.qacc,
            data.actuator_force,
            model.dof_M0,
            model.qpos_spring,
            model.jnt_stiffness,
            model.dof_damping,
        )
        uprights = np.zeros((len(hulls), 7))
        gains, limits = model.actuator_gainprm, model.actuator_forcerange
        self.servos = uprights, model.jnt_range, gains, model.actuator_biasprm, limits
        self.settings = float(model.opt.timestep), LOWEST, MARGIN, GRAVITY
        self._near = hulls, *self.scene, self.geoms, LOWEST, MARGIN
        (*moving, slack, stiffness, damping), (_, ranges, *servos) = self.state, self.servos
        springs = ranges, slack, stiffness, damping
        self._motion = hulls, uprights, *moving, *springs, *servos, GRAVITY, float(model.opt.timestep)
        self._car: tuple[memoryview[float], memoryview[float], memoryview[float]] | None = None  # place, rate and goal
        if car:
            joint, servo = model.joint("car"), model.actuator("car").id
            q, v = joint.qposadr[0], joint.dofadr[0]
            views = data.qpos[q : q + 1], data.qvel[v : v + 1], data.ctrl[servo : servo + 1]
            place, rate, goal = (view.data.cast("B").cast("d") for view in views)
            self._car = place, rate, goal

    def load_kernels(self) -> None:
        """Compute with the compiled kernels from now on."""
        with loading():
            from roboglot.kernels import free_motion

        self._kernels = _Kernels(free_motion.clear, free_motion.advance)

    @property
    def loaded(self) -> bool:
        """True once the kernels are in use."""
        return self._kernels is not None

    def clear(self, seconds: float, *, known: bool) -> bool:
        """Return whether no robot can touch anything in a step of ``seconds``, and none needs a closer look.

        ``known``: contacts were searched since something last jumped; robots at rest need no new search.
        """
        known = known and self.parted
        return self._kernels is not None and self._kernels.clear(*self._near, seconds, known)

    def step(self, steps: int) -> bool:
        """Advance robots that are clear by so many steps of the physics; return False if only MuJoCo can."""
        return self._kernels is not None and self.free and self._kernels.advance(*self._motion, steps)

    @property
    def parted(self) -> bool:
        """True if no contact is left from the last step."""
        return not self._data.nefc

    @property
    def free(self) -> bool:
        """True if no contact is left, and the lift's car stands."""
        return self.parted and self._car_stands()

    def _car_stands(self) -> bool:
        if self._car is None:
            return True
        place, rate, goal = self._car
        return -RESTS <= rate[0] <= RESTS and -RESTS <= place[0] - goal[0] <= RESTS
