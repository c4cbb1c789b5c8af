"""The world: the only truth. Steps the physics and every robot's components on the clock, 50 times a second.

Loads MuJoCo when the first world is made, not when imported. Knows no map and no estimate.
"""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

from roboglot.model.clock import Clock, RealClock, Timer
from roboglot.model.components.interaction.armor import PlatePlace
from roboglot.model.components.sensing.touch import TouchKind
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Point, Pose, Vector3
from roboglot.model.robot import Description, Robot
from roboglot.model.sound import Sound, claps
from roboglot.simulation.bodies.assembly import SimulatedRobot
from roboglot.simulation.bodies.body import load_body
from roboglot.simulation.bodies.companion import Companion
from roboglot.simulation.bodies.equipment import Equipment
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.parts import Matter, Parts
from roboglot.simulation.bodies.senses import Senses
from roboglot.simulation.building.building import Building
from roboglot.simulation.building.things import Thing
from roboglot.simulation.detectors.glance import Surroundings
from roboglot.simulation.faults.faults import Faults
from roboglot.simulation.people.people import Walker, keyed
from roboglot.simulation.people.routine import Clap, Say
from roboglot.simulation.people.stage_people import Actor
from roboglot.simulation.radio.gadgets import Gadgets
from roboglot.simulation.radio.radio import Radio
from roboglot.simulation.rendering.studio import Studio
from roboglot.simulation.sound.sound import Air, Source, Speech
from roboglot.simulation.sound.voice import hummed
from roboglot.simulation.world.beads import Beads, Landing
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.pace import Pace
from roboglot.simulation.world.placing import Places
from roboglot.simulation.world.randomness import stream
from roboglot.simulation.world.sight import Sight
from roboglot.simulation.world.sightlines import SightLines

log = logging.getLogger(__name__)
TICK = 0.02  # s: controls and sensors
CATCH_UP_MAX = 5  # ticks in one go, so that others get their turn
BEHIND_MAX = 25  # ticks a slow machine may lag before time is skipped
ROBOTS_MAX = 200


@dataclass(frozen=True, slots=True)
class RobotPlacement:
    """Which body a robot has and where it starts; by default on the first free dock."""

    name: str
    body: str = "universal"
    start: Pose | None = None
    floor: int = 0


