"""Docking by the robot's own GoHome."""

from __future__ import annotations

from roboglot.clients.slamware import SlamwareClient
from roboglot.drivers.linked_base import OFF_DOCK
from roboglot.drivers.slamware.chapters.motion.actions import ActionRunner, VendorAction
from roboglot.drivers.slamware.state import ReportedState
from roboglot.drivers.slamware.vocabulary import pose3d
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.actions import Action
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.errors import Refused
from roboglot.model.geometry import Pose
from roboglot.wire.slamware.chapters.motion import ActionInfo, GoHomeOptions


class SlamwareDocking(Docking):
    """Docking by ``homepose`` and GoHome."""

    def __init__(
        self,
        client: SlamwareClient,
        supervisor: Supervisor,
        runner: ActionRunner,
        driving: Driving,
        reported: ReportedState,
    ) -> None:
        self._client, self._supervisor, self._runner, self._reported = client, supervisor, runner, reported
        self._driving = driving

    @property
    def home(self) -> Pose | None:
        return self._reported.home

    def set_home(self, pose: Pose | None) -> None:
        if pose is None:
            self._supervisor.send("forgetting the docks", self._client.clear_home_docks())
        else:
            self._supervisor.send("setting the dock", self._client.set_home_pose(pose3d(pose)))

    def dock(self, *, source: str = "") -> Action:
        wanted = VendorAction("GoHomeAction", GoHomeOptions(), _stage)
        return self._runner.start("dock", wanted, goal=self.home, source=source)

    def undock(self, *, source: str = "") -> Action:
        if not self._reported.docked:
            raise Refused("the robot is not on a dock")
        return self._driving.move_by(Pose(OFF_DOCK), source=source)


async def _stage(info: ActionInfo) -> str:
    return "approaching" if info.stage in ("INITIALIZING", "GOING_TO_LANDING_POINT") else "docking"
