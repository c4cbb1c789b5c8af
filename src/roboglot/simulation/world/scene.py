"""The world as a MuJoCo model: floors, solids, lift car, people, spare obstacles, robots. The only maker of geoms.

Contacts by bits: chassis and things collide with solids that MOVE, and near walls with those that STAND; a torso, as
wide as the chassis, only with those that HANG above the chassis or move; the casters under robots touch floors only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, TypedDict, Unpack

import mujoco

from roboglot.simulation.bodies.body import Body
from roboglot.simulation.bodies.hull import DRIVE_GAIN, wheel_places
from roboglot.simulation.bodies.hull_legs import LEG_GAIN, TORSO
from roboglot.simulation.bodies.support import FOOT, GRAVITY, HANGS, MOVES, STANDS
from roboglot.simulation.building.blueprint import Rectangle, Solid, SolidKind, holes_of, shaft_of, slabs_of, solids_of
from roboglot.simulation.building.props import AWAY, keys_of
from roboglot.simulation.building.terrain import Ground, pieces_of
from roboglot.simulation.components.sensing.bumper import BumperSection
from roboglot.simulation.world.declarations import BadFile
from roboglot.simulation.world.description import SOLIDS_MAX, Floor, Lift, Person, Terrain, Thing, WorldDescription

TIMESTEP = 0.02 / 3  # s: a third of a tick, and of a contact's time constant
SLAB = 0.2
VISITORS_MAX = 8
PIT = 1.2  # m below the lowest floor
BELLY_PLAY = 0.002
CASTER = 0.02
BUMPER_TRAVEL = 0.006  # m of clearance after which the bumper is released
TILT_MAX = math.radians(70)
TYRES = 0.4  # N m s/rad per kg: damping of the body by tyres and suspension


def build(world: WorldDescription, robots: Sequence[tuple[str, Body]]) -> mujoco.MjModel:
    """Return the compiled model. Raises BadFile for too many solids."""
    spec = _empty_spec()
    root = spec.worldbody
    solids = 0
    for number, floor in enumerate(world.floors):
        solids = _add_floor(spec, world, number, floor, solids)
    if solids > SOLIDS_MAX:
        raise BadFile(f"{world.name}: {solids} walls and pieces of furniture are more than {SOLIDS_MAX}")
    if world.lift is not None:
        _add_car(spec, world.lift, world.elevation(world.lift.parked_at))
    for key in keys_of(world):
        box = root.add_body(name=key, mocap=True, pos=AWAY)
        _add_standing(box, mujoco.mjtGeom.mjGEOM_BOX, [0.1, 0.1, 0.1], STANDS | HANGS | MOVES, name=key)
    for key in visitors():
        _add_person(root, key, Person(path=()))
    uneven = Ground(world).uneven
    for name, body in robots:
        _add_robot(spec, name, body, tilting=uneven)
    model = spec.compile()
    for key in (*keys_of(world), *visitors()):
        model.body_conaffinity[model.body(key).id] = 0  # away: collision checks would cost time
    return model


def _empty_spec() -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.option.timestep = TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = [0, 0, -GRAVITY]
    spec.option.iterations = 20
    spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_SLEEP  # static objects are not repositioned
    spec.compiler.degree = False
    return spec


def _add_floor(spec: mujoco.MjSpec, world: WorldDescription, number: int, floor: Floor, solids: int) -> int:
    """Add a storey with everything on it; return the new total of solids, after ``solids`` before."""
    root, elevation = spec.worldbody, world.elevation(number)
    _add_slabs(root, floor, world.lift, elevation)
    hanging = root.add_body(name=f"hanging {number}")
    for solid in solids_of(floor, world.lift, lift_here=True):
        if solid.kind is not SolidKind.DOCK:  # docks and landing doors are props
            above = solid.base > 0.0
            bits = HANGS | STANDS if above else STANDS
            _add_solid(hanging if above else root, solid, elevation, f"{solid.kind} {solids}", bits)
            solids += 1
    for index, terrain in enumerate(floor.relief):
        _add_terrain(spec, terrain, elevation, f"terrain {number} {index}")
    for thing in floor.things:
        _add_thing(root, thing, elevation)
    for index, person in enumerate(floor.people):
        _add_person(root, f"person {number} {index}", person)
    return solids


def visitors() -> list[str]:
    """Return the physics' names of the spare people, who can be added to a running world."""
    return [f"visitor {number}" for number in range(1, VISITORS_MAX + 1)]


def _add_person(root: mujoco.MjsBody, key: str, person: Person) -> None:
    body = root.add_body(name=key, mocap=True, pos=AWAY)
    size = [person.radius, max(0.01, person.height / 2 - person.radius), 0]
    _add_standing(body, mujoco.mjtGeom.mjGEOM_CAPSULE, size, STANDS | HANGS | MOVES)


class _Placed(TypedDict, total=False):
    """Place of a geom in its body, and its name."""

    name: str
    pos: list[float]
    quat: list[float]


