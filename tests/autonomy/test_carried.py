"""What the robot carries is left out of its scans, and nothing else."""

import numpy as np

from roboglot.autonomy.scan_points import ScanReader
from roboglot.model.geometry import Pose
from roboglot.model.sensing import LaserScan


def test_echoes_of_carried_legs_say_nothing():
    angles = np.arange(360) * np.pi / 180
    ranges = np.full(360, 3.0, np.float32)
    legs = [(0.43, 0.43), (-0.43, 0.43), (-0.43, -0.43), (0.43, -0.43)]
    for degrees in (45, 135, 225, 315):
        ranges[degrees - 1 : degrees + 2] = 0.59
    ranges[90] = 0.6  # somebody between the legs
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
