"""Legs: postures and changes between them, body poses above the feet, gaits, motions."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.components.motion.feet import Foot, Footfall, Foothold, FootState
from roboglot.model.components.motion.gaits import FOOT_LIFT_MAX, FOOT_LIFT_MIN, Gait
from roboglot.model.components.motion.motions import Motion
from roboglot.model.components.motion.posture import Posture
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import LEVEL, STILL, Orientation, Point, Twist
from roboglot.values import dataclass

__all__ = ["LEGS", "STEPS_MAX", "BodyPose", "Choreography", "FootLift", "LegLimits", "Legs", "Posture", "Step"]

LEGS = "legs"  # the resource of posture changes and motions, together with BASE, and of body poses alone
STEPS_MAX = 1000  # of a choreography
INWARD_MAX = 0.05  # m
CENTRED = Point()


@dataclass(frozen=True, slots=True)
class BodyPose:
    """Pose of the body above its feet.

    ``height``: of the belly above the floor, m (None: as it is); ``attitude``: roll, pitch and yaw against standing
    straight, rad; ``shift``: of the body's middle against the feet, m.
    """

    height: float | None = None
    attitude: Orientation = LEVEL
    shift: Point = CENTRED


@dataclass(frozen=True, slots=True)
class FootLift:
    """Swing height of the feet at every step, and the inward shift of their landing places, m."""

    front: float = 0.03
    rear: float = 0.03
    inward: float = 0.0


@dataclass(frozen=True, slots=True)
class Step:
    """A piece of a choreography: ``seconds`` long, base_link moving at ``twist``, the body coming to ``body``.

    ``footholds``: one of each Foot, in that order, in place of ``lift``. ``friction``: assumed coefficient of the
    floor; times gravity it limits changes of velocity. ``landing``: how fast feet come down, as a share of their rise.
    """

    seconds: float
    twist: Twist = STILL
    body: BodyPose = BodyPose()
    lift: FootLift = FootLift()
    footholds: tuple[Foothold, ...] = ()
    friction: float = 1.0
    landing: float = 1.0


@dataclass(frozen=True, slots=True)
class Choreography:
    """Steps with their footfalls; no ``footfalls``: those of walking."""

    steps: Sequence[Step] = ()
    footfalls: Sequence[Footfall] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class LegLimits:
    """Belly heights (m), the largest angle of each axis (rad) and the largest shift (m) of a body pose.

    ``reach``: largest distance of a standing foot from the point below its hip, m.
    """

    lowest: float
    highest: float
    angle: float
    shift: float
    reach: float


def check_pose(body: BodyPose, limits: LegLimits, *, relative: bool = False) -> None:
    """Raise InvalidGoal for a pose that the legs cannot hold; a ``relative`` one may have any finite height."""
    a = body.attitude
    numbers = (a.roll, a.pitch, a.yaw, body.shift.x, body.shift.y, body.height or 0.0)
    if not all(map(math.isfinite, numbers)):
        raise InvalidGoal("a body pose must be finite")
    if body.height is not None and not relative and not limits.lowest <= body.height <= limits.highest:
        raise InvalidGoal(f"the belly is held {limits.lowest} to {limits.highest} m above the floor")
    if max(abs(a.roll), abs(a.pitch), abs(a.yaw)) > limits.angle:
        raise InvalidGoal(f"the body turns by at most {limits.angle} rad")
    if max(abs(body.shift.x), abs(body.shift.y)) > limits.shift:
        raise InvalidGoal(f"the body shifts by at most {limits.shift} m")


def check_lift(lift: FootLift) -> None:
    """Raise InvalidGoal for feet lifted too little or too far."""
    if not all(FOOT_LIFT_MIN <= height <= FOOT_LIFT_MAX for height in (lift.front, lift.rear)):
        raise InvalidGoal(f"feet are lifted by {FOOT_LIFT_MIN} to {FOOT_LIFT_MAX} m")
    if not 0.0 <= lift.inward <= INWARD_MAX:
        raise InvalidGoal(f"feet come down at most {INWARD_MAX} m nearer to the middle")


class Legs(Component):
    """Changes of posture and motions are actions that hold the base; driving needs STANDING."""

    limits: LegLimits
    choreography: Choreography  # the last dance; empty before the first

    @property
    @abstractmethod
    def posture(self) -> Posture:
        """Current state."""

    @property
    @abstractmethod
    def body_height(self) -> float:
        """Current height of the belly above the floor, m."""

    @property
    @abstractmethod
    def attitude(self) -> Orientation:
        """Current roll, pitch and yaw of the body against standing straight, rad."""

    @property
    @abstractmethod
    def performing(self) -> Motion | None:
        """Motion under way; None: none."""

    @property
    @abstractmethod
    def gait(self) -> Gait | None:
        """Current gait; None: the body's default."""

    @property
    @abstractmethod
    def foot_lift(self) -> FootLift:
        """Current swing heights; the robot steps over anything lower than the lower of them."""

    @property
    @abstractmethod
    def feet(self) -> Mapping[Foot, FootState]:
        """Current state of each foot; empty for a body that has no feet or does not report them."""

    @abstractmethod
    def stand(self, *, source: str = "") -> Action:
        """Stand up straight; succeeds at once if already so."""

    @abstractmethod
    def lie_down(self, *, source: str = "") -> Action:
        """Brake and lie down; succeeds at once if lying."""

    @abstractmethod
    def go_limp(self) -> None:
        """Cut the legs' torque in an emergency: cancel all actions on base and legs; the body sinks at once."""

    @abstractmethod
    def walk(self, gait: Gait | None, lift: FootLift | None = None) -> None:
        """Set the gait; velocities are limited to what it can walk.

        After standing still for a second the robot returns to its default gait, except on a leash
        (TROT_PASSIVE): it waits to be pulled until the next command. Raises InvalidGoal for a lift beyond FOOT_LIFT_MIN
        and FOOT_LIFT_MAX.
        """

    @abstractmethod
    def hold(self, body: BodyPose, *, duration: float = 1.0, relative: bool = False, source: str = "") -> Action:
        """Move the body to a pose within ``duration`` s and hold it, standing or walking, until the next command.

        ``relative``: change against the current pose (the result is cut to the limits). Raises InvalidGoal beyond
        the limits; aborts with Refused unless the robot stands.
        """

    @abstractmethod
    def perform(self, motion: Motion, *, source: str = "") -> Action:
        """Perform a motion of ``MOTIONS``; it displaces the robot as the table says, unless something is hit.

        Aborts with Refused in a wrong initial posture or with a low battery, with Blocked when something
        was in the way.
        """

    @abstractmethod
    def dance(self, steps: Sequence[Step], footfalls: Sequence[Footfall] = (), *, source: str = "") -> Action:
        """Perform a custom choreography, then stand straight again.

        ``footfalls`` repeat as long as there are steps; none: those of walking. Standing feet hold the body back
        where a leg is fully stretched. Raises InvalidGoal for too many
        steps, impossible body poses, footholds or lifts, and for footfalls that no body can balance on; aborts as
        ``perform`` does.
        """
