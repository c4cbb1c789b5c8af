"""Firmware: downloads at the link's rate, installs at the disk's, reboots."""

from __future__ import annotations

import asyncio
import hashlib
import logging
import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated

from msgspec import Meta, Struct

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import POWER
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.firmware import (
    FIRMWARE,
    MODULES_MAX,
    PACKAGE_BYTES_MAX,
    Firmware,
    FirmwarePackage,
    FirmwareProgress,
    FirmwareState,
    Module,
)
from roboglot.model.components.system.network import Network
from roboglot.model.errors import Blocked, Busy, InvalidGoal, NotFound, Refused, RobotError
from roboglot.model.events import FirmwareChanged, ModuleRestarted, ModuleRestarting, Rebooted, Rebooting
from roboglot.model.robot import Robot
from roboglot.model.sensing import Supply
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.motion.drive_locks import hold_still, let_move
from roboglot.simulation.components.system.firmware_record import FirmwareRecord

log = logging.getLogger(__name__)
PACKAGE = "firmware package"  # the entry that occupies its space on the disk
CHARGE_MIN = 0.3  # required for an installation
LOOK_EVERY = 60.0  # s between checks for a newer version
AFTER_MAX = 86_400.0  # s
UPDATING = (FirmwareState.DOWNLOADING, FirmwareState.INSTALLING)
RESTART_SECONDS = {Module.SOFTWARE: 8.0, Module.BASE: 3.0}


class FirmwareSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``modules``: factory versions; ``offered``: version for download; rates in bytes/s, ``reboot_time`` in s."""

    version: str
    modules: dict[str, str]
    offered: str = ""
    offered_size: Annotated[int, Meta(ge=0, le=4 * 1024**3)] = 0
    download_rate: Annotated[float, Meta(gt=0, le=1e9)] = 2e7
    install_rate: Annotated[float, Meta(gt=0, le=1e9)] = 5e7
    reboot_time: Positive = 20.0


class SimulatedFirmware(Firmware):
    """Firmware of a simulated robot: the record holds the running versions, the section the offered one."""

    def __init__(self, section: FirmwareSection, robot: Robot, base: SimulatedBase) -> None:
        self._section, self._robot, self._base = section, robot, base
        self._clock = robot.clock
        self._progress = FirmwareProgress()
        self._record = FirmwareRecord(robot, section.version, section.modules)
        self._restarting: asyncio.Task[None] | None = None
        self._updating: asyncio.Task[None] | None = None
        self._next_look = LOOK_EVERY
        self._module: Module | None = None
        robot.events.listen(Rebooted, lambda _: self._start_afresh())

    # -- versions --

    @property
    def version(self) -> str:
        self._wake()
        return self._record.installed[0]

    @property
    def modules(self) -> Mapping[str, str]:
        self._wake()
        return self._record.installed[1]

    @property
    def progress(self) -> FirmwareProgress:
        self._wake()
        return self._progress

    @property
    def available(self) -> FirmwarePackage | None:
        offered = self._section.offered
        if not offered or _numbers(offered) <= _numbers(self.version):
            return None
        digest = hashlib.md5(offered.encode(), usedforsecurity=False).hexdigest()
        modules = dict.fromkeys(self._section.modules, offered)
        return FirmwarePackage(offered, self._section.offered_size, digest, modules, url=f"maker:{offered}")

    @property
    def automatic(self) -> bool:
        return self._record.automatic

    async def set_automatic(self, on: bool) -> None:
        await self._record.set_automatic(on)

    @property
    def remaining(self) -> float | None:
        progress, section = self._progress, self._section
        if progress.package is None:
            return None
        match progress.state:
            case FirmwareState.DOWNLOADING:
                left = progress.package.size * (1.0 - progress.share) / section.download_rate
                return left + progress.package.size / section.install_rate
            case FirmwareState.DOWNLOADED:
                return progress.package.size / section.install_rate
            case FirmwareState.INSTALLING:
                return progress.package.size * (1.0 - progress.share) / section.install_rate
        return None

    # -- updates --

    def download(self, package: FirmwarePackage, *, source: str = "") -> Action:
        if not 0 < package.size <= PACKAGE_BYTES_MAX or len(package.modules) > MODULES_MAX or not package.version:
            raise InvalidGoal("a firmware package has a version, a size and not too many modules")
        if not re.fullmatch("[0-9a-f]{8,32}", package.digest):
            raise InvalidGoal("a firmware package has an MD5 of 8 to 32 hexadecimal digits")

        self._wake()

        async def run(action: Action) -> None:
            self._robot[Disk].take(PACKAGE, package.size)
            await self._record.put_downloaded(None)
            try:
                await self._go_through(action, FirmwareState.DOWNLOADING, package, self._section.download_rate)
            except BaseException:
                self._robot[Disk].release(PACKAGE)
                raise
            await self._record.put_downloaded(package)
            self._report(action, FirmwareProgress(FirmwareState.DOWNLOADED, 1.0, package))

        return self._robot.actions.start("download firmware", run, resources=[FIRMWARE], goal=package, source=source)

    def install(self, digest: str, *, source: str = "") -> Action:
        self._wake()

        async def run(action: Action) -> None:
            package = self._progress.package
            if self._progress.state is not FirmwareState.DOWNLOADED or package is None or package.digest != digest:
                raise NotFound("this firmware package was not downloaded")
            if Battery in self._robot and self._robot[Battery].state.percentage < CHARGE_MIN:
                raise Refused("the battery is too low for an update")
            if self._robot.actions.running(BASE):
                raise Refused("the robot is moving")
            hold_still(self._robot, self._base.locks, FIRMWARE, "the robot is being updated")
            try:
                await self._go_through(action, FirmwareState.INSTALLING, package, self._section.install_rate)
                await self._record.put_pending(package.version, {**self.modules, **package.modules})
                await self._record.put_downloaded(None)
            finally:
                let_move(self._robot, self._base.locks, FIRMWARE)
            self._robot[Disk].release(PACKAGE)
            self._report(action, FirmwareProgress(FirmwareState.INSTALLED, 1.0, package))

        return self._robot.actions.start("install firmware", run, resources=[FIRMWARE], goal=digest, source=source)

    async def discard(self) -> None:
        self._wake()
        installed = self._progress.state in (FirmwareState.INSTALLED, FirmwareState.REBOOTING)
        if installed or self._robot.actions.running(FIRMWARE):
            raise Refused("firmware cannot be removed while an update is under way")
        self._robot[Disk].release(PACKAGE)
        self._become(FirmwareProgress())
        await self._record.put_downloaded(None)

    async def _go_through(self, action: Action, state: FirmwareState, package: FirmwarePackage, rate: float) -> None:
        """Advance percent by percent; if cancelled, restore the old progress; if failed, report the reason."""
        before = self._progress
        fetched = state is FirmwareState.DOWNLOADING and bool(package.url)
        steps = 100 if fetched or state is FirmwareState.INSTALLING else 0
        try:
            for percent in range(steps):
                self._report(action, FirmwareProgress(state, percent / 100, package))
                await self._clock.sleep(package.size / rate / steps)
                if fetched and Network in self._robot and not self._robot[Network].state.internet:
                    raise Blocked("the network was lost during the download")
        except Blocked as error:
            self._report(action, FirmwareProgress(FirmwareState.FAILED, 0.0, package, str(error)))
            raise
        except asyncio.CancelledError:
            self._report(action, before)
            raise

    def reboot(self, *, source: str = "", after: float = 0.0) -> Action:
        if not 0.0 <= after <= AFTER_MAX:
            raise InvalidGoal("a reboot is at most a day away")
        if self._progress.state in UPDATING:
            self._check_unused()

        async def run(action: Action) -> None:
            await self._clock.sleep(after)
            self._restarting = asyncio.get_running_loop().create_task(self._restart(action), name="reboot")
            await asyncio.shield(self._restarting)  # its caller may be cancelled; the update continues

        return self._robot.actions.start("reboot", run, resources=[FIRMWARE], source=source)

    async def _restart(self, action: Action) -> None:
        robot, seconds = self._robot, self._section.reboot_time
        hold_still(robot, self._base.locks, "reboot", "the robot restarts")
        robot.events.publish(Rebooting(stamp=self._clock.time(), seconds=seconds))
        self._report(action, replace(self._progress, state=FirmwareState.REBOOTING, share=0.0))
        for other in robot.actions.running():
            if other is not action:
                other.cancel("the robot restarts")
        if Legs in robot:
            await robot[Legs].lie_down().done()
        await self._clock.sleep(seconds)
        try:
            await self._record.boot()
        except RobotError as error:  # the disk is full: the update runs, and stays pending until the next reboot
            log.warning("robot %s: cannot note its update as installed: %s", robot.id, error)
        let_move(self._robot, self._base.locks, "reboot")
        action.report(FirmwareProgress())
        robot.events.publish(Rebooted(stamp=self._clock.time()))

    @property
    def restarting(self) -> Module | None:
        return self._module

    def restart(self, module: Module, *, source: str = "") -> Action:
        async def run(restart: Action) -> None:
            robot, lock = self._robot, f"restart of {module}"
            for action in robot.actions.running(BASE if module is Module.BASE else None):
                if action is not restart and POWER not in action.resources:
                    action.cancel(f"the {module} restarts")
            hold_still(robot, self._base.locks, lock, f"the {module} restarts")
            self._module = module
            robot.events.publish(ModuleRestarting(stamp=self._clock.time(), module=module))
            try:
                await self._clock.sleep(RESTART_SECONDS[module])
            finally:
                self._module = None
                let_move(self._robot, self._base.locks, lock)
                robot.events.publish(ModuleRestarted(stamp=self._clock.time(), module=module))  # also if called off

        self._check_unused()
        return self._robot.actions.start(f"restart {module}", run, resources=[FIRMWARE], source=source)

    def _check_unused(self) -> None:
        for holder in self._robot.actions.running(FIRMWARE):
            raise Busy(f"{holder.name} is under way")

    def sense(self, stamp: float, _seconds: float) -> None:
        """Check periodically for an update, and begin it on a robot that updates itself, is docked and idle."""
        if stamp < self._next_look:
            return
        self._next_look = stamp + LOOK_EVERY
        robot, idle = self._robot, self._updating is None or self._updating.done()
        if not (self.automatic and idle and self.available) or robot.actions.running():
            return
        if Battery in robot and robot[Battery].state.supply is not Supply.NONE:
            self._updating = asyncio.get_running_loop().create_task(self._update(), name="automatic update")

    async def _update(self) -> None:
        package = self.available
        if package is None:
            return
        if await self.download(package).done() is not ActionStatus.SUCCEEDED:
            return
        if await self.install(package.digest).done() is ActionStatus.SUCCEEDED:
            self.reboot()

    def close(self) -> None:
        """Stop: the world is being closed."""
        for task in (self._restarting, self._updating):
            if task:
                task.cancel()

    def _wake(self) -> None:
        """Restore the state of the previous run, once: a start of this program is a reboot, too."""
        if package := self._record.wake():
            self._robot[Disk].take(PACKAGE, package.size)
            self._progress = FirmwareProgress(FirmwareState.DOWNLOADED, 1.0, package)

    def _start_afresh(self) -> None:
        """Run what was installed, whichever way the robot restarted; a package that waits for it still does."""
        left = self._record.restart()
        self._become(FirmwareProgress(FirmwareState.DOWNLOADED, 1.0, left) if left else FirmwareProgress())

    def _report(self, action: Action, progress: FirmwareProgress) -> None:
        action.report(progress)
        self._become(progress)

    def _become(self, progress: FirmwareProgress) -> None:
        self._progress = progress
        self._robot.events.publish(FirmwareChanged(stamp=self._clock.time(), progress=progress))


def _numbers(version: str) -> tuple[int, ...]:
    """Return the numbers in a version, for comparing."""
    return tuple(int(number) for number in re.findall(r"\d{1,9}", version))


def _fit(fit: Fitting) -> SimulatedFirmware:
    return SimulatedFirmware(fit.body[FirmwareSection], fit.robot, fit.get(SimulatedBase))


PART = Part(
    name="firmware",
    interface=Firmware,
    section=FirmwareSection,
    fit=_fit,
    after=("base", "health"),
    sense=SimulatedFirmware.sense,
    every=5,
    first=5,
    detach=SimulatedFirmware.close,
)
