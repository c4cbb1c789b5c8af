"""Chapter "motion": actions, their options and their states."""

from __future__ import annotations

from enum import IntEnum, StrEnum
from typing import Annotated, Literal

import msgspec

from roboglot.wire.slamware.geometry import Location, Metres, Point, Pose2D, Pose3D, Radians, Rectangle

NAME_MAX = 128
TARGETS_MAX = 1000
DURATION_MAX = 60_000  # ms
RETRIES_MAX = 100
TIMEOUT_MAX = 600_000  # ms

ActionName = Annotated[str, msgspec.Meta(min_length=1, max_length=NAME_MAX)]


class State(IntEnum):
    """ActionState.status; there is no 2."""

    NEW_BORN = 0
    WORKING = 1
    PAUSED = 3
    DONE = 4


class Result(IntEnum):
    """ActionState.result, meaningful once DONE."""

    SUCCESS = 0
    FAILED = -1
    ABORTED = -2


class ActionState(msgspec.Struct):
    """State of an action; ``reason`` is empty on success."""

    status: State
    result: Result
    reason: str = ""


class ActionInfo(msgspec.Struct):
    """A running action."""

    action_id: int
    action_name: str
    stage: str
    state: ActionState


class ActionGravestone(msgspec.Struct):
    """Record of an ended action."""

    action_id: int
    state: ActionState


class ActionFactory(msgspec.Struct):
    """A kind of action that the robot knows."""

    action_name: str


class ActionRequest(msgspec.Struct):
    """The body of POST actions; ``options`` are decoded when the name is known."""

    action_name: ActionName
    options: dict[str, object] | None = None


class PathPoints(msgspec.Struct):
    """A polyline of [x, y], m in the map."""

    path_points: list[tuple[float, float]]


class PathQuery(msgspec.Struct):
    """Search a path from the robot to ``target``; ``timeout`` in ms, 0 or absent: the robot's own limit."""

    target: Point
    timeout: Annotated[int, msgspec.Meta(ge=0, le=TIMEOUT_MAX)] = 0


class Speed(msgspec.Struct):
    """Velocity: m/s forward and left, rad/s counter-clockwise."""

    vx: float
    vy: float
    omega: float


MoveFlag = Literal[
    "precise", "with_yaw", "fail_retry_count", "find_path_ignoring_dynamic_obstacles", "with_directed_virtual_track"
]


class MoveOptions(msgspec.Struct):
    """Options of a move. ``yaw`` and ``fail_retry_count`` have an effect only if ``flags`` names them.

    ``mode``: 0 free, 1 strictly on tracks, 2 rather on tracks. Real clients send flags as a list, 0, null or [null],
    and 0 for unused numbers.
    """

    mode: Annotated[int, msgspec.Meta(ge=0, le=2)] = 0
    flags: list[MoveFlag | None] | Annotated[int, msgspec.Meta(ge=0, le=0)] | None = None
    yaw: Radians | None = None
    acceptable_precision: Annotated[float, msgspec.Meta(ge=0)] | None = None
    fail_retry_count: Annotated[int, msgspec.Meta(ge=0, le=RETRIES_MAX)] | None = None
    speed_ratio: Annotated[float, msgspec.Meta(ge=0, le=10)] | None = None

    def has(self, flag: MoveFlag) -> bool:
        """Return True if ``flag`` is set."""
        return isinstance(self.flags, list) and flag in self.flags


class MoveToOptions(msgspec.Struct):
    """Go to ``target``."""

    target: Location
    move_options: MoveOptions | None = None


class SeriesMoveToOptions(msgspec.Struct):
    """Go through ``targets`` in turn."""

    targets: Annotated[list[Location], msgspec.Meta(min_length=1, max_length=TARGETS_MAX)]
    move_options: MoveOptions | None = None


class Direction(IntEnum):
    """MoveBy's direction."""

    FORWARD = 0
    BACKWARD = 1
    TURN_RIGHT = 2
    TURN_LEFT = 3


class MoveByOptions(msgspec.Struct):
    """Remote control: a direction, or a turning rate in rad/s, for ``duration`` ms (0 or absent: 500)."""

    direction: Direction | None = None
    theta: Annotated[float, msgspec.Meta(ge=-100, le=100)] | None = None
    duration: Annotated[int, msgspec.Meta(ge=0, le=DURATION_MAX)] | None = None


