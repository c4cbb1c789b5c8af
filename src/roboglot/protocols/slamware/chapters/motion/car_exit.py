"""Chapter "motion", LeaveElevatorAction: the way out of a car, within the client's limits of time."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.actions import Action
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.navigation import NavigationFeedback
from roboglot.model.errors import Blocked, Expired, RobotError, Unreachable
from roboglot.protocols.slamware.chapters.motion.errands import PART, Errand
from roboglot.protocols.slamware.chapters.motion.moves import navigate
from roboglot.protocols.slamware.chapters.multi_floor.elevators import Elevator
from roboglot.wire.slamware.chapters.motion import Door, LeaveElevator, MoveOptions
from roboglot.wire.slamware.chapters.multi_floor import PoseRelation

CROSS_SECONDS = 120.0  # s, unless the client sets a limit
LOOK_PERIOD, SEARCH_PERIOD = 0.1, 1.0  # s between two looks at the robot's place, and two searches of a path


class CarExit:
    """One try to leave a car: to find a path, reach the door, and cross the sill."""

    def __init__(self, errand: Errand, find: Callable[[], Elevator], how: LeaveElevator) -> None:
        self._errand, self._robot = errand, errand.robot
        self._find, self._how = find, how
        self._begun = self._before_sill = self._robot.clock.time()
        self._found = False  # a path

    async def drive_out(self) -> None:
        """Drive to the waiting place outside. Raises Expired, and navigation's errors once the search is over."""
        most = self._how.timeout_in_ms / 1000 or CROSS_SECONDS
        searching = min(self._how.search_path_timeout_in_ms / 1000, most)
        while True:
            elevator = self._find()  # on the map that is in use by now
            outside = elevator.waiting(rear=self._how.elevator_door_flag is Door.REAR)
            out = navigate(self._robot, [outside.point], MoveOptions(), source=PART)
            try:
                await self._errand.do(out, within=most - self._passed, watch=self._late(elevator, out))
                return
            except (Blocked, Unreachable):
                if self._found or self._passed >= searching:
                    raise
            await self._robot.clock.sleep(min(SEARCH_PERIOD, searching - self._passed))

    @property
    def _passed(self) -> float:
        return self._robot.clock.time() - self._begun

    async def _late(self, elevator: Elevator, out: Action) -> RobotError:
        """Return the reason to give up, once a limit is exceeded."""
        while (problem := self._problem(elevator, out)) is None:
            await self._robot.clock.sleep(LOOK_PERIOD)
        return problem

    def _problem(self, elevator: Elevator, out: Action) -> RobotError | None:
        how, now = self._how, self._robot.clock.time()
        relation = elevator.relation(self._robot[Localization].pose, self._robot.description.radius)
        if isinstance(out.feedback, NavigationFeedback) and out.feedback.remaining.points:
            self._found = True
        if relation is not PoseRelation.AT_SILL:
            self._before_sill = now
        if not self._found and _over(self._passed, how.search_path_timeout_in_ms):
            return Expired("no path out of the elevator was found in time")
        if relation is PoseRelation.IN and _over(self._passed, how.arrive_door_timeout_in_ms):
            return Expired("the robot did not reach the elevator's door in time")
        if _over(now - self._before_sill, how.on_elevator_door_timeout_in_ms):
            return Blocked("the robot stood too long on the sill")
        return None


def _over(seconds: float, limit: float) -> bool:
    """Return whether a limit (ms, 0: none) is exceeded."""
    return limit > 0 and seconds * 1000 >= limit
