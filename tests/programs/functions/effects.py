"""Effects of the reference page's examples on the world, beyond their output, by the function's name."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from roboglot.model.components.interaction.light import Colour
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.motion.motions import MOTIONS
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.robot import Robot
from roboglot.programs.functions.moving.performing import RESULT_MOTIONS
from tests.programs.staging import Performance

NEAR, ABOUT = 0.05, math.radians(2.0)


@dataclass(frozen=True, slots=True)
class Seen:
    """State after an example: the robot's true displacement (m, rad, in base_link at its start), its actions, and the
    program's output.
    """

    robot: Robot
    way: Pose
    goals: list[object]
    played: Performance

    def went(self, x: float, y: float, degrees: float = 0.0, *, within: float = NEAR) -> bool:
        """Return whether it stands there now."""
        turned = abs(wrap_angle(self.way.yaw - math.radians(degrees)))
        return math.hypot(self.way.x - x, self.way.y - y) < within and turned < ABOUT

    def holds(self, height: float | None = None, *, pitch: float = 0.0, roll: float = 0.0, yaw: float = 0.0) -> bool:
        """Return whether the body is held so (m, degrees)."""
        legs = self.robot[Legs]
        angles = (legs.attitude.roll, legs.attitude.pitch, legs.attitude.yaw)
        wanted = (math.radians(roll), math.radians(pitch), math.radians(yaw))
        level = height is None or abs(legs.body_height - height) < 0.01
        return level and all(abs(have - want) < ABOUT for have, want in zip(angles, wanted, strict=True))

    def at(self, x: float, y: float) -> bool:
        """Return whether it believes to be there on its map."""
        return self.robot[Localization].pose.point.distance_to(Pose(x, y).point) < 0.3


Effect = Callable[[Seen], bool]


def _figure(number: int) -> Effect:
    """Return the check that a motion was performed, and ended where the table of motions says."""
    motion = next(motion for _, known, motion in RESULT_MOTIONS if known == number)
    spec = MOTIONS[motion]

    def happened(seen: Seen) -> bool:
        ended = seen.went(spec.way.x, spec.way.y, math.degrees(spec.way.yaw), within=0.08)
        return motion in seen.goals and ended and seen.robot[Legs].posture is spec.after

    return happened


EFFECTS: dict[str, Effect] = {
    **{f"cyberdog.motion.{name}": _figure(number) for name, number, _ in RESULT_MOTIONS if name != "shake_ass_right"},
    "cyberdog.motion.shake_ass_right": lambda seen: seen.robot[Legs].posture is Posture.STANDING,
    "choreographer.moonwalk": lambda seen: seen.went(-0.1, 0.0, within=0.02),
    "choreographer.push_up": lambda seen: len(seen.goals) == 1,
    "dancer.dance": lambda seen: not seen.goals,
    "cyberdog.audio.get_volume": lambda seen: seen.robot[Speaker].volume == 0.35,
    "cyberdog.audio.instantly_play": lambda seen: seen.goals == ["Watch out!"],
    "cyberdog.audio.offline_instantly_play": lambda seen: seen.goals == ["bark 4000"],
    "cyberdog.audio.offline_play": lambda seen: seen.played.said == ["bark 4001"],
    "cyberdog.audio.play": lambda seen: seen.played.said == ["Hello, I am a dog"],
    "cyberdog.audio.set_log": lambda seen: seen.robot[Speaker].volume == 0.4,
    "cyberdog.audio.set_volume": lambda seen: seen.robot[Speaker].volume == 0.5,
    "cyberdog.follow.cancel_follow": lambda seen: 0.1 < seen.way.x < 0.6,
    "cyberdog.follow.delete_personnel": lambda seen: not seen.goals,
    "cyberdog.follow.follow_personnel": lambda seen: 1.5 < seen.way.x < 2.1,
    "cyberdog.led.freed": lambda seen: Colour(0, 255, 0) in seen.played.colours,
    "cyberdog.led.play": lambda seen: Colour(0, 0, 255) in seen.played.colours,
    "cyberdog.led.play_rgb": lambda seen: Colour(255, 128, 0) in seen.played.colours,
    "cyberdog.motion.absolute_attitude": lambda seen: seen.holds(0.25, roll=10, pitch=-15, yaw=20),
    "cyberdog.motion.automatic_frequency_conversion_walking": lambda seen: seen.went(0.3, 0.0),
    "cyberdog.motion.emergency_stop": lambda seen: seen.went(0.0, 0.0, 30),
    "cyberdog.motion.get_down": lambda seen: seen.robot[Legs].posture is Posture.LYING,
    "cyberdog.motion.go_straight": lambda seen: seen.went(0.3, 0.0),
    "cyberdog.motion.jump_back_and_forth": lambda seen: seen.went(0.15, 0.0),
    "cyberdog.motion.lateral_movement": lambda seen: seen.went(0.0, 0.2),
    "cyberdog.motion.relatively_force_control_attitude": lambda seen: seen.holds(0.17, pitch=10),
    "cyberdog.motion.relatively_position_control_attitude": lambda seen: seen.holds(pitch=20),  # 10 more than before
    "cyberdog.motion.resume_standing": lambda seen: seen.robot[Legs].posture is Posture.STANDING,
    "cyberdog.motion.run_fast_walking": lambda seen: seen.went(0.5, 0.0),
    "cyberdog.motion.run_sequence": lambda seen: seen.way.x > 0.1,
    "cyberdog.motion.set_log": lambda seen: seen.went(0.0, 0.0, 10),
    "cyberdog.motion.small_jump_walking": lambda seen: seen.went(0.15, 0.0),
    "cyberdog.motion.transition_standing": lambda seen: seen.holds(0.15),
    "cyberdog.motion.trot_walking": lambda seen: seen.went(0.55, 0.2, 40),
    "cyberdog.motion.turn": lambda seen: seen.went(0.0, 0.0, -90),
    "cyberdog.navigation.navigation_to_coordinates": lambda seen: seen.at(1.0, 0.2),
    "cyberdog.navigation.navigation_to_preset": lambda seen: seen.at(1.6, 0.3),
    "cyberdog.navigation.to_preset": lambda seen: seen.at(1.6, 0.3) and seen.played.said == ["navigation succeeded"],
    "cyberdog.odometer.get_data": lambda seen: seen.went(0.5, 0.0),
}
