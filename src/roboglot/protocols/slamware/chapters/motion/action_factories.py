"""Chapter "motion", POST actions: from an action name and its options to an action of the robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.motion.sweeping import Sweeping
from roboglot.model.components.motion.tag_docking import TagDocking
from roboglot.model.components.system.lease import ERRAND
from roboglot.model.errors import InvalidGoal, RobotError
from roboglot.protocols.slamware.chapters.motion import (
    homing,
    jacking,
    moves,
    relocalizing,
    rides,
    tags,
)
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.errors import BAD_REQUESTS, HttpError
from roboglot.protocols.slamware.vocabulary import action_word
from roboglot.wire.slamware import motion as wire
from roboglot.wire.slamware.motion import ActionRequest


@dataclass(frozen=True, slots=True)
class Factory:
    """One kind of action: its options, how to start it, and the components that it takes."""

    options: type[msgspec.Struct]
    start: Callable[[Context, Any], Action]
    needs: tuple[type[Component], ...]


def create(context: Context, request: ActionRequest) -> Action:
    """Start the action in place of whatever the robot does; HttpError 400 for whatever stands against it."""
    before = context.robot.actions.running(ERRAND)
    try:
        factory = FACTORIES.get(action_word(request.action_name) or "")
        if factory is None:
            raise InvalidGoal(f"this robot does not know {request.action_name}")
        options = msgspec.convert(request.options or {}, factory.options)
        action = factory.start(context, options)
    except (RobotError, msgspec.ValidationError) as error:
        raise HttpError(400, BAD_REQUESTS["POST /api/core/motion/v1/actions"], str(error)) from None
    for errand in before:
        errand.cancel(f"{action.name} took over")
    return action


FACTORIES: dict[str, Factory] = {
    "MoveToAction": Factory(wire.MoveToOptions, moves.move_to, (Navigation,)),
    "SeriesMoveToAction": Factory(wire.SeriesMoveToOptions, moves.series_move_to, (Navigation,)),
    "MoveByAction": Factory(wire.MoveByOptions, moves.move_by, (Driving, Base)),
    "RotateAction": Factory(wire.AngleOptions, moves.rotate, (Driving,)),
    "RotateToAction": Factory(wire.AngleOptions, moves.rotate_to, (Driving, Localization)),
    "GoHomeAction": Factory(wire.GoHomeOptions, homing.go_home, (Docking, Navigation)),
    "FollowPathPointsAction": Factory(wire.FollowPathPointsOptions, moves.follow_path_points, (Navigation,)),
    "SweepAction": Factory(wire.SweepOptions, moves.sweep, (Sweeping,)),
    "RecoverLocalizationAction": Factory(
        wire.RecoverLocalizationOptions, relocalizing.recover_localization, (Localization,)
    ),
    "ManualRelocalizationAction": Factory(wire.NoOptions, relocalizing.manual_relocalization, (Localization,)),
    "ReturnToParkingAction": Factory(wire.ReturnToParkingOptions, homing.return_to_parking, (Navigation,)),
    "MultiFloorMoveAction": Factory(wire.MultiFloorMoveOptions, rides.multi_floor_move, (Navigation,)),
    "MultiFloorBackHomeAction": Factory(wire.GoHomeOptions, rides.multi_floor_back_home, (Docking, Navigation)),
    "EnterElevatorAction": Factory(wire.EnterElevatorOptions, rides.enter_elevator, (Navigation, Driving)),
    "LeaveElevatorAction": Factory(wire.LeaveElevatorOptions, rides.leave_elevator, (Navigation,)),
    "MoveToTagAction": Factory(wire.MoveToTagOptions, tags.move_to_tag, (TagDocking,)),
    "SchedulableMoveToTagAction": Factory(wire.ScheduledMoveToTagOptions, tags.scheduled_move_to_tag, (TagDocking,)),
    "BackOffFromTagAction": Factory(wire.BackOffFromTagOptions, tags.back_off_from_tag, (TagDocking,)),
    "JackMoveAction": Factory(wire.JackMoveOptions, jacking.move_jack, (Jack,)),
    "JackTopMoveToAction": Factory(wire.JackTopMoveToOptions, jacking.carry, (Jack, Navigation)),
}
