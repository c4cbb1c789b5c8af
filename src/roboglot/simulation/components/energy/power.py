"""Power modes: low power while lying, asleep with the sensors off, off and on again."""

from __future__ import annotations

import asyncio
from typing import Annotated

from msgspec import Meta, Struct

from roboglot.model.actions import Action
from roboglot.model.components.energy.power import POWER, Power, PowerMode, check_delays
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import Refused
from roboglot.model.events import PowerModeChanged, Rebooted, ShuttingDown
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.simulation.components.energy.battery import SimulatedBattery
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.motion.drive_locks import hold_still, let_move
from roboglot.simulation.components.motion.legs import SimulatedLegs
from roboglot.simulation.components.sensing.lidar import SimulatedLidar

AUTOMATIC = "power.automatic"
_SHARES = {PowerMode.OFF: 0.0, PowerMode.ASLEEP: 0.5, PowerMode.LOW_POWER: 1.0}  # relative to low power


class PowerSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``idle_time``: s of lying until low power; ``wake_time``: s; ``saving``: low power as a share of idle power."""

    automatic: bool = False
    idle_time: Positive = 30.0
    wake_time: Positive = 4.0
    saving: Annotated[float, Meta(ge=0, le=1)] = 0.3


class SimulatedPower(Power):
    """Power modes of a simulated robot: unless awake, its base is locked and all motors are off."""

    def __init__(
        self,
        section: PowerSection,
        robot: Robot,
        base: SimulatedBase,
        legs: SimulatedLegs | None,
        battery: SimulatedBattery | None,
        lidar: SimulatedLidar | None,
    ) -> None:
        self._section, self._robot = section, robot
        self._base, self._legs, self._battery, self._lidar = base, legs, battery, lidar
        self._clock = robot.clock
        self._mode = PowerMode.AWAKE
        self._kept = section.automatic
        self._lying_since: float | None = None
        self._switching: asyncio.Task[None] | None = None
        robot.events.listen(Rebooted, lambda _: self._become(PowerMode.AWAKE))

    @property
    def mode(self) -> PowerMode:
        return self._mode

    @property
    def automatic(self) -> bool:
        if Settings in self._robot:
            return bool(self._robot[Settings].get(AUTOMATIC, self._section.automatic))
        return self._kept

    async def set_automatic(self, on: bool) -> None:
        if Settings in self._robot:
            await self._robot[Settings].put(AUTOMATIC, on)
        self._kept = on

    def save(self, *, source: str = "") -> Action:
        return self._rest(PowerMode.LOW_POWER, source)

    def sleep(self, *, source: str = "") -> Action:
        return self._rest(PowerMode.ASLEEP, source)

    def _rest(self, mode: PowerMode, source: str) -> Action:
        async def run(_action: Action) -> None:
            if self._mode is mode:
                return
            if self._mode is PowerMode.OFF or (self._mode is not PowerMode.AWAKE and mode is PowerMode.LOW_POWER):
                raise Refused(f"the robot is {self._mode}")
            if Legs in self._robot and self._robot[Legs].posture not in (Posture.LYING, Posture.LIMP):
                await self._robot[Legs].lie_down(source=source).succeeded()
            self._become(mode)

        return self._robot.actions.start(f"go {mode}", run, resources=[POWER], goal=mode, source=source)

    def wake(self, *, source: str = "") -> Action:
        async def run(_action: Action) -> None:
            if self._mode is PowerMode.OFF:
                raise Refused("the robot is off")
            if self._mode is PowerMode.AWAKE:
                return
            if self._battery and self._battery.state.percentage <= 0.0:
                raise Refused("the battery is empty")
            before = self._mode
            self._become(PowerMode.WAKING_UP)
            try:
                await self._clock.sleep(self._section.wake_time)
            except asyncio.CancelledError:
                self._become(before)
                raise
            self._become(PowerMode.AWAKE)

        return self._robot.actions.start("wake up", run, resources=[POWER], source=source)

    def shut_down(self, *, source: str = "", after: float = 0.0, restart_after: float | None = None) -> Action:
        check_delays(after, restart_after)

        async def run(action: Action) -> None:
            await self._clock.sleep(after)
            self._switching = asyncio.get_running_loop().create_task(self._switch_off(action, restart_after))

        return self._robot.actions.start("shut down", run, resources=[POWER], goal=restart_after, source=source)

    async def _switch_off(self, shutting: Action, restart_after: float | None) -> None:
        self._robot.events.publish(ShuttingDown(stamp=self._clock.time(), restart_after=restart_after))
        for action in self._robot.actions.running():
            if action is not shutting:
                action.cancel("the robot switches off")
        if self._legs and self._legs.posture is not Posture.LYING:
            self._legs.go_limp()
        self._become(PowerMode.OFF)
        if restart_after is not None:
            await self._clock.sleep(restart_after)
            self._become(PowerMode.WAKING_UP)
            await self._clock.sleep(self._section.wake_time)
            self._become(PowerMode.AWAKE)
            self._robot.events.publish(Rebooted(stamp=self._clock.time()))

    def _become(self, mode: PowerMode) -> None:
        if mode is self._mode:
            return
        self._mode, self._lying_since = mode, None
        awake = mode is PowerMode.AWAKE
        if awake:
            let_move(self._robot, self._base.locks, POWER)
        else:
            hold_still(self._robot, self._base.locks, POWER, f"the robot is {mode}")
        if self._legs:
            self._legs.off = "" if awake else f"the robot is {mode}"
        if self._lidar:
            self._lidar.silent = mode in (PowerMode.ASLEEP, PowerMode.OFF)
        if self._battery:
            share = _SHARES.get(mode)
            self._battery.saving = 1.0 if share is None else self._section.saving * share
        self._robot.events.publish(PowerModeChanged(stamp=self._clock.time(), mode=mode))

    def sense(self, stamp: float, _seconds: float) -> None:
        """Go to low power after lying idle for ``idle_time``, if automatic."""
        if self._mode is not PowerMode.AWAKE or self._legs is None or self._legs.posture is not Posture.LYING:
            self._lying_since = None
        elif self._lying_since is None:
            self._lying_since = stamp
        elif stamp - self._lying_since >= self._section.idle_time and self.automatic:
            if not self._robot.actions.running():
                self.save(source=POWER)
            self._lying_since = stamp

    def close(self) -> None:
        """Stop: the world is being closed."""
        if self._switching:
            self._switching.cancel()


def _fit(fit: Fitting) -> SimulatedPower:
    base, legs = fit.get(SimulatedBase), fit.find(SimulatedLegs)
    battery, lidar = fit.find(SimulatedBattery), fit.find(SimulatedLidar)
    return SimulatedPower(fit.body[PowerSection], fit.robot, base, legs, battery, lidar)


PART = Part(
    name="power",
    interface=Power,
    section=PowerSection,
    fit=_fit,
    after=("base", "legs", "battery", "lidar", "firmware", "health"),
    sense=SimulatedPower.sense,
    every=5,
    first=5,
    detach=SimulatedPower.close,
)
