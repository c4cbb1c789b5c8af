"""Pose of the robot as each protocol reports it, and in the map frame for comparison."""

from __future__ import annotations

import math

from roboglot.model.geometry import Pose, wrap_angle
from roboglot.values import dataclass

APART = 0.05  # m by which two reports may differ …
DRIFT = 0.015  # … plus this per metre driven, since two of them come from odometry, which drifts
APART_DEGREES = 4.0


@dataclass(frozen=True, slots=True)
class Report:
    """``words``: in the protocol's form; ``pose``: in metres and rad, y left, counter-clockwise."""

    protocol: str
    words: str
    pose: Pose


def from_slamware(x: float, y: float, yaw: float) -> Report:
    """m and rad, counter-clockwise."""
    return Report("Slamware", f"x {x:z.3f} m, y {y:z.3f} m, yaw {yaw:z.3f} rad", Pose(x, y, yaw))


def from_robomaster(x: float, y: float, z: float) -> Report:
    """m with y to the right, degrees clockwise."""
    words = f"x {x:z.3f} m, y {y:z.3f} m to the right, z {z:.1f}° clockwise"
    return Report("RoboMaster", words, Pose(x, -y, wrap_angle(-math.radians(z))))


def from_cyberdog(x: float, y: float, yaw: float) -> Report:
    """m, and a quaternion that is shown here as its angle."""
    return Report("CyberDog", f"px {x:z.3f} m, py {y:z.3f} m, qz {math.sin(yaw / 2):z.3f}", Pose(x, y, yaw))


def from_program(blocks: list[str]) -> Report:
    """Return the report in the text of the program's last block: "x y qz qw" of its odometer."""
    x, y, qz, qw = map(float, blocks[-1].split())
    words = f"position.x {x:z.3f}, position.y {y:z.3f}, orientation.z {qz:.3f}"
    return Report("block program", words, Pose(x, y, 2 * math.atan2(qz, qw)))


def agree(reports: list[Report], driven: float) -> bool:
    """Return True if they mean the same place after ``driven`` metres."""
    metres, degrees = apart(reports)
    return metres <= APART + DRIFT * driven and degrees <= APART_DEGREES


def apart(reports: list[Report]) -> tuple[float, float]:
    """Return the largest distance (m) and angle (degrees) between any two reports."""
    pairs = [(a.pose, b.pose) for a in reports for b in reports]
    return (
        max(a.distance_to(b) for a, b in pairs),
        max(abs(math.degrees(wrap_angle(a.yaw - b.yaw))) for a, b in pairs),
    )
