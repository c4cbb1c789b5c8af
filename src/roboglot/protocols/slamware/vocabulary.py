"""Translation between the model and the vendor's words and numbers: actions, stages, reasons. Knows no socket."""

from __future__ import annotations

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.mapping.floors import RideStage
from roboglot.model.components.motion.navigation import NavigationFeedback, Tracks
from roboglot.model.errors import Blocked, DockNotFound, NotLocalized, RobotError, Unreachable
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.maps import PointOfInterest
from roboglot.protocols.slamware.chapters.motion.errands import part_of
from roboglot.wire.slamware.chapters.artifact import PoseEntry
from roboglot.wire.slamware.chapters.motion import ActionState, Result, State
from roboglot.wire.slamware.geometry import Pose2D, Pose3D

PREFIXES = ("slamtec.agent.actions.", "agent.actions.")  # firmware up to 5, firmware 6: both are understood

TRACKS = (Tracks.FREE, Tracks.STRICT, Tracks.PREFERRED)  # by move mode

# Reasons that clients have received from robots; other errors have plain words.
REASONS: dict[type[RobotError], str] = {
    Unreachable: "CANNOT_REACH_TARGET",
    Blocked: "PATH_OCCUPIED",
    DockNotFound: "SEARCH_DOCK_FAILED",
    NotLocalized: "LOCALIZATION_LOST",
}

RIDE_STAGES = {
    RideStage.APPROACHING: "GOING_TO_ELEVATOR",
    RideStage.CALLING: "WAIT_FOR_ELEVATOR",
    RideStage.BOARDING: "GOING_INTO_ELEVATOR",
    RideStage.RIDING: "IN_ELEVATOR",
    RideStage.LEAVING: "GOING_OUT_OF_ELEVATOR",
    RideStage.ARRIVED: "",
}
DOCKING_STAGES = {"approaching": "GOING_TO_LANDING_POINT"}  # empty while the robot creeps onto the contacts


MARK_STAGES = {"approaching": "MOVE_TO_LANDING_POINT", "looking": "DETECT_MARKER", "docking": "LANDING"}


def action_word(name: str) -> str | None:
    """Return ``MoveToAction`` for ``slamtec.agent.actions.MoveToAction``; None without a known prefix."""
    return next((name.removeprefix(prefix) for prefix in PREFIXES if name.startswith(prefix)), None)


def state_of(action: Action) -> ActionState:
    """Return status, result and reason of an action of the model."""
    match action.status:
        case ActionStatus.ACCEPTED:
            return ActionState(State.NEW_BORN, Result.SUCCESS)
        case ActionStatus.SUCCEEDED:
            return ActionState(State.DONE, Result.SUCCESS)
        case ActionStatus.CANCELED:
            return ActionState(State.DONE, Result.ABORTED, action.reason or "aborted")
        case ActionStatus.ABORTED:
            return ActionState(State.DONE, Result.FAILED, reason_of(action.error))
        case _:
            paused = action.paused or part_of(action).paused
            return ActionState(State.PAUSED if paused else State.WORKING, Result.SUCCESS)


def reason_of(error: RobotError | None) -> str:
    """Return why an action failed, never empty: an empty reason means success to clients."""
    if error is None:
        return "failed"
    return next((word for kind, word in REASONS.items() if isinstance(error, kind)), str(error) or "failed")


def stage_of(action: Action, *, going_home: bool) -> str:
    """Return the stage in the words of robots; empty if they report none."""
    match part_of(action).feedback:
        case RideStage() as stage:
            return RIDE_STAGES[stage]
        case NavigationFeedback():
            return "GOING_TO_LANDING_POINT" if going_home else "GOING_TO_TARGET"
        case str(word) if going_home:
            return DOCKING_STAGES.get(word, "")
        case str(word):
            return MARK_STAGES.get(word, "")
        case None if going_home:
            return "INITIALIZING"
        case _:
            return ""


def milliseconds(stamp: float, start: float) -> int:
    """Return robot time (s) in the API's form: milliseconds since ``start``, the last one of the robot or its base."""
    return int(max(0.0, stamp - start) * 1000)


def pose3d(pose: Pose) -> Pose3D:
    """Return a pose in the plane, with six numbers."""
    return Pose3D(pose.x, pose.y, 0.0, pose.yaw, 0.0, 0.0)


def pose2d(pose: Pose) -> Pose2D:
    """Return a pose in the plane."""
    return Pose2D(pose.x, pose.y, pose.yaw)


def pose_of(pose: Pose2D | Pose3D) -> Pose:
    """Return the model's pose, which has no height and tilt."""
    return Pose(pose.x, pose.y, wrap_angle(pose.yaw))


def entry_of(place: PointOfInterest) -> PoseEntry:
    """Return a place, dock or landmark in the API's form."""
    return PoseEntry(place.id, pose2d(place.pose), dict(place.metadata))
