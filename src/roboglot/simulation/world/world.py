"""The world: the only truth. Steps the physics and every robot's components on the clock, 50 times a second.

Loads MuJoCo when the first world is made, not when imported. Knows no map and no estimate.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import cast

import numpy as np

from roboglot.config import serial_of
from roboglot.extras import own_version
from roboglot.kernels import WORLD
from roboglot.kernels.ahead import KernelsUnavailable, compile_beside, missing
from roboglot.model.background import load
from roboglot.model.clock import Clock
from roboglot.model.geometry import Pose
from roboglot.model.inputs.external import ExternalInputs
from roboglot.model.inputs.noted_stage import noted
from roboglot.model.robot import Description, Robot
from roboglot.model.sound import claps
from roboglot.simulation.bodies.assembly import SimulatedRobot
from roboglot.simulation.bodies.files import load_body
from roboglot.simulation.bodies.part import Fitting
from roboglot.simulation.bodies.ticks import RobotTicks
from roboglot.simulation.building.building import Building
from roboglot.simulation.detectors.observation import Surroundings
from roboglot.simulation.faults.faults import Faults
from roboglot.simulation.people.crowd import Crowd
from roboglot.simulation.people.people import Walker, keyed
from roboglot.simulation.people.routine import Clap, Say
from roboglot.simulation.radio.gadgets import Gadgets
from roboglot.simulation.radio.radio import Radio
from roboglot.simulation.rendering.opening import stage_of
from roboglot.simulation.rendering.render_pool import RenderPool
from roboglot.simulation.sound.sound import SoundField, Source, Speech
from roboglot.simulation.sound.voice import hummed
from roboglot.simulation.world.beads import Beads
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.description_checks import repeated
from roboglot.simulation.world.environment import Environment
from roboglot.simulation.world.placing import Places
from roboglot.simulation.world.population import Population
from roboglot.simulation.world.randomness import RandomStreams
from roboglot.simulation.world.sight import Sight
from roboglot.simulation.world.sightlines import SightLines
from roboglot.simulation.world.ticking import Ticking
from roboglot.simulation.world.timing import Beat
from roboglot.simulation.world.truth import Truth
from roboglot.simulation.world.world_stage import WorldStage
from roboglot.values import dataclass

log = logging.getLogger(__name__)
TICK = 0.02  # s: controls and sensors
AHEAD_MAX = 25  # ticks that are done at once
REST_MAX = 5  # ticks of real time that are done at once while all robots rest: the period of sensors
ROBOTS_MAX = 200


@dataclass(frozen=True, slots=True)
class RobotPlacement:
    """Body and start of a robot; by default on the first free dock."""

    name: str
    body: str = "universal"
    start: Pose | None = None
    floor: int = 0
    serial: str = ""


@contextlib.contextmanager
def _no_plugins() -> Iterator[None]:
    """Keep MuJoCo, while it loads, from searching all installed packages for plugins: that takes 20 ms of a start.

    Where the module that it searches with is loaded already, and others may use it, it may search.
    """
    name = "importlib.metadata"
    hidden = "mujoco" not in sys.modules and name not in sys.modules
    if hidden:
        cast("dict[str, object]", sys.modules)[name] = None
    try:
        yield
    finally:
        if hidden:
            sys.modules.pop(name, None)


class World:
    """A described world with robots in it, and its time. Raises ValueError in plain words if it cannot be built.

    ``truth`` reads the world's real state; ``stage`` changes it, and its calls are noted in ``inputs``;
    ``own_stage`` is not noted, for the world itself; ``faults`` break things.
    """

    def __init__(
        self, description: WorldDescription, robots: Sequence[RobotPlacement], *, clock: Clock, seed: int = 1
    ) -> None:
        with _no_plugins():
            from roboglot.simulation.world.physics import Physics  # loads MuJoCo

        if len(robots) > ROBOTS_MAX:
            raise ValueError(f"{len(robots)} robots are more than {ROBOTS_MAX}")
        self.description = description
        self._clock = clock
        self._serials = {robot.name: robot.serial or serial_of(seed, robot.name) for robot in robots}
        bodies = {placement.name: load_body(placement.body) for placement in robots}
        if name := repeated([placement.name for placement in robots]):
            raise ValueError(f"two robots have the name {name}")
        self._physics = Physics(description, bodies)
        self._walkers = keyed([floor.people for floor in description.floors])
        self._crowd = Crowd(self._walkers, self._physics)
        self._population = Population(self._physics, self._crowd)
        self.building = Building(description, self._physics, self._walkers)
        self._environment = self._make_environment(seed)
        self._crowd.meet(self._environment.surroundings.lines.leads, self._sound)
        radii = {name: body.hull.radius for name, body in bodies.items()}
        places = Places(description, [(p.start, p.floor, radii[p.name]) for p in robots if p.start is not None])
        for placement in robots:
            try:
                start = places.next(placement.start, placement.floor, radii[placement.name])
            except ValueError as error:
                raise ValueError(f"robot {placement.name}: {error}") from None
            self._population.starts[placement.name] = start
            self._population.hull(placement.name).place(*start)
        self._loading: asyncio.Task[None] | None = None
        self.truth = Truth(self._population, self._environment)
        self.own_stage = WorldStage(self._population, self._environment, clock, lambda: self.faults)
        self.inputs = ExternalInputs("", clock)
        self.stage = noted(self.own_stage, self.inputs, self._wake)
        self.faults = Faults(self, description.faults)
        self._robot_ticks = RobotTicks(self._physics.tables, TICK)
        self._ticking = Ticking(self._physics, self._crowd, self._robot_ticks, TICK)
        self._beat = Beat(clock, TICK, self._tick, self._may_wait)
        self._physics.tables.before_change = self._wake

    def _make_environment(self, seed: int) -> Environment:
        """Make the objects that the robots' parts share."""
        description, physics, walkers = self.description, self._physics, self._walkers
        hulls, props, things = list(physics.hulls.values()), physics.props, physics.things
        radio, beads = Radio(description), Beads(physics.rays)
        life = self._population.robots, beads, self.building.lift
        lines = SightLines(description, hulls, walkers, props)
        return Environment(
            description=description,
            building=self.building,
            things=things,
            radio=radio,
            gadgets=Gadgets(description, walkers, radio),
            air=SoundField(description),
            sight=Sight(description, hulls, walkers, props, things),
            rays=physics.rays,
            surroundings=Surroundings(description, hulls, walkers, props, lines),
            render_pool=RenderPool(stage_of(description, hulls, walkers, props, things, life), self._clock),
            beads=beads,
            chances=RandomStreams(seed),
            north=math.radians(description.georeference.north if description.georeference else 90.0),
        )

    def description_of(self, name: str) -> Description:
        """Return a robot's name plate."""
        return self._population.hull(name).body.describe(serial=self._serials[name], software_version=own_version())

    def equip(self, robot: Robot) -> None:
        """Give ``robot`` the simulated components of the body with its id."""
        fitting = Fitting(robot, self._population.hull(robot.id), self._environment, TICK)
        turn = 0 if self._clock.repeats else len(self._population.simulated)
        self._population.simulated[robot.id] = SimulatedRobot(fitting, turn)
        self._population.robots[robot.id] = robot

    @property
    def robots(self) -> Mapping[str, Robot]:
        """All equipped robots, by name."""
        return self._population.robots

    def robot(self, name: str) -> Robot:
        """Return the robot that was equipped under this name. Raises NotFound."""
        return self._population.robot(name)

    @property
    def gadgets(self) -> Gadgets:
        """Things with a radio: bracelets, headphones, docks."""
        return self._environment.gadgets

    @property
    def time(self) -> float:
        """Robot time of the last tick, s."""
        return self._beat.time

    @property
    def simulated(self) -> float:
        """Robot time simulated since the start, s: less than the clock's on a machine that is too slow."""
        return self._beat.simulated

    def chance(self, purpose: str) -> np.random.Generator:
        """Return the random generator of one purpose, from the world's seed."""
        return self._environment.chances.of(purpose)

    async def prepare(self, *, wait: bool) -> None:
        """Load the compiled kernels; return at once, or with ``wait`` once they are in use (a lockstep world waits)."""
        self._loading = asyncio.create_task(self._load_kernels(), name="kernels of the world")
        if wait:
            await self._loading

    async def _load_kernels(self) -> None:
        """Switch the sensors to the compiled kernels; missing ones are compiled first, in a separate process."""
        with contextlib.suppress(KernelsUnavailable):  # autonomy reports it; sensors continue without it
            if await load(lambda: missing(WORLD)):  # at the first time, it reads the sources
                await compile_beside(WORLD)
            await load(self._use_kernels)

    def _use_kernels(self) -> None:
        self._environment.sight.load_kernel()
        self._environment.rays.load_kernel()
        self._physics.tables.load_kernels()
        self._physics.load_kernels()
        self._crowd.load_kernels()
        self._ticking.load_kernels()

    def start(self) -> None:
        """Let time pass; needs the running loop."""
        self._beat.start()

    def close(self) -> None:
        """Stop."""
        self._beat.close()
        if self._loading is not None:
            self._loading.cancel()
        for robot in self._population.simulated.values():
            robot.detach()

    def _wake(self) -> None:
        """Do the ticks that have passed while all robots rested, before one of them acts or is acted on."""
        if passed := self._beat.end_rest():
            left = self._ticking.run(passed, self._beat.ticks, self._beat.origin, followed=True)
            self._beat.ticks += left.ticks
            self._robot_ticks.rest(left.ticks)
            self._environment.sight.moved()
            self._ticking.end(left, self.time)

    def _tick(self) -> Iterator[None]:
        """Do a tick, and those after it until a robot has something due or anything else happens."""
        beat = self._beat
        beat.ticks += 1
        robots = tuple(self._population.simulated.values())  # steps lie apart: one may join meanwhile
        beads, rounds, ticking = self._environment.beads, self._robot_ticks, self._ticking
        followed = rounds.control(robots, lean=ticking.lean and not beads.flying)
        if followed:
            yield
        self.faults.step(self.time)
        self.building.step(self.time, TICK)
        left = ticking.run(self._most(), beat.ticks - 1, beat.origin, followed=followed)
        if not left.ticks:
            rounds.control(robots)
            left = ticking.run(self._most(), beat.ticks - 1, beat.origin, followed=True)
        rounds.skip(left.ticks)
        if left.ticks > 1:
            beat.ticks += left.ticks - 1
            self._clock.go_ahead(self.time)
            self.building.step(self.time, TICK)
        self._environment.sight.moved()
        now = self.time
        ticking.end(left, now, beads.fly if beads.flying else None)
        yield
        yield from rounds.sense(robots, now)

    def _most(self) -> int:
        """Return how many ticks may be done at once, the present one included; 0: it takes small steps."""
        if self._environment.beads.flying:
            return 0
        most = self._robot_ticks.free(AHEAD_MAX) if self.building.rests else 1
        until = min(self._clock.free_until, self.faults.next) if most > 1 else -math.inf
        return self._beat.fitting(until, self._beat.ticks, most) if until > self.time else 1

    def _may_wait(self) -> int:
        """Return how many ticks may pass in real time before the next must be done, as all robots rest."""
        if self._clock.repeats or not (self._ticking.calm and self.building.rests) or self._environment.beads.flying:
            return 0
        until = min(self._clock.next_due, self.faults.next)
        return self._beat.fitting(until, self._beat.ticks + 1, self._robot_ticks.idle(REST_MAX - 1) + 1) - 1

    def _sound(self, walker: Walker, step: Say | Clap) -> None:
        """Emit a person's sound, unless there are too many sounds already."""
        speech: Speech | None = None
        match step:
            case Say(text=text):
                sound, speech = hummed(text, walker.person.voice), Speech(text, walker.voice)
            case Clap(count=count):
                sound = claps(count)
        try:
            self._environment.air.emit(Source(sound, walker.pose.point, walker.floor, self._clock.time(), 1.0, speech))
        except ValueError as error:
            log.warning("cannot play the sound of %s: %s", walker.key, error)
