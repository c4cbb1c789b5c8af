"""Elevator events of a ride: its stages and its failure in the vendor's words (chapter "platform")."""

from __future__ import annotations

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.mapping.floors import RideStage
from roboglot.model.errors import Blocked
from roboglot.wire.slamware.chapters.platform import ElevatorEvent

BEGINNINGS: dict[RideStage, tuple[ElevatorEvent, ...]] = {
    RideStage.CALLING: (ElevatorEvent.WAIT_ELEVATOR,),
    RideStage.BOARDING: (ElevatorEvent.ENTER_ELEVATOR_PATH_FOUND, ElevatorEvent.ENTER_ELEVATOR),
    RideStage.RIDING: (ElevatorEvent.IN_ELEVATOR,),
    RideStage.LEAVING: (ElevatorEvent.LEAVE_ELEVATOR,),
    RideStage.ARRIVED: (ElevatorEvent.OUT_OF_ELEVATOR,),
}
OCCUPIED = {
    RideStage.BOARDING: ElevatorEvent.ENTER_ELEVATOR_OCCUPIED,
    RideStage.LEAVING: ElevatorEvent.LEAVE_ELEVATOR_OCCUPIED,
}
FAILURES = {
    RideStage.APPROACHING: ElevatorEvent.SEARCH_ELEVATOR_PATH_FAILED,
    RideStage.CALLING: ElevatorEvent.ENTER_ELEVATOR_FAILED,
    RideStage.BOARDING: ElevatorEvent.ENTER_ELEVATOR_FAILED,
    RideStage.RIDING: ElevatorEvent.LEAVE_ELEVATOR_FAILED,
    RideStage.LEAVING: ElevatorEvent.LEAVE_ELEVATOR_FAILED,
}


class RideEvents:
    """Follows rides one by one; each stage is reported once."""

    def __init__(self) -> None:
        self._reported: tuple[int, RideStage | None] = (0, None)

    def of(self, action: Action) -> tuple[ElevatorEvent, ...]:
        """Return the event of a change of ``action``."""
        stage = action.feedback
        if not isinstance(stage, RideStage):
            return ()
        if action.status is ActionStatus.ABORTED:
            blocked = isinstance(action.error, Blocked) and stage in OCCUPIED
            occupied = (OCCUPIED[stage], ElevatorEvent.TAKE_ELEVATOR_OCCUPIED) if blocked else ()
            return (*occupied, FAILURES[stage]) if stage in FAILURES else occupied
        if action.status.ended or self._reported == (action.id, stage):
            return ()
        self._reported = (action.id, stage)
        return BEGINNINGS.get(stage, ())