def _add_standing(
    body: mujoco.MjsBody, kind: mujoco.mjtGeom, size: list[float], bits: int, **placed: Unpack[_Placed]
) -> None:
    """Add a geom that robots bump into and rays hit."""
    body.add_geom(type=kind, size=size, contype=0, conaffinity=bits, friction=[0.3, 0.005, 0.0001], **placed)


def _add_slabs(root: mujoco.MjsBody, floor: Floor, lift: Lift | None, elevation: float) -> None:
    for slab in slabs_of(floor, lift):
        _add_slab(root, slab, elevation)
    if elevation == 0.0:  # objects that fall through the lowest floor land in a pit
        for pit in holes_of(floor) + ([shaft_of(lift)] if lift else []):
            _add_slab(root, pit, -PIT)


def _add_slab(root: mujoco.MjsBody, slab: Rectangle, elevation: float) -> None:
    root.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[slab.width / 2, slab.depth / 2, SLAB / 2],
        pos=[slab.x + slab.width / 2, slab.y + slab.depth / 2, elevation - SLAB / 2],
        contype=0,
        conaffinity=2,
    )


def _add_solid(root: mujoco.MjsBody, solid: Solid, elevation: float, name: str, bits: int) -> None:
    width, depth, height = solid.size
    pos = [solid.pose.x, solid.pose.y, elevation + solid.base + height / 2]
    quat = [math.cos(solid.pose.yaw / 2), 0, 0, math.sin(solid.pose.yaw / 2)]
    kind, size = mujoco.mjtGeom.mjGEOM_BOX, [width / 2, depth / 2, height / 2]
    if solid.round:
        kind, size = mujoco.mjtGeom.mjGEOM_CYLINDER, [width / 2, height / 2, 0]
    _add_standing(root, kind, size, bits, pos=pos, quat=quat, name=name)


def _add_car(spec: mujoco.MjSpec, lift: Lift, elevation: float) -> None:
    """Add the lift car's floor on a slide joint; without gravity, so that it stands exactly at its goal."""
    yaw = math.radians(lift.facing)
    car = spec.worldbody.add_body(
        name="car",
        pos=[lift.at[0], lift.at[1], elevation - SLAB / 2],
        quat=[math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)],
        gravcomp=1.0,
    )
    car.add_joint(name="car", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1])
    car.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[lift.size[0] / 2, lift.size[1] / 2, SLAB / 2],
        contype=0,
        conaffinity=2,
        mass=400.0,
    )
    servo = spec.add_actuator(name="car", trntype=mujoco.mjtTrn.mjTRN_JOINT, target="car")
    servo.set_to_position(kp=4e6, dampratio=1.0)


def _add_terrain(spec: mujoco.MjSpec, terrain: Terrain, elevation: float, name: str) -> None:
    """Add convex pieces that carry wheels as floors do."""
    for index, corners in enumerate(pieces_of(terrain)):
        shape = [(x, y, z + elevation) for x, y, z in corners]
        spec.add_mesh(name=f"{name} {index}", uservert=[value for corner in shape for value in corner])
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=f"{name} {index}",
            contype=0,
            conaffinity=2,
            name=f"{name} {index}",
        )


def _add_thing(root: mujoco.MjsBody, thing: Thing, elevation: float) -> None:
    """Add a can on a frictionless foot: it never falls over; damping stands for its friction on the floor."""
    never = mujoco.mjtSleepPolicy.mjSLEEP_NEVER  # it may be moved at any time
    body = root.add_body(name=f"thing {thing.name}", sleep=never)
    for axis, direction, damping in (("x", [1, 0, 0], 1.0), ("y", [0, 1, 0], 1.0), ("z", [0, 0, 1], 0.0)):
        body.add_joint(
            name=f"thing {thing.name} {axis}",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=direction,
            damping=damping * 10.0 * thing.mass,
            ref=0.0,
        )
    _add_foot(body, f"thing {thing.name} foot", thing.diameter / 4, (0.0, 0.0))
    shape = Cylinder(thing.diameter / 2, thing.height - 0.002, 0.002)
    _add_hull(body, f"thing {thing.name}", shape, thing.mass, STANDS | HANGS | MOVES)
    body.pos = [*thing.at, elevation]


def _add_foot(body: mujoco.MjsBody, name: str, radius: float, at: tuple[float, float]) -> None:
    """Add a frictionless ball under a body. By its priority, contacts take its friction, not the larger of the two."""
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[radius, 0, 0],
        pos=[*at, radius],
        contype=FOOT,
        conaffinity=0,
        condim=1,
        priority=1,
        mass=0.01,
    )


def _add_robot(spec: mujoco.MjSpec, name: str, body: Body, tilting: bool) -> None:
    """Add a robot: a driven chassis, and a torso on a slide above it."""
    chassis = spec.worldbody.add_body(name=name)
    _add_chassis(chassis, name, body, tilting)
    _add_torso(spec, chassis, name, body)
    _add_drive(spec, name, body)