class AngleOptions(msgspec.Struct):
    """Rotate: by this angle; RotateTo: to this heading; rad, counter-clockwise."""

    angle: Annotated[float, msgspec.Meta(ge=-1000, le=1000)]


class GoHome(msgspec.Struct):
    """Options of the way home; ``flags`` is text here: "dock", or "no_dock" to stop at the landing point."""

    flags: Literal["dock", "no_dock"] | None = None
    back_to_landing: bool | None = None
    charging_retry_count: Annotated[int, msgspec.Meta(ge=0, le=RETRIES_MAX)] | None = None
    move_options: MoveOptions | None = None


class GoHomeOptions(msgspec.Struct):
    """Go and charge."""

    gohome_options: GoHome | None = None


class FollowPathPointsOptions(msgspec.Struct):
    """Go along ``path_points``."""

    path_points: Annotated[list[Point], msgspec.Meta(min_length=1, max_length=TARGETS_MAX)]
    move_options: MoveOptions | None = None


class Regions(msgspec.Struct):
    """Coverage areas (absent or empty: all) and lane spacing, m."""

    region_ids: Annotated[list[int], msgspec.Meta(max_length=TARGETS_MAX)] | None = None
    spacing: Annotated[float, msgspec.Meta(ge=0, le=100)] | None = None


class SweepOptions(msgspec.Struct):
    """Cover areas."""

    sweep_options: Regions | None = None


class NoOptions(msgspec.Struct):
    """Options of actions that have none; any content is ignored."""


class RecoverMovement(StrEnum):
    """Motions allowed during the search."""

    ROTATE_ONLY = "RotateOnly"
    NO_MOVE = "NoMove"


class RelocalizationOptions(msgspec.Struct):
    """Options of a relocalisation; ``max_recover_time``: ms, 0 for the robot's own limit."""

    max_recover_time: Annotated[int, msgspec.Meta(ge=0, le=TIMEOUT_MAX)] = 0
    recover_movement_type: RecoverMovement = RecoverMovement.NO_MOVE


class RecoverLocalizationOptions(msgspec.Struct):
    """Search in ``area``; without it, or with an empty one, anywhere on the map."""

    area: Rectangle | None = None
    relocalization_options: RelocalizationOptions | None = None


class PlaceName(msgspec.Struct):
    """A place by its name or id; empty: the robot chooses."""

    poi_name: Annotated[str, msgspec.Meta(max_length=4096)] = ""


class ReturnToParkingOptions(msgspec.Struct):
    """Park at ``target``, or at any free place."""

    target: PlaceName | None = None
    move_options: MoveOptions | None = None


class JackMoveOptions(msgspec.Struct):
    """Direction of the jack."""

    move_direction: Literal["Up", "Down"]


class JackTopWishes(msgspec.Struct):
    """Options with a load; ``robot_line_speed``: m/s, 0 or absent for the usual speed."""

    move_options: MoveOptions | None = None
    robot_line_speed: Annotated[float, msgspec.Meta(ge=0, le=100)] | None = None


class JackTopMoveToOptions(msgspec.Struct):
    """Go through all targets. Not in the manual, but in use."""

    target: ScheduledTarget | None = None
    targets: Annotated[list[ScheduledTarget], msgspec.Meta(max_length=500)] = []
    modify_params_move_options: JackTopWishes | None = None


class MultiFloorTarget(msgspec.Struct):
    """A place by its name or id, or a pose on a floor (absent: the current one)."""

    poi_name: Annotated[str, msgspec.Meta(max_length=4096)] = ""
    building: Annotated[str, msgspec.Meta(max_length=64)] = ""
    floor: Annotated[str, msgspec.Meta(max_length=64)] = ""
    pose: Pose2D | None = None


class MultiFloorMoveOptions(msgspec.Struct):
    """Go to ``target``, by elevator if necessary."""

    target: MultiFloorTarget
    move_options: MoveOptions | None = None


Milliseconds = Annotated[float, msgspec.Meta(ge=0, le=TIMEOUT_MAX)]


class Door(StrEnum):
    """Door of a car."""

    FRONT = "front_door"
    REAR = "rear_door"


