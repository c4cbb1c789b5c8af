"""Detectors of people, their faces, gestures and joints, and of other robots."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Pose
from roboglot.model.perception import JOINTS, Box, FaceSeen, GestureSeen, Joint, PersonSeen, RobotSeen, SkeletonSeen
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.detectors.observation import PIXEL_NOISE, Floats, Observation
from roboglot.simulation.people import figure
from roboglot.simulation.people.people import Walker
from roboglot.values import dataclass

PEOPLE_RANGE, GESTURE_RANGE, ROBOT_RANGE = 15.0, 5.0, 8.0  # m
PERSON_HEIGHT, FACE_HEIGHT, ROBOT_HEIGHT = 0.06, 0.045, 0.03  # smallest share of the picture's height
PART = 0.35  # of a body that must be visible
FRONTAL = math.radians(60)  # the largest angle of a face or a gesturing person
GESTURE_TIME = 0.4  # s to distinguish a gesture from a chance movement
AGE_NOISE = 1.5  # years
FACE_LOW, FACE_HIGH = np.array((-0.10, -0.085, -0.13)), np.array((0.11, 0.085, 0.13))  # around the centre of the head
HEAD = slice(0, 5)
WRIST = JOINTS.index("right_wrist")


@dataclass(slots=True)
class _SeenPerson:
    """A person in sight: joints (world), their visibility, and the box of the whole body."""

    walker: Walker
    joints: Floats
    seen: NDArray[np.bool_]
    box: Box
    distance: float  # m

    @property
    def middle(self) -> Floats:
        """Middle of the torso (world)."""
        middle: Floats = self.joints[5:13].mean(axis=0)
        return middle


def see_people(observation: Observation) -> list[PersonSeen]:
    """Return the people who are sufficiently visible."""
    found = []
    for who in _people_in_sight(observation):
        distance, place = observation.estimate(who.middle)
        found.append(PersonSeen(observation.shaken(who.box), _number(who, observation), distance, place))
    return found


def see_skeletons(observation: Observation) -> list[SkeletonSeen]:
    """Return the joints of people, with those outside the picture or hidden marked as invisible."""
    found = []
    for who in _people_in_sight(observation):
        places, _ = observation.view.project(who.joints)
        places += observation.random.standard_normal(places.shape) * PIXEL_NOISE * (1.0, observation.view.aspect)
        joints = tuple(Joint(x, y, visible) for (x, y), visible in zip(places.tolist(), who.seen.tolist(), strict=True))
        found.append(
            SkeletonSeen(observation.shaken(who.box), _number(who, observation), joints, observation.view.aspect)
        )
    return found


def see_faces(observation: Observation) -> list[FaceSeen]:
    """Return the faces turned to the camera and near enough to be distinguished."""
    found = []
    for who in _people_in_sight(observation):
        walker = who.walker
        head = who.joints[HEAD].mean(axis=0)
        facing = Pose(float(head[0]), float(head[1]), walker.pose.yaw)
        box = observation.view.box(_turned(observation.view.corners(FACE_LOW, FACE_HIGH), walker.pose.yaw) + head)
        if (
            box is None
            or box.height < FACE_HEIGHT
            or observation.bearing_from(facing) > FRONTAL
            or not who.seen[HEAD].all()
        ):
            continue
        age = walker.person.age + float(observation.random.standard_normal()) * AGE_NOISE
        distance, _ = observation.estimate(head)
        name = observation.names.get(walker.face, "")
        number = _number(who, observation)
        found.append(
            FaceSeen(observation.shaken(box), number, walker.face, name, max(0.0, age), walker.emotion, distance)
        )
    return found


def see_gestures(observation: Observation) -> list[GestureSeen]:
    """Return the gestures made towards the camera with a visible hand."""
    found = []
    for who in _people_in_sight(observation):
        showing = who.walker.showing
        if showing is None or showing[1] < GESTURE_TIME or who.distance > GESTURE_RANGE:
            continue
        if who.seen[WRIST] and observation.bearing_from(who.walker.pose) <= FRONTAL:
            found.append(GestureSeen(observation.shaken(who.box), showing[0].gesture, _number(who, observation)))
    return found


def see_robots(observation: Observation) -> list[RobotSeen]:
    """Return the other robots that are sufficiently visible."""
    found = []
    for hull in observation.around.hulls:
        if hull is observation.hull or hull.floor != observation.floor:
            continue
        away = math.dist((hull.pose.x, hull.pose.y), observation.view.at[:2])
        if away > ROBOT_RANGE:
            continue
        box = observation.view.box(_outline(hull))
        if box is None or box.height < ROBOT_HEIGHT:
            continue
        if observation.visible(_spots(hull, observation), hull).mean() < PART or observation.overlooked():
            continue
        middle = np.array((hull.pose.x, hull.pose.y, hull.elevation + hull.belly))
        distance, place = observation.estimate(middle)
        found.append((away, RobotSeen(observation.shaken(box), distance, place)))
    return [robot for _, robot in sorted(found, key=lambda entry: entry[0])]


def _people_in_sight(observation: Observation) -> Iterator[_SeenPerson]:
    """Yield the people in sight, nearest first."""
    near = []
    for walker in observation.around.walkers:
        away = math.dist((walker.pose.x, walker.pose.y), observation.view.at[:2])
        if walker.floor == observation.floor and away <= PEOPLE_RANGE:
            near.append((away, walker))
    for away, walker in sorted(near, key=lambda entry: entry[0]):
        at = np.array((walker.pose.x, walker.pose.y, observation.ground))
        own = walker.joints
        box = observation.view.box(_turned(observation.view.corners(*figure.extent(own)), walker.pose.yaw) + at)
        if box is None or box.height < PERSON_HEIGHT:
            continue
        joints = _turned(own, walker.pose.yaw) + at
        seen = observation.visible(joints, walker)
        if seen.mean() >= PART and not observation.overlooked():
            yield _SeenPerson(walker, joints, seen, box, away)


def _number(who: _SeenPerson, observation: Observation) -> int:
    return observation.numbers.setdefault(who.walker.key, len(observation.numbers) + 1)


def _turned(places: Floats, yaw: float) -> Floats:
    c, s = math.cos(yaw), math.sin(yaw)
    turned: Floats = places @ np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)))
    return turned


def _heights(hull: Hull) -> tuple[float, float]:
    """Return the heights of a robot's underside and top (world), m."""
    section = hull.body.hull
    return hull.elevation + hull.clearance, hull.elevation + hull.belly + section.torso_height


def _outline(hull: Hull) -> Floats:
    """Return points around a robot's underside and top (world)."""
    angles = np.arange(24) * math.tau / 24
    x = hull.pose.x + hull.body.hull.radius * np.cos(angles)
    y = hull.pose.y + hull.body.hull.radius * np.sin(angles)
    return np.concatenate([np.stack((x, y, np.full(24, z)), axis=1) for z in _heights(hull)])


def _spots(hull: Hull, observation: Observation) -> Floats:
    """Return nine points across a robot, as seen from the camera (world)."""
    bearing = math.atan2(hull.pose.y - observation.view.at[1], hull.pose.x - observation.view.at[0])
    low, high = _heights(hull)
    aside = 0.8 * hull.body.hull.radius
    return np.array(
        [
            (hull.pose.x - side * aside * math.sin(bearing), hull.pose.y + side * aside * math.cos(bearing), z)
            for side in (-1, 0, 1)
            for z in (low + 0.02, (low + high) / 2, high - 0.02)
        ]
    )
