"""A disk of fixed size, partly used by the system; a fault may fill it up."""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.model.components.system.disk import LOW, Disk
from roboglot.model.errors import Refused
from roboglot.model.events import DiskLow
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import Fitting, Part

SIZE = 64_000_000_000
SYSTEM = 21_500_000_000
NAMES_MAX = 10_000


class SimulatedDisk(Disk):
    """Disk of every robot. ``rubbish``: bytes written by a fault."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._uses = {"system": SYSTEM}
        self.rubbish = 0

    @property
    def size(self) -> int:
        return SIZE

    @property
    def free(self) -> int:
        return max(0, SIZE - sum(self._uses.values()) - self.rubbish)

    @property
    def uses(self) -> Mapping[str, int]:
        return dict(self._uses)

    def take(self, name: str, size: int) -> None:
        before, known = self.free, self._uses.get(name, 0)
        if size - known > before or (name not in self._uses and len(self._uses) >= NAMES_MAX):
            raise Refused(f"the disk is full: {before} bytes are left")
        self._uses[name] = size
        if self.free < LOW <= before:
            self._robot.events.publish(DiskLow(stamp=self._robot.clock.time(), free=self.free))

    def release(self, name: str) -> None:
        if name != "system":
            self._uses.pop(name, None)


def _fit(fit: Fitting) -> SimulatedDisk:
    return SimulatedDisk(fit.robot)


PART = Part(name="disk", interface=Disk, fit=_fit)
