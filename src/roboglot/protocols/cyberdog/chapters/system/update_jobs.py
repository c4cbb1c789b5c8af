"""Goals of the newer form of "ota", which the manual omits: one at a time (5010), its stream joined again (5011).

Formats of feedback and result are published nowhere: the JSON here is our own. ``updates.py`` does the work.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping

from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.firmware import FIRMWARE, Firmware, FirmwareProgress, FirmwareState
from roboglot.model.errors import Busy, InvalidGoal, NotFound, RobotError
from roboglot.model.events import FirmwareChanged
from roboglot.model.robot import Robot
from roboglot.operations import BadParameters
from roboglot.protocols.cyberdog.chapters.system.updates import (
    ARGUMENTS,
    BUSY,
    FAILED,
    GOOD,
    NOTICE,
    STATE,
    UNDER_WAY,
    Updates,
    package_of,
)
from roboglot.protocols.cyberdog.stream import Stream
from roboglot.values import dataclass

log = logging.getLogger(__name__)
CODES: tuple[tuple[type[Exception], int], ...] = (  # first match wins
    (BadParameters, ARGUMENTS),
    (InvalidGoal, ARGUMENTS),
    (NotFound, STATE),
    (Busy, BUSY),
    (RobotError, FAILED),
)


@dataclass(frozen=True, slots=True)
class Goal:
    """Request to update a module; ``data`` selects the update, where needed."""

    operate: str
    id: int | str = ""
    data: object = None


class Unable(Exception):
    """A goal that cannot be reached; ``code``: the reason."""

    def __init__(self, code: int, words: str) -> None:
        super().__init__(words)
        self.code = code


class UpdateJobs:
    """Jobs of updates: at most one goal is under way, which survives a broken stream."""

    def __init__(self, robot: Robot, updates: Updates) -> None:
        self.stream: Stream | None = None  # of the goal in progress
        self._robot, self._updates = robot, updates
        self._running: asyncio.Task[None] | None = None

    def start(self, goal: Goal) -> Stream:
        """Start the goal."""
        self.stream = stream = Stream()
        self._running = asyncio.get_running_loop().create_task(self._run(goal, stream), name=f"5010 {goal.operate}")
        return stream

    def unbind(self) -> None:
        """End the app's stream; the work continues."""
        if self.stream:
            self.stream.unbind()

    def close(self) -> None:
        """Send no more reports; running work continues."""
        if self._running:
            self._running.cancel()

    async def _run(self, goal: Goal, stream: Stream) -> None:
        """Stream the firmware's progress, then the result of the goal."""
        named = {"id": goal.id, "operate": goal.operate}
        leave = self._robot.events.listen(
            FirmwareChanged, lambda event: stream.send({**named, **_progress(event.progress)})
        )
        code, message, data = GOOD, "", {}
        try:
            data = await OPERATIONS[goal.operate](self, goal)
        except Unable as unable:
            code, message = unable.code, str(unable)
        except (RobotError, BadParameters) as error:
            code, message = next(code for kind, code in CODES if isinstance(error, kind)), str(error)
        except Exception:
            log.exception("5010 %s crashed", goal.operate)
            code, message = FAILED, "internal error"
        finally:
            leave()
            self.stream = self._running = None
        stream.end({**named, "code": code, "message": message, "data": data})

    # -- goals; each returns the result's data --

    async def inquire(self, _: Goal) -> dict[str, object]:
        """Return the running, the downloaded and the offered version."""
        firmware = self._robot[Firmware]
        offered, package = firmware.available, firmware.progress.package
        return {
            "version": firmware.version,
            "modules": dict(firmware.modules),
            **_progress(firmware.progress),
            "package": package.version if package else "",
            "available": {"version": offered.version, "size": offered.size, "md5": offered.digest} if offered else {},
        }

    async def download(self, goal: Goal) -> dict[str, object]:
        """Download modules (``data``, as in 5003), by default those that the manufacturer offers."""
        firmware = self._robot[Firmware]
        if firmware.progress.state in UNDER_WAY:
            raise Unable(BUSY, "an update is under way")
        if goal.data:
            package, digests = package_of(goal.data)
        elif firmware.available:
            package, digests = firmware.available, frozenset({firmware.available.digest})
        else:
            raise Unable(STATE, "the maker offers nothing newer")
        await self._updates.download(package, digests).succeeded()
        return {"version": package.version, "md5": package.digest}

    async def upgrade(self, goal: Goal) -> dict[str, object]:
        """Install the download (``data``: its MD5, or nothing); it runs after the next restart."""
        package = self._robot[Firmware].progress.package
        named = goal.data or (package.digest if package else "")
        if obstacle := self._updates.obstacle(str(named)):
            raise Unable(obstacle, "there is no such update to install now")
        await self._updates.installed()
        return {"version": package.version if package else ""}

    async def upgrade_and_reboot(self, goal: Goal) -> dict[str, object]:
        """Install the download and restart."""
        done = await self.upgrade(goal)
        self._updates.restart()
        return {**done, "seconds": NOTICE}

    async def remove(self, _: Goal) -> dict[str, object]:
        """Delete the download."""
        if self._robot[Firmware].progress.state is not FirmwareState.DOWNLOADED:
            raise Unable(STATE, "no update is downloaded")
        await self._robot[Firmware].discard()
        return {}

    async def reboot(self, _: Goal) -> dict[str, object]:
        """Restart the robot."""
        if self._robot[Firmware].progress.state in (FirmwareState.INSTALLING, FirmwareState.REBOOTING):
            raise Unable(BUSY, "an update is under way")
        self._updates.restart()
        return {"seconds": NOTICE}

    async def reset(self, _: Goal) -> dict[str, object]:
        """Abort the update under way, and delete the download."""
        if self._robot[Firmware].progress.state in (FirmwareState.INSTALLED, FirmwareState.REBOOTING):
            raise Unable(BUSY, "an installed update cannot be removed")
        await self._robot.actions.cancel(resource=FIRMWARE, reason="reset by the app")
        await self._robot[Firmware].discard()
        return {}

    async def disk(self, _: Goal) -> dict[str, object]:
        """Return the free space, bytes."""
        disk = self._robot[Disk]
        return {"size": disk.size, "free": disk.free}


OPERATIONS: Mapping[str, Callable[[UpdateJobs, Goal], Awaitable[dict[str, object]]]] = {
    work.__name__: work
    for work in (
        UpdateJobs.inquire,
        UpdateJobs.download,
        UpdateJobs.upgrade,
        UpdateJobs.upgrade_and_reboot,
        UpdateJobs.remove,
        UpdateJobs.reboot,
        UpdateJobs.reset,
        UpdateJobs.disk,
    )
}


def _progress(progress: FirmwareProgress) -> dict[str, object]:
    return {"state": progress.state, "progress": round(100 * progress.share)}
