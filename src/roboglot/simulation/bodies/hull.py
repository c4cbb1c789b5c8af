"""One robot's body in the physics: pose, drive and contacts. Truth, world frame.

The simulated components read and drive it; it is invisible outside the simulation.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboglot.kernels.layouts import (
    HULL_DRIVE_X,
    HULL_DRIVE_YAW,
    HULL_FLOOR,
    HULL_FLOOR_CHECK_Z,
    HULL_HELD,
    HULL_LAST_V,
    HULL_LOOKUP_RANGE,
    HULL_LOOKUP_X,
    HULL_UNDERSIDE,
    HULL_VX,
    HULL_WALLS,
    HULL_X,
    HULL_YAW,
)
from roboglot.model.geometry import LEVEL as STRAIGHT
from roboglot.model.geometry import Point, Pose, wrap_angle
from roboglot.simulation.bodies.body import Body
from roboglot.simulation.bodies.hull_legs import HullLegs
from roboglot.simulation.bodies.hull_state import LEVEL, HullState
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.bodies.support import GRAVITY, SETTLED, Nearness, Support
from roboglot.simulation.bodies.tables import RobotRows
from roboglot.simulation.building.terrain import Ground

if TYPE_CHECKING:
    from mujoco import MjData, MjModel

DRIVE_GAIN = 150.0  # 1/s: gain from the wheels' velocity to the body's: done in one step of physics, or it swings
STOREY = 0.05  # m up or down after which the floor is counted again
FALLING = 0.05  # m/s up or down at which wheel contact is checked
TIPPED = 1.0  # rad
SHELL = 0.4  # friction of the shell, relative to the wheels'
ROLLING = 0.02  # of the friction: resistance of a robot with free wheels
HAND_STIFFNESS, HAND_DAMPING = 60.0, 15.0  # 1/s2 and 1/s: stiffness of a hand's grip

Floats = NDArray[np.float64]


class HullContact(NamedTuple):
    """Contact on the hull (base_link, m), with a ``person``, or with a ``light`` object that does not press bumpers."""

    x: float
    y: float
    person: bool
    light: bool = False


def wheel_places(body: Body) -> list[tuple[float, float]]:
    """Return the places of the wheels, base_link, m."""
    x, y = body.base.wheel_base / 2, body.base.track / 2
    return [(x, y), (x, -y), (-x, y), (-x, -y)]


def rotation(tilt: tuple[float, float], yaw: float) -> Floats:
    """Return the rotation from base_link to world, from roll and pitch (rad) and yaw."""
    roll, pitch = tilt
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return np.array(
        (
            (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr),
        )
    )


class Hull(HullState):
    """Handles into MuJoCo's arrays for one robot.

    ``disturbed``: moved by more than physics. ``tilts``: by uneven ground.
    """

    def __init__(
        self,
        model: MjModel,
        data: MjData,
        name: str,
        body: Body,
        elevations: list[float],
        ground: Ground,
        robot_rows: RobotRows,
    ) -> None:
        super().__init__(robot_rows)
        self._model, self._data, self._elevations, self._ground = model, data, elevations, ground
        self.name, self.body = name, body
        self._q, self._v = int(model.joint(f"{name} x").qposadr[0]), int(model.joint(f"{name} x").dofadr[0])
        first = model.actuator(f"{name} x").id
        self._drive = slice(first, first + 3)
        self._applied = data.qfrc_applied
        self.mass = float(model.body_subtreemass[model.body(name).id])
        self._solid = [model.geom(f"{name} {part}").id for part in ("chassis", "torso")]
        self.tilts = ground.uneven
        self.wheels = [model.geom(f"{name} wheel {index}").id for index in range(4 if ground.uneven else 1)]
        self.support = Support(model, name, self.mass, self.wheels, self._row)
        own = model.body_rootid[model.geom_bodyid] == model.body(name).id
        self.shape: list[int] = np.flatnonzero(own).tolist()  # all geoms, including those without collisions
        self._forces = model.actuator_forcerange[self._drive].copy()
        self._share = 1.0
        self.leash: tuple[float, float] | None = None  # N in the world: the pull of a leash
        self.standing = 1.0  # share of the wheels in contact with the ground
        self.disturbed = False
        self._torso = self._sinking = -1  # its position and speed in the physics, if it has legs
        self.legs: HullLegs | None = None
        if body.legs:
            self.legs = HullLegs(model, data, name, body)
            self._torso, self._sinking = self.legs.torso, self.legs.sinking
        self._level = slice(self._q, self._q + 4), slice(self._v, self._v + 4)  # x, y, z, yaw and their rates
        self._rates = slice(self._v, self._v + 4 + 2 * self.tilts + bool(body.legs))
        servos = data.actuator_force, data.ctrl
        self._servos = [of[self._drive].data.cast("B").cast("d") for of in servos]  # forces and speeds, as they are now
        self.floor = 0
        self.tilting = LEVEL  # their rates, rad/s
        self.loose = False  # whether the wheels may have left the ground
        self.shift = Point()  # the torso's centre relative to base_link, by the legs, m
        self.clearance = body.hull.clearance  # lower objects pass under the chassis, m
        self.effort = 0.0  # power of the legs besides traction, W
        self.touches: list[HullContact] = []  # current contacts of the hull, except docks
        self.when_touched: list[Duty] = []  # start when the hull is touched
        self.edges, self.walls = Nearness(body.hull.radius), Nearness(body.hull.radius)
        self._looked = -1  # the floor on which they were last looked up; place and reach are in the row
        torso, shape = (self._torso, self._sinking, self.legs.servo if self.legs else -1), body.hull
        self.enter((self._q, self._v, first), torso, shape.height - shape.torso_height, shape.radius)

    @property
    def geoms(self) -> list[int]:
        """The geoms that collide."""
        return self._solid

    # -- where it is --

    def place(self, pose: Pose, floor: int) -> None:
        """Place the robot at ``pose`` (world), at rest."""
        self.support.release()
        self.disturbed = True
        height = self._elevations[floor]
        if self.tilts:
            wheels = [pose.compose(Pose(x, y)) for x, y in wheel_places(self.body)]
            height += max(self._ground.height(wheel.x, wheel.y, floor) for wheel in wheels)
            self._data.qpos[self._q + 4 : self._q + 6] = 0.0
        self._data.qpos[self._q : self._q + 4] = (pose.x, pose.y, height, wrap_angle(pose.yaw))
        self._data.qvel[self._rates] = self._applied[self._rates] = 0.0
        self.hand, self.overturned, self.tilt = None, False, LEVEL
        self.floor = floor
        self.look()

    def halt_at(self, pose: Pose) -> None:
        """Stop the robot at ``pose`` (world) at once."""
        self.disturbed = True
        turned = self.turned + wrap_angle(pose.yaw - self.turned)
        self._data.qpos[self._q], self._data.qpos[self._q + 1], self._data.qpos[self._q + 3] = pose.x, pose.y, turned
        self._data.qvel[self._v], self._data.qvel[self._v + 1], self._data.qvel[self._v + 3] = 0.0, 0.0, 0.0
        self.look()

    def look(self) -> None:
        """Read pose and motion from the physics."""
        self.see(self._data.qpos.tolist(), self._data.qvel.tolist())

    def see(self, positions: list[float], velocities: list[float]) -> None:
        """Take pose and motion from all positions and velocities of the physics, once after every step."""
        (place, way), row = self._level, self._row
        x, y, z, turned = positions[place]
        vx, vy, vz, turn = velocities[way]
        rising = vz
        row[HULL_X], row[HULL_X + 1], row[HULL_X + 2], row[HULL_YAW] = x, y, z, turned
        row[HULL_LAST_V : HULL_LAST_V + 4] = row[HULL_VX : HULL_VX + 4]
        if self.tilts and not self.overturned:
            q, v = self._q, self._v
            self.tilt = positions[q + 5], positions[q + 4]
            self.tilting = velocities[v + 5], velocities[v + 4]
        self.loose = self.tilts or not -FALLING <= vz <= FALLING or self.standing < 1.0 or self.hand is not None
        if self._torso >= 0:
            row[HULL_UNDERSIDE] = positions[self._torso]
            vz += velocities[self._sinking]
        row[HULL_VX], row[HULL_VX + 1], row[HULL_VX + 2], row[HULL_VX + 3] = vx, vy, vz, turn
        if not -STOREY <= z - row[HULL_FLOOR_CHECK_Z] <= STOREY:
            row[HULL_FLOOR_CHECK_Z] = z
            self.floor = max((i for i, height in enumerate(self._elevations) if height <= z + 0.5), default=0)
        away = abs(x - row[HULL_LOOKUP_X]) + abs(y - row[HULL_LOOKUP_X + 1])
        if self._looked != self.floor or away > row[HULL_LOOKUP_RANGE]:
            self._look_round(x, y)
        support, edge = self.support, self.edges.near
        if support.sprung:
            self.loose = False
            if edge or support.lifted(z):
                support.release()
        elif not (edge or self.loose or self.overturned) and -SETTLED <= rising <= SETTLED:
            support.rest(z)

    def _look_round(self, x: float, y: float) -> None:
        """Check for edges and walls nearby, and note the distance until the next check is due."""
        floor, edges, walls = self.floor, self.edges, self.walls
        edges.look(x, y, floor)
        if walls.look(x, y, floor):
            self.support.walls(walls.near)
        self._looked, row = floor, self._row
        row[HULL_LOOKUP_X], row[HULL_LOOKUP_X + 1] = x, y
        row[HULL_FLOOR], row[HULL_WALLS] = floor, walls.away(x, y, floor)
        row[HULL_LOOKUP_RANGE] = min(edges.left(x, y, floor), walls.left(x, y, floor))

    @property
    def rise(self) -> float:
        """Height of base_link above its floor, m."""
        return self.elevation - self._elevations[self.floor]

    @property
    def position(self) -> Floats:
        """Position of base_link in world (x, y, z), m."""
        return np.array((self.x, self.y, self.elevation))

    def seen_from(self, x: float, y: float) -> tuple[float, float]:
        """Return a place of the world in base_link, m."""
        c, s = math.cos(self.pose.yaw), math.sin(self.pose.yaw)
        x, y = x - self.x, y - self.y
        return c * x + s * y, c * y - s * x

    def to_world(self, points: Floats) -> Floats:
        """Return directions (n x 3) of base_link in the world frame."""
        return points @ rotation(self.tilt, self.turned).T

    def held(self, points: Floats) -> Floats:
        """Return directions (n x 3) of the torso's frame in base_link, by the legs' attitude."""
        held = self.attitude
        return points @ rotation((held.roll, held.pitch), held.yaw).T if held != STRAIGHT else points

    def covers(self, height: float) -> bool:
        """True if the robot's body is at ``height`` m above the floor."""
        return self.clearance <= height - self.rise < self.belly + self.body.hull.torso_height

    # -- how it moves --

    def turn_wheels(self, seconds: float) -> None:
        """Turn the wheels as commanded for the next ``seconds``; a kernel does the same for all on level ground."""
        speeds, row = self._servos[1], self._row
        if row[HULL_HELD]:
            speeds[0] = speeds[1] = speeds[2] = 0.0  # held by a hand, or lying
            return
        vx, vy, turn = row[HULL_DRIVE_X], row[HULL_DRIVE_X + 1], row[HULL_DRIVE_YAW]
        if self.tilts:  # the wheels measure along the slope and hold against it
            roll, pitch = self.tilt
            vx = vx * math.cos(pitch) - GRAVITY * math.tan(pitch) / DRIVE_GAIN
            vy = vy * math.cos(roll) + GRAVITY * math.tan(roll) / DRIVE_GAIN
        if vx or vy:
            yaw = self.turned + turn * seconds / 2
            c, s = math.cos(yaw), math.sin(yaw)
            vx, vy = c * vx - s * vy, s * vx + c * vy
        speeds[0], speeds[1], speeds[2] = vx, vy, turn

    def stand(self, wheels: float) -> None:
        """Set the share of wheels on the ground, which limits the drive's force."""
        self.standing = wheels
        share = ROLLING if self._free else wheels
        if self.hand is not None:
            share = 1.0
        elif self.overturned:
            share = SHELL
        elif self.tilts:
            share *= self._ground.grip(self.x, self.y, self.floor)
        if share != self._share:
            self._share = share
            self._model.actuator_forcerange[self._drive] = self._forces * share

    def roll_freely(self, free: bool) -> None:
        """Release the wheels, leaving rolling resistance only; or brake with them again."""
        self._free = free
        self._note_held()
        self._share = ROLLING if free else 1.0
        self._model.actuator_forcerange[self._drive] = self._forces * self._share

    # -- hands --

    def lift(self, height: float | None) -> None:
        """Hold the robot ``height`` m above its present place, or let go (None)."""
        self.robot_rows.tables.before_change()
        self.support.release()
        self.hand = None if height is None else self.elevation + height
        self.loose = True
        self._applied[self._rates] = 0.0

    def push(self, x: float, y: float, z: float) -> None:
        """Apply an impulse (N s, base_link)."""
        self.robot_rows.tables.before_change()
        self.support.release()
        self.disturbed = True
        c, s = math.cos(self.turned), math.sin(self.turned)
        mass = self.mass
        self._data.qvel[self._v : self._v + 3] += ((c * x - s * y) / mass, (s * x + c * y) / mass, z / mass)
        self.loose = True

    def overturn(self, roll: float) -> None:
        """Lay the robot on a side or its back (rad; 0: on its wheels): changes the attitude, not the physics' shape."""
        self.support.release()
        self.overturned = abs(roll) > TIPPED
        self.tilt, self.tilting = (roll, 0.0), LEVEL
        self.loose = True

    def handle(self) -> None:
        """Apply the hand's force before a physics step."""
        if self.hand is None:
            return
        mass = self.mass
        pull = mass * (GRAVITY + HAND_STIFFNESS * (self.hand - self.elevation) - HAND_DAMPING * self.motion[2])
        self._applied[self._v + 2] = pull
        if self.tilts:
            inertia = mass * self.body.hull.radius**2
            for index, (angle, rate) in enumerate(zip(reversed(self.tilt), reversed(self.tilting), strict=True)):
                torque = -inertia * (100.0 * angle + 20.0 * rate)
                self._applied[self._v + 4 + index] = torque

    @property
    def traction_power(self) -> float:
        """Current power of the wheels, W; slip on the floor costs power, braking returns none."""
        forces, speeds = self._servos
        return max(0.0, forces[0] * speeds[0] + forces[1] * speeds[1] + forces[2] * speeds[2])

    # -- leaps --

    def leap(self, x: float, y: float, turn: float, airtime: float) -> None:
        """Take off at this velocity (base_link, m/s, rad/s), and fly for ``airtime`` s over level ground."""
        self.support.release()
        c, s = math.cos(self.turned), math.sin(self.turned)
        up = GRAVITY * (airtime + float(self._model.opt.timestep)) / 2  # Euler integration falls slightly too fast
        self._data.qvel[self._rates] = 0.0  # the torso has no momentum of its own any more: it carries the rest along
        self._data.qvel[self._v : self._v + 4] = (c * x - s * y, s * x + c * y, up, turn)
        self.loose = True

    def stop(self) -> None:
        """Stop the motion over the ground: the feet have landed."""
        self._data.qvel[self._v : self._v + 2] = 0.0
        self._data.qvel[self._v + 3] = 0.0
