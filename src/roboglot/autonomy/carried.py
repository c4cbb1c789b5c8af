"""A shelf on the jack: its legs around the robot are in every scan, and nothing of the world. They are found when it is
lifted, and left out until it is set down.
"""

from __future__ import annotations

import math

import numpy as np

from roboglot.autonomy.belief import Belief
from roboglot.autonomy.mark_finder import legs_of
from roboglot.autonomy.scan_points import ScanReader
from roboglot.model.components.jack import Jack
from roboglot.model.components.lidar import Lidar
from roboglot.model.events import JackChanged
from roboglot.model.robot import Robot

REACH = 1.1  # m from base_link that the legs of what is lifted stand at most


class CarriedLegs:
    """Tells the belief's reader of scans."""

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot, self._belief = robot, belief
        self._stop = robot.events.listen(JackChanged, self._changed)

    def close(self) -> None:
        """Look no more."""
        self._stop()

    def _changed(self, _: JackChanged) -> None:
        reader = self._belief.reader
        if not self._robot[Jack].loaded:
            reader.carried = None
        elif reader.carried is None and (scan := self._robot[Lidar].scan) is not None:
            legs = legs_of(ScanReader().read(scan).points)
            reader.carried = np.array([(leg.x, leg.y) for leg in legs if math.hypot(leg.x, leg.y) < REACH]).reshape(
                -1, 2
            )
