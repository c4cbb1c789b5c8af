"""Vision: objects that the robot recognizes in its camera's pictures."""

from __future__ import annotations

from roboglot.model.components.component import Component
from roboglot.model.components.sensing.detector import Detector
from roboglot.model.perception import (
    FaceSeen,
    GestureSeen,
    LineSeen,
    MarkerSeen,
    PersonSeen,
    RobotSeen,
    SkeletonSeen,
    TagSeen,
)


class Vision(Component):
    """One detector per kind of object. Viewers select (by colour, the nearest) themselves."""

    people: Detector[PersonSeen]
    faces: Detector[FaceSeen]  # with the names of the robot's members
    gestures: Detector[GestureSeen]
    skeletons: Detector[SkeletonSeen]  # for counting, see ``sports``
    markers: Detector[MarkerSeen]
    lines: Detector[LineSeen]
    robots: Detector[RobotSeen]
    tags: Detector[TagSeen]
