"""The dog's motions by number: which of the model's walks, figures and body poses each is. Knows no robot.

Numbers that are not here (a user's own gaits, climbing by sight, a paw held out) are motions that nothing here can do.
"""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.model.components.gaits import Gait
from roboglot.model.components.motions import Motion as Figure
from roboglot.wire.cyberdog.motion_names import FIGURE_NAMES, WALK_NAMES
from roboglot.wire.cyberdog.motions import Motion

WALKS: Mapping[int, Gait] = {number: Gait[name] for number, name in WALK_NAMES.items()}
FIGURES: Mapping[int, Figure] = {number: Figure[name] for number, name in FIGURE_NAMES.items()}
NUMBERS: Mapping[Figure, int] = {figure: number for number, figure in FIGURES.items()}
DANCES = frozenset({140, 176, 177, 178, 501, 502, 503, 504, 505})  # lying down may interrupt them
# Body poses: whether each adds to how the body is held, and whether a duration must be given.
POSES: Mapping[int, tuple[bool, bool]] = {
    201: (False, False),
    202: (True, False),
    203: (False, True),
    211: (False, True),
    Motion.POSE_RELATIVE: (True, True),
    214: (True, True),
}
POSTURES = frozenset(
    {Motion.EMERGENCY_STOP, Motion.LIE_DOWN, Motion.LIE_DOWN_PASSIVE, Motion.STAND_UP, Motion.WALK_STAND}
)
# What takes its own time: a duration must not be given.
FIXED_TIME = POSTURES | FIGURES.keys() | {Motion.TROT_PASSIVE}
MAY_LAST = WALKS.keys() | POSES.keys()
KNOWN = FIXED_TIME | MAY_LAST
