"""Reflecting strips that the lidar tells from other things: landmarks, and marks to dock at."""

from __future__ import annotations

from roboglot.model.components.component import Component
from roboglot.model.components.sensing.detector import Detector
from roboglot.model.perception import ReflectorSeen


class Reflectors(Component):
    """Looks at every scan of the lidar while somebody watches."""

    detector: Detector[ReflectorSeen]