class StoppingYaw(StrEnum):
    """Door to face inside."""

    FRONT = "face_to_front_door"
    REAR = "face_to_rear_door"


class EnterElevator(msgspec.Struct):
    """Options to enter; 0 ms: the robot's own limit. ``use_conservative_mode`` false: not the middle, but deeper."""

    elevator_door_flag: Door = Door.FRONT
    elevator_stopping_yaw: StoppingYaw = StoppingYaw.FRONT
    timeout_in_ms: Milliseconds = 0
    use_conservative_mode: bool | None = None


class EnterElevatorOptions(msgspec.Struct):
    """Enter this elevator."""

    elevator_id: Annotated[str, msgspec.Meta(min_length=1, max_length=64)]
    enter_elevator_options: EnterElevator | None = None


class LeaveElevator(msgspec.Struct):
    """Options to leave; ``if_need_reach_milestone``: go on to the target. 0 ms: no limit but the robot's own.

    The further limits: until a path is found, until the robot is out of the door, and on the sill.
    """

    elevator_door_flag: Door = Door.FRONT
    timeout_in_ms: Milliseconds = 0
    search_path_timeout_in_ms: Milliseconds = 0
    arrive_door_timeout_in_ms: Milliseconds = 0
    on_elevator_door_timeout_in_ms: Milliseconds = 0
    if_need_reach_milestone: bool = False
    move_options: MoveOptions | None = None


class LeaveElevatorOptions(msgspec.Struct):
    """Leave this elevator."""

    elevator_id: Annotated[str, msgspec.Meta(min_length=1, max_length=64)]
    target: Pose2D | None = None
    leave_elevator_options: LeaveElevator | None = None


class TagType(IntEnum):
    """Marker of the place."""

    VISUAL = 0
    LASER = 1
    REFLECTORS = 2
    SHELF = 3


class TagOffset(msgspec.Struct):
    """Place to stop in the tag's frame: ``x`` m in front of it, ``y`` m to its left."""

    x: Annotated[float, msgspec.Meta(ge=0, le=10)] = 0.0
    y: Annotated[float, msgspec.Meta(ge=-10, le=10)] = 0.0


class TagWishes(msgspec.Struct):
    """Options to dock. ``tag_ids``: any of these; ``reflect_tag_num``: number of strips that mark the place.

    ``dock_allowance``: part of the robot outside the shelf, m; absent: robot centred under the shelf.
    """

    tag_type: TagType = TagType.VISUAL
    target_relative_pose: TagOffset | None = None
    backward_docking: bool = False
    turn_radian: Annotated[float, msgspec.Meta(ge=-100, le=100)] | None = None
    tag_ids: Annotated[list[int], msgspec.Meta(max_length=TARGETS_MAX)] | None = None
    reflect_tag_num: Annotated[int, msgspec.Meta(ge=0, le=20)] | None = None
    dock_retry_count: Annotated[int, msgspec.Meta(ge=0, le=RETRIES_MAX)] | None = None
    dock_allowance: Annotated[float, msgspec.Meta(ge=0, le=100)] | None = None


class MoveToTagOptions(TagWishes, kw_only=True):
    """Go to ``target``, then approach the tag visually."""

    target: Pose3D


class ScheduledTarget(msgspec.Struct):
    """A place by its name or id, or a pose."""

    poi_name: Annotated[str, msgspec.Meta(max_length=256)] = ""
    x: Metres = 0.0
    y: Metres = 0.0
    yaw: Radians = 0.0


class ScheduledMoveToTagOptions(msgspec.Struct):
    """Go to a place and dock at its tag. Not in the manual, but in use."""

    target: ScheduledTarget
    move_to_tag_options: TagWishes | None = None


Backwards = Annotated[float, msgspec.Meta(ge=0, le=100)]


class BackOffFromTagOptions(msgspec.Struct):
    """Back off; ``backup_mode`` 1: watching the tag. The distance, m, has two spellings; 0: until it can turn."""

    backup_mode: Annotated[int, msgspec.Meta(ge=0, le=1)] = 0
    tag_type: TagType = TagType.VISUAL
    backup_distance: Backwards | None = None
    back_up_distance: Backwards | None = None
    backward_docking: bool = False


class Strategy(msgspec.Struct):
    """The strategy to use."""

    strategy: Annotated[str, msgspec.Meta(max_length=64)]
