"""Counting needs a body that is seen, and no repetition that no one saw the middle of."""

from roboglot.model.perception import JOINTS, Box, Joint, SkeletonSeen, Sport
from roboglot.model.sports import SportCounter

HEIGHTS = {"shoulder": 0.35, "elbow": 0.5, "wrist": 0.6, "hip": 0.6, "knee": 0.8, "ankle": 0.98}


def skeleton(visible=True, **heights):
    joints = []
    for name in JOINTS:
        part = name.rpartition("_")[2]
        x = 0.53 if name.startswith("left") else 0.47
        joints.append(Joint(x, (HEIGHTS | heights).get(part, 0.25), visible))
    return SkeletonSeen(Box(0.5, 0.5, 0.3, 0.9), 1, tuple(joints), 16 / 9)


def counted(*steps, sport=Sport.SQUAT, gap=0.1):
    counter = SportCounter(sport)
    for number, step in enumerate(steps):
        counter.see(step, number * gap)
    return counter.count


def test_down_and_up_is_one():
    up, deep = skeleton(), skeleton(shoulder=0.52, hip=0.78)
    assert counted(up, deep, up, deep, deep, up, up) == 2


def test_half_a_squat_is_none():
    up, half = skeleton(), skeleton(shoulder=0.45, hip=0.70)
    assert counted(up, half, up, half, up) == 0


def test_hardly_visible_people_are_not_counted():
    assert counted(skeleton(), skeleton(False, shoulder=0.52, hip=0.78), skeleton()) == 0


def test_a_pause_in_the_middle_begins_anew():
    up, deep = skeleton(), skeleton(shoulder=0.52, hip=0.78)
    assert counted(up, deep, up, gap=1.5) == 0
