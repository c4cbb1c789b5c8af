"""Carried things: left out of scans, and nothing else; they need room; their former place is free."""

import math

import numpy as np
import pytest

from roboglot.autonomy.docking.shelf_legs import CarriedLegs, Load, standing_among
from roboglot.autonomy.navigation.planner import Planner
from roboglot.autonomy.navigation.planning_options import PlanningOptions
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.evidence import RESOLUTION
from roboglot.autonomy.slam.scan_points import ScanReader
from roboglot.model.components.logistics.jack import Jack, JackStage
from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Unreachable
from roboglot.model.events import JackChanged
from roboglot.model.geometry import Point, Pose
from roboglot.model.sensing import LaserScan


def test_echoes_of_carried_legs_say_nothing():
    angles = np.arange(360) * np.pi / 180
    ranges = np.full(360, 3.0, np.float32)
    legs = [(0.43, 0.43), (-0.43, 0.43), (-0.43, -0.43), (0.43, -0.43)]
    for degrees in (45, 135, 225, 315):
        ranges[degrees - 1 : degrees + 2] = 0.59
    ranges[90] = 0.6  # someone between the legs
    scan = LaserScan(1.0, ranges, 0.0, float(angles[1]), 0.1, 10.0, Pose())
    reader = ScanReader()
    assert (np.hypot(*reader.read(scan).points.T) < 1.0).sum() == 13
    reader = ScanReader()
    reader.carried = np.array(legs)
    seen = reader.read(scan)
    near = seen.points[np.hypot(*seen.points.T) < 1.0]
    assert near.shape == (1, 2)
    assert np.allclose(near[0], (0.0, 0.6), atol=1e-3)
    assert len(seen.ends) == 360 - 12  # neither hits nor free


def test_the_corners_around_the_robot_are_the_shelf():
    shelf = [Point(0.4, 0.45), Point(-0.5, 0.45), Point(-0.5, -0.45), Point(0.4, -0.45)]
    chair = [Point(0.55, 0.8), Point(0.9, 0.8)]
    found = standing_among([*chair, *shelf])
    assert {(leg.x, leg.y) for leg in found} == {(leg.x, leg.y) for leg in shelf}
    assert standing_among(chair) == [chair[0]]  # no shelf: take anything near


class Drive:
    """A robot among empty space 12 m wide, whose parts are what the test says."""

    def __init__(self, robot):
        self.robot, self.belief, self.load = robot, Belief(robot[Odometry]), Load()
        self.legs = CarriedLegs(robot, self.belief, self.load)
        self.planner = Planner(self.belief, 0.27, self.load)
        self.belief.map.make_room(-6.0, -6.0, 6.0, 6.0)
        self.belief.map.evidence[:] = -500

    def stand(self, x, y):
        """Something is on the map there."""
        corner = self.belief.map.corner
        self.belief.map.evidence[int((y - corner.y) / RESOLUTION), int((x - corner.x) / RESOLUTION)] = 500

    def plan(self, goal):
        options = PlanningOptions(now=20.0, top=1.0, acceleration=1.0, tolerance=0.05, drawn=Annotations())
        return self.planner.task(Point(0.0, 0.0), [goal], options).solve()

    def jack(self, monkeypatch, loaded):
        monkeypatch.setattr(type(self.robot[Jack]), "loaded", loaded)
        self.robot.events.publish(JackChanged(stamp=0.0, stage=JackStage.UP, alarm=""))


@pytest.mark.world("empty", body="hermes")
async def test_a_carried_shelf_needs_room_and_leaves_room(robot, forward, monkeypatch):
    await forward(seconds=0.5)
    drive, corners = Drive(robot), [(0.43, 0.43), (-0.43, 0.43), (-0.43, -0.43), (0.43, -0.43)]
    for x in np.arange(-10.9, 10.9, RESOLUTION):
        if abs(x) > 0.5:
            drive.stand(x, 3.0)  # a wall with a gap of a metre
    for x, y in corners:
        drive.stand(x, y)
    through, corner = Point(0.0, 5.0), Point(-0.43, 0.43)
    assert drive.plan(through).length < 6.0
    with pytest.raises(Unreachable, match="too close"):
        drive.plan(corner)

    ranges = np.full(720, 5.0, np.float32)
    for x, y in corners:
        ranges[(np.degrees(math.atan2(y, x)) * 2).astype(int) % 720 + np.arange(-3, 4)] = 0.588
    scan = LaserScan(0.0, ranges, 0.0, math.pi / 360, 0.1, 10.0, Pose())
    monkeypatch.setattr(type(robot[Lidar]), "scan", scan)
    drive.jack(monkeypatch, True)
    assert drive.planner.radius == pytest.approx(0.65, abs=0.02)
    with pytest.raises(Unreachable, match="no path"):
        drive.plan(through)
    assert drive.plan(corner).length == pytest.approx(0.61, abs=0.05)  # the mapped legs are those on the jack

    drive.jack(monkeypatch, False)  # set down where it stood before
    assert drive.planner.radius == 0.27
    with pytest.raises(Unreachable, match="too close"):
        drive.plan(corner)
    drive.legs.close()