def _add_chassis(chassis: mujoco.MjsBody, name: str, body: Body, tilting: bool) -> None:
    """Add the chassis on slides x, y, z and a yaw hinge, carried by one frictionless caster.

    On uneven ground (``tilting``) it also has hinges for pitch and roll, and a foot in place of each wheel.
    """
    hull = body.hull
    for axis, direction in (("x", [1, 0, 0]), ("y", [0, 1, 0]), ("z", [0, 0, 1])):
        chassis.add_joint(name=f"{name} {axis}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=direction)
    chassis.add_joint(name=f"{name} yaw", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
    if tilting:
        for axis, direction in (("pitch", [0, 1, 0]), ("roll", [1, 0, 0])):
            chassis.add_joint(
                name=f"{name} {axis}",
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=direction,
                limited=True,
                range=[-TILT_MAX, TILT_MAX],
                damping=TYRES * hull.mass * hull.radius**2,
            )
        for index, place in enumerate(wheel_places(body)):
            _add_foot(chassis, f"{name} wheel {index}", body.base.wheel_radius, place)
    else:
        _add_foot(chassis, f"{name} wheel 0", CASTER, (0.0, 0.0))
    shape = Cylinder(hull.radius, hull.chassis_height, hull.clearance)
    _add_hull(chassis, f"{name} chassis", shape, hull.mass * (1 - TORSO), STANDS | MOVES, _bumper_travel(body))


def _add_torso(spec: mujoco.MjSpec, chassis: mujoco.MjsBody, name: str, body: Body) -> None:
    """Add the torso above the chassis; legs move it up and down by a servo."""
    hull = body.hull
    belly = body.legs.standing if body.legs else hull.height - hull.torso_height
    torso = chassis.add_body(name=f"{name} torso")
    if body.legs:
        torso.add_joint(
            name=f"{name} torso",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=[0, 0, 1],
            limited=True,
            range=[
                min(body.legs.lying, body.legs.lowest) - BELLY_PLAY,
                max(body.legs.standing, body.legs.highest) + BELLY_PLAY,
            ],
            damping=150.0,
        )
        legs = spec.add_actuator(name=f"{name} torso", trntype=mujoco.mjtTrn.mjTRN_JOINT, target=f"{name} torso")
        legs.set_to_position(kp=LEG_GAIN, dampratio=1.0)
    below = 0.0 if body.legs else belly
    shape = Cylinder(hull.radius, hull.torso_height, below)
    _add_hull(torso, f"{name} torso", shape, hull.mass * TORSO, HANGS, _bumper_travel(body))
    gap = (max(belly, body.legs.highest) if body.legs else belly) - hull.clearance - hull.chassis_height
    if gap > 0.0:
        _add_waist(torso, f"{name} waist", hull.radius, gap, below)


def _bumper_travel(body: Body) -> float:
    return BUMPER_TRAVEL if body.get(BumperSection) else 0.0


class Cylinder(NamedTuple):
    """An upright cylinder; ``base``: height of its underside. All in m."""

    radius: float
    height: float
    base: float


def _add_hull(body: mujoco.MjsBody, name: str, shape: Cylinder, mass: float, bits: int, travel: float = 0.0) -> None:
    """Add a cylinder that bumps into things; within ``travel`` m, contacts are reported without a force."""
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[shape.radius, shape.height / 2, 0],
        pos=[0, 0, shape.base + shape.height / 2],
        contype=bits,
        conaffinity=bits,
        friction=[0.2, 0.005, 0.0001],
        priority=1,
        mass=mass,
        gap=travel,
    )


def _add_waist(body: mujoco.MjsBody, name: str, radius: float, gap: float, top: float) -> None:
    """Add a cylinder that only rays hit, between chassis and torso (wheels, legs, the lidar's own column)."""
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius, gap / 2, 0],
        pos=[0, 0, top - gap / 2],
        contype=0,
        conaffinity=0,
        mass=0.0,
    )


def _add_drive(spec: mujoco.MjSpec, name: str, body: Body) -> None:
    """Add velocity servos along x, y and around z, as strong as the wheels' grip on the floor."""
    hull = body.hull
    grip = body.base.traction * hull.mass * GRAVITY
    inertia = hull.mass * hull.radius**2 / 2
    for axis, gain, force in (
        ("x", hull.mass * DRIVE_GAIN, grip),
        ("y", hull.mass * DRIVE_GAIN, grip),
        ("yaw", inertia * DRIVE_GAIN, grip * hull.radius),
    ):
        servo = spec.add_actuator(name=f"{name} {axis}", trntype=mujoco.mjtTrn.mjTRN_JOINT, target=f"{name} {axis}")
        servo.set_to_velocity(kv=gain)
        servo.forcelimited = True
        servo.forcerange = [-force, force]
