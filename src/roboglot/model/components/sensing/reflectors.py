"""Reflecting strips that the lidar can distinguish: landmarks, and marks to dock at."""

from __future__ import annotations

from roboglot.model.components.component import Component
from roboglot.model.components.sensing.detector import Detector
from roboglot.model.perception import ReflectorSeen


class Reflectors(Component):
    """Examines every lidar scan while it has viewers."""

    detector: Detector[ReflectorSeen]
