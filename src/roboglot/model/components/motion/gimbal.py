"""The gimbal: two axes that aim camera and blaster, coupled in yaw to the chassis. Knows neither camera nor blaster."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.values import dataclass

GIMBAL = "gimbal"  # the resource of all actions that turn the gimbal


class FollowMode(StrEnum):
    """Coupling of the yaw of gimbal and chassis."""

    FREE = "free"  # independent: the gimbal keeps its heading in the world while the chassis turns
    CHASSIS_LEAD = "chassis_lead"  # the gimbal returns to the chassis' front; yaw commands have no effect
    GIMBAL_LEAD = "gimbal_lead"  # the chassis turns its front to where the gimbal points


class GimbalFrame(StrEnum):
    """Reference of the angles of a goal."""

    BODY = "body"  # the chassis' front and plane
    WORLD = "world"  # the heading at power-on and the horizon
    STABILIZED = "stabilized"  # the chassis' front and the horizon


@dataclass(frozen=True, slots=True)
class GimbalAngles:
    """Rad, REP-103: pitch positive nose down, yaw counter-clockwise (not wrapped: the axis goes past half a turn)."""

    pitch: float = 0.0
    yaw: float = 0.0


@dataclass(frozen=True, slots=True)
class GimbalLimits:
    """Reach of both axes relative to the body (rad) and their top speed (rad/s)."""

    lowest: GimbalAngles
    highest: GimbalAngles
    speed: float


class Gimbal(Component):
    """Stabilised: between commands it holds its direction in the world, within mode and limits."""

    limits: GimbalLimits

    @property
    @abstractmethod
    def angles(self) -> GimbalAngles:
        """Current angles relative to the body."""

    @property
    @abstractmethod
    def attitude(self) -> GimbalAngles:
        """Angles in the world: pitch to the horizon, yaw to the heading at power-on (by the gyro, so it drifts)."""

    @property
    @abstractmethod
    def mode(self) -> FollowMode:
        """Current follow mode; CHASSIS_LEAD at power-on."""

    @abstractmethod
    def set_mode(self, mode: FollowMode) -> None:
        """Set the follow mode."""

    @property
    @abstractmethod
    def suspended(self) -> bool:
        """True if the motors have no torque."""

    @abstractmethod
    def suspend(self) -> None:
        """Cut the torque: its action is cancelled, friction holds it on the body, and commands are refused."""

    @abstractmethod
    def resume(self) -> None:
        """Restore the torque; the gimbal holds its current angles."""

    @abstractmethod
    def set_speed(self, pitch: float, yaw: float, *, source: str = "") -> Action:
        """Turn at these speeds (rad/s, cut to the limit) until the next command; both 0 stops and SUCCEEDs.

        Speeds are relative to the world. If the same source is turning it already, its action continues with them.
        """

    @abstractmethod
    def move_to(
        self,
        *,
        pitch: float | None = None,
        yaw: float | None = None,
        frame: GimbalFrame = GimbalFrame.BODY,
        pitch_speed: float | None = None,
        yaw_speed: float | None = None,
        source: str = "",
    ) -> Action:
        """Turn to these angles (rad; None: leave that axis alone) at up to these speeds (rad/s).

        In GIMBAL_LEAD, where the body follows, a yaw in frame BODY is relative to the body's heading at the
        start. Raises InvalidGoal outside the limits (frame BODY) or for a speed of 0, Refused while suspended. When
        a goal turns out to be beyond its travel, the axis goes as far as it can and the action fails (Unreachable).
        """

    @abstractmethod
    def move_by(
        self,
        *,
        pitch: float = 0.0,
        yaw: float = 0.0,
        pitch_speed: float | None = None,
        yaw_speed: float | None = None,
        source: str = "",
    ) -> Action:
        """Turn by these angles (rad); beyond the limits it ends Unreachable, at the limit, as ``move_to`` does."""

    @abstractmethod
    def recenter(self, *, source: str = "") -> Action:
        """Turn both axes back to the body's front."""