class World:
    """A described world with robots in it. Raises ValueError in plain words if it cannot be built."""

    def __init__(
        self, description: WorldDescription, robots: Sequence[RobotPlacement], *, clock: Clock, seed: int = 1
    ) -> None:
        from roboglot.simulation.world.physics import Physics  # MuJoCo takes a quarter of a second to load

        if len(robots) > ROBOTS_MAX:
            raise ValueError(f"{len(robots)} robots are more than {ROBOTS_MAX}")
        self.description = description
        self._clock, self._seed = clock, seed
        bodies = {placement.name: load_body(placement.body) for placement in robots}
        if len(bodies) < len(robots):
            raise ValueError("two robots have the same name")
        self._physics = Physics(description, bodies)
        self._radio = Radio(description)
        self._robots: dict[str, SimulatedRobot] = {}
        self._walkers = keyed([floor.people for floor in description.floors])
        self.building = Building(description, self._physics, self._walkers)
        hulls, props = list(self._physics.hulls.values()), self._physics.props
        self._sight = Sight(description, hulls, self._walkers, props)
        self._rays = self._physics.rays
        self._owners: dict[str, Robot] = {}
        self._matter = Matter(self._rays, Beads(self._rays), self._physics.things)
        life = self._owners, self._matter.beads, self.building.lift
        self._studio = Studio(description, hulls, self._walkers, props, self._physics.things, life, clock)
        self._air = Air(description)
        self._lines = lines = SightLines(description, hulls, self._walkers, props)
        self._around = Surroundings(description, hulls, self._walkers, props, lines)
        self._chances: dict[str, np.random.Generator] = {}
        self._equipment: dict[str, Equipment] = {}
        self._companions: dict[str, Companion] = {}
        self.gadgets = Gadgets(description, self._walkers, self._radio)
        self._senses: list[Senses] = []
        for index, walker in enumerate(self._walkers):
            self._physics.move_person(index, walker.pose, walker.floor)
        places = Places(description)
        for placement in robots:
            radius = bodies[placement.name].hull.radius
            self._hull(placement.name).place(*places.next(placement.start, placement.floor, radius))
        self._loading: asyncio.Task[None] | None = None
        self.faults = Faults(self, description.faults)
        self._ticks = 0
        self._origin = 0.0
        self._timer: Timer | None = None
        self._pace = Pace(clock.speed if isinstance(clock, RealClock) else 1.0)

    def description_of(self, name: str) -> Description:
        """A robot's name plate."""
        serial = f"RG-{self._seed:04d}-{name}"
        return self._hull(name).body.describe(serial=serial, software_version=version("roboglot"))

    def equip(self, robot: Robot) -> None:
        """Give ``robot`` the simulated components of the body that was placed under its id."""
        hull = self._hull(robot.id)
        globe = self.description.georeference
        north = math.radians(globe.north if globe else 90.0)
        self._robots[robot.id] = SimulatedRobot(
            robot, hull, self.building.docks, self._radio, self._sight, self._matter, self._seed, TICK, north
        )
        self._owners[robot.id] = robot
        self._equipment[robot.id] = Equipment(robot, hull, self.building, self._rays, self._seed)
        self._companions[robot.id] = Companion(robot, hull, self.description, self._rays, self.gadgets, self._seed)
        self._senses.append(Senses(robot, hull, self._studio, self._air, self._around, self._seed))

    async def prepare(self, *, wait: bool) -> None:
        """Load the compiled kernels; return at once, or with ``wait`` when they are used (a lockstep world waits)."""
        self._loading = asyncio.create_task(asyncio.to_thread(self._sight.load_kernel), name="kernels of the world")
        if wait:
            await self._loading

    def start(self) -> None:
        """Let time pass; needs the running loop."""
        if self._timer is None:
            self._origin = self._clock.time() - self._ticks * TICK
            self._timer = self._clock.call_at(self._due(), self._beat)

    def close(self) -> None:
        """Stop."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._loading is not None:
            self._loading.cancel()
        for senses in self._senses:
            senses.close()
        for companion in self._companions.values():
            companion.close()

    # -- truth, for tests and for those who make worlds ----------------------------------------------------------------

    def pose_of(self, name: str) -> Pose:
        """Where a robot's base_link is, world frame."""
        return self._hull(name).pose

    def height_of(self, name: str) -> float:
        """How high a robot's base_link is above its floor's level, m: on a ramp, or in somebody's hand."""
        return self._hull(name).rise

    def floor_of(self, name: str) -> int:
        """Which floor it is on; 0 is the lowest."""
        return self._hull(name).floor

    def place(self, name: str, pose: Pose, floor: int | None = None) -> None:
        """Lift a robot and put it elsewhere; its odometry does not notice. Raises ValueError off the floors."""
        hull = self._hull(name)
        floor = hull.floor if floor is None else floor
        if not Places(self.description).inside(pose, floor):
            raise ValueError(f"floor {floor} of this world has no place ({pose.x:g}, {pose.y:g}, {pose.yaw:g})")
        hull.place(pose, floor)
        self._sight.moved()
        if name in self._robots:
            self._robots[name].displaced()
            self._equipment[name].displaced()

    def add_obstacle(self, pose: Pose, size: tuple[float, float, float] = (0.4, 0.4, 1.0), floor: int = 0) -> int:
        """Have a box (x, y, z extent in m) stand there from now on; returns its number for ``remove_obstacle``."""
        return self._physics.add_obstacle(pose, size, floor)

    def remove_obstacle(self, number: int) -> None:
        """Take it away."""
        self._physics.remove_obstacle(number)

    def make_sound(self, sound: Sound, at: Point, floor: int = 0, loudness: float = 1.0) -> None:
        """Have ``sound`` be heard from there, from now on. Raises ValueError when too much is to be heard already."""
        self._air.emit(Source(sound, at, floor, self._clock.time(), loudness))

    def robot(self, name: str) -> Robot:
        """The robot that was given its components under this name, or NotFound."""
        try:
            return self._owners[name]
        except KeyError:
            raise NotFound(f"no robot here is named {name!r}") from None

    @property
    def robot_names(self) -> Sequence[str]:
        """All that were given their components."""
        return tuple(self._owners)

    @property
    def time(self) -> float:
        """Robot time of the last tick, s."""
        return self._origin + self._ticks * TICK

    def has_room(self, name: str, pose: Pose) -> bool:
        """Whether the robot could stand there, on its floor, without touching what stands still or another robot."""
        hull = self._hull(name)
        others = [other for other in self._physics.hulls.values() if other is not hull and other.floor == hull.floor]
        radius = hull.body.hull.radius
        if any(other.pose.distance_to(pose) < radius + other.body.hull.radius for other in others):
            return False
        return Places(self.description).free(pose, hull.floor, radius)

    def chance(self, purpose: str) -> np.random.Generator:
        """Random numbers for one purpose, from the world's seed."""
        return self._chances.setdefault(purpose, stream(self._seed, purpose))

    def person(self, name: str) -> Actor:
        """Somebody by name, or by place in the file: "person 0 2" is the third on the lowest floor."""
        for walker in self._walkers:
            if walker.key == name:
                return Actor(walker)
        raise NotFound(f"nobody here is named {name!r}")

    def touch(self, name: str, kind: TouchKind = TouchKind.SINGLE) -> None:
        """Touch a robot's pad. Raises ComponentMissing."""
        self._companion(name).touch(kind)

    def plug_in(self, name: str, wire: bool = True) -> None:
        """Put the charger's plug into a robot, or pull it out. Raises ComponentMissing."""
        self._companion(name).plug(wire)

    # -- hands, for users' tests ---------------------------------------------------------------------------------------

    def lift(self, name: str, height: float = 0.3) -> None:
        """A hand takes a robot up so many metres from where it is and holds it there until ``let_go``."""
        self._hull(name).lift(height)

    def let_go(self, name: str) -> None:
        """The hand opens: the robot falls."""
        self._hull(name).lift(None)

    def push(self, name: str, impulse: Vector3) -> None:
        """Give a robot a blow (N s, along its base_link's axes)."""
        self._hull(name).push(impulse.x, impulse.y, impulse.z)

    def pull(self, name: str, force: Point) -> None:
        """Take a robot's leash and pull from now on (N, along the world's axes); no force: let it hang.

        Who walks on a leash gives way; whoever else stands against it.
        """
        self._hull(name).leash = (force.x, force.y)

    def roll_over(self, name: str, roll: float = math.pi) -> None:
        """Lay a robot on its side or back (rad around its x), or with 0 back on its wheels."""
        self._hull(name).overturn(roll)

    def touch_plate(self, name: str, place: PlatePlace) -> None:
        """A hand taps an armor plate. Raises NotFound if the robot has none there."""
        armor = self._parts(name).armor
        if armor is None:
            raise NotFound(f"{name} has no armor")
        armor.touch(place)

    def apply_voltage(self, name: str, adapter: int, port: int, voltage: float) -> None:
        """Put so many volts on a sensor adapter's input. Raises NotFound, InvalidGoal beyond the full scale."""
        adapters = self._parts(name).adapters
        if adapters is None:
            raise NotFound(f"{name} has no sensor adapters")
        adapters.apply(adapter, port, voltage)

    def thing(self, name: str) -> Thing:
        """A small thing: its ``position``, whether it is ``carried``, ``put`` it elsewhere. Raises NotFound."""
        return self._physics.things[name]

    def held_by(self, name: str) -> Thing | None:
        """What a robot's gripper really holds."""
        gripper = self._parts(name).gripper
        return gripper.holds if gripper else None

    @property
    def bead_landings(self) -> Sequence[Landing]:
        """Where the last beads burst, the newest last."""
        return tuple(self._matter.beads.landed)

    def _parts(self, name: str) -> Parts:
        self._hull(name)
        return self._robots[name].parts

    @property
    def people(self) -> Sequence[tuple[int, Pose]]:
        """Everybody's floor and pose."""
        return [(walker.floor, walker.pose) for walker in self._walkers]

    def _companion(self, name: str) -> Companion:
        self._hull(name)
        return self._companions[name]

    def _hull(self, name: str) -> Hull:
        try:
            return self._physics.hulls[name]
        except KeyError:
            raise NotFound(f"no robot here is named {name!r}") from None

    # -- time ----------------------------------------------------------------------------------------------------------

    def _due(self) -> float:
        return self._origin + (self._ticks + 1) * TICK

    def _beat(self) -> None:
        """Do the ticks that are due. A machine that is too slow skips robot time instead of running after it."""
        due = int((self._clock.time() - self._origin) / TICK + 1e-6) - self._ticks
        if due > BEHIND_MAX:
            self._origin += (due - 1) * TICK
            self._pace.skip((due - 1) * TICK)
            due = 1
        self._pace.look(self._clock.time())
        for _ in range(min(due, CATCH_UP_MAX)):
            self._tick()
        self._timer = self._clock.call_at(self._due(), self._beat)

    def _tick(self) -> None:
        self._ticks += 1
        stamp = self._origin + self._ticks * TICK
        for robot in self._robots.values():
            robot.control(TICK)
        self.faults.step(stamp)
        self.building.step(stamp, TICK)
        self._walk()
        self._sight.moved()
        beads = self._matter.beads
        self._physics.step(TICK, beads.fly if beads.flying else None)
        # All of one robot together: its data are in the cache then.
        parts = zip(self._robots.values(), self._equipment.values(), self._companions.values(), strict=True)
        for robot, equipment, companion in parts:
            robot.sense(stamp, TICK)
            equipment.sense(stamp)
            companion.sense(stamp, TICK)

    def _walk(self) -> None:
        if not self._walkers:
            return
        robots: dict[int, list[Hull]] = {}
        for hull in self._physics.hulls.values():
            robots.setdefault(hull.floor, []).append(hull)
        for index, walker in enumerate(self._walkers):
            if walker.walk(TICK, robots.get(walker.floor, ()), self._lines.leads):
                self._physics.move_person(index, walker.pose, walker.floor)
            for step in walker.fetch():
                self._sound(walker, step)

    def _sound(self, walker: Walker, step: Say | Clap) -> None:
        """Let somebody be heard, unless there is noise enough."""
        speech: Speech | None = None
        match step:
            case Say(text=text):
                sound, speech = hummed(text, walker.person.voice), Speech(text, walker.voice)
            case Clap(count=count):
                sound = claps(count)
        try:
            self._air.emit(Source(sound, walker.pose.point, walker.floor, self._clock.time(), 1.0, speech))
        except ValueError as error:
            log.warning("%s is not heard: %s", walker.key, error)
