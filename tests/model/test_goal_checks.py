"""Goals that no robot can have: one check for simulation, autonomy and drivers, beside the component's interface."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from roboglot.model.components.energy.power import check_delays
from roboglot.model.components.interaction.armor import check_sensitivity
from roboglot.model.components.interaction.blaster import check_beads
from roboglot.model.components.interaction.speaker import check_text, check_volume
from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.components.motion.driving import check_command, check_offset, top_speed
from roboglot.model.components.motion.following import check_distance
from roboglot.model.components.motion.gripper import check_level
from roboglot.model.components.motion.legs import BodyPose, FootLift, LegLimits, check_lift, check_pose
from roboglot.model.components.motion.navigation import NavigationOptions, check_goals
from roboglot.model.components.sensing.camera import check_exposure
from roboglot.model.components.system.network import check_network
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Orientation, Point, Pose, Twist

LIMITS = LegLimits(lowest=0.1, highest=0.3, angle=0.4, shift=0.1, reach=0.2)
PLACE = (Point(1.0, 2.0),)
NAN = math.nan


@pytest.mark.parametrize(
    "check",
    [
        lambda: check_delays(NAN, None),
        lambda: check_delays(0.0, -1.0),
        lambda: check_sensitivity(11),
        lambda: check_beads(0),
        lambda: check_level(5),
        lambda: check_volume(NAN),
        lambda: check_text(" "),
        lambda: check_exposure(NAN),
        lambda: check_distance(NAN),
        lambda: check_network("", ""),
        lambda: check_network("lab", "short"),
        lambda: check_command(Twist(NAN), None),
        lambda: check_command(WheelSpeeds(front_left=math.inf), None),
        lambda: check_command(Twist(1.0), 0.0),
        lambda: check_offset(Pose(NAN, 0.0, 0.0)),
        lambda: top_speed(NAN, 1.0, "speed"),
        lambda: check_goals((), NavigationOptions(), most=2),
        lambda: check_goals(PLACE * 3, NavigationOptions(), most=2),
        lambda: check_goals((Point(NAN, 0.0),), NavigationOptions(), most=2),
        lambda: check_goals(PLACE, NavigationOptions(yaw=NAN), most=2),
        lambda: check_goals(PLACE, NavigationOptions(speed_ratio=0.0), most=2),
        lambda: check_goals(PLACE, NavigationOptions(tolerance=NAN), most=2),
        lambda: check_goals(PLACE, NavigationOptions(retries=-1), most=2),
        lambda: check_pose(BodyPose(0.4), LIMITS),
        lambda: check_pose(BodyPose(NAN), LIMITS, relative=True),
        lambda: check_pose(BodyPose(None, Orientation(NAN, 0.0, 0.0)), LIMITS),
        lambda: check_pose(BodyPose(None, shift=Point(0.2, 0.0)), LIMITS),
        lambda: check_lift(FootLift(NAN, 0.03)),
        lambda: check_lift(FootLift(inward=0.06)),
    ],
)
def test_impossible_goals_are_refused(check: Callable[[], object]) -> None:
    with pytest.raises(InvalidGoal):
        check()


def test_possible_goals_pass() -> None:
    check_network("lab", "")  # an open network
    check_command(Twist(0.5, 0.0, -1.0), 0.5)
    check_goals(PLACE, NavigationOptions(yaw=-7.0), most=1)
    check_pose(BodyPose(0.4), LIMITS, relative=True)  # added to the present height, which the legs then limit
    check_lift(FootLift())
    assert (top_speed(None, 1.0, "speed"), top_speed(2.0, 1.0, "speed")) == (1.0, 1.0)
