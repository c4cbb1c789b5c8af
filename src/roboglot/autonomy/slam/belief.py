"""The robot's believed pose and its map: the state that localization, mapping and their estimator share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import EvidenceGrid
from roboglot.autonomy.slam.scan_points import ScanReader
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.events import LostReason
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.values import dataclass

SURE = (0.003**2, 0.003**2, 0.002**2)  # m2, m2, rad2: lower bounds of the variances
HALF_SURE = 0.5  # m: a place known no better counts half
SET_BY_CLIENT = (0.15**2, 0.15**2, 0.1**2)  # variances of a pose set by a client

Disc = tuple[float, float, float]  # x, y of the middle (map), radius: m


def worst(covariance: NDArray[np.float64]) -> float:
    """Return the standard deviation (m) of a position in its worst direction."""
    (along, both, _), (_, across, _), _ = covariance.tolist()
    return math.sqrt((along + across) / 2 + math.hypot((along - across) / 2, both))


def _sure() -> NDArray[np.float64]:
    return np.diag(SURE)


@dataclass(slots=True)
class Belief:
    """Belief; the pose in map is ``map_to_odom`` composed with odometry.

    ``doubt``: covariance of the pose (x, y, yaw) in m2, rad2; ``covariance``: the one by which a match weighs odometry,
    smaller where surfaces only seem to show the place, as along a bare corridor.
    """

    odometry: Odometry
    map_to_odom: Pose = ORIGIN
    covariance: NDArray[np.float64] = field(default_factory=_sure)
    doubt: NDArray[np.float64] = field(default_factory=_sure)
    quality: float = 0.0
    localizing: bool = True
    mapping: bool = True
    closing_loops: bool = True
    lost: LostReason | None = None  # why the pose in the map is unknown
    confirmed: bool = True  # whether scans have confirmed a pose that was set, or found after a displacement
    contradicted: bool = False  # whether odometry that is believed contradicts the newest scan
    denied: bool = False  # whether the map contradicts it, or contradicted one since which none has fitted well
    compared_at: float = -math.inf  # robot time at which the newest scan that was compared with the map began
    asked: bool = False  # compare the next scan, even if the robot stands
    slipped: float = 0.0  # m of wheel slip that scans have shown so far
    search: bool = False  # match the next scan in a wide window
    map: EvidenceGrid = field(default_factory=EvidenceGrid)
    revision: int = 0  # of the map
    frame: str = ""  # identifies the loaded map: robots that loaded the same one share coordinates
    others: Sequence[Disc] = ()  # other robots, which are kept off the map
    attached: Sequence[Disc] = ()  # the dock that the robot touches (base_link), which was perhaps moved with it
    reader: ScanReader = field(init=False)

    def __post_init__(self) -> None:
        self.reader = ScanReader(self.odometry)

    @property
    def in_doubt(self) -> bool:
        """True if the pose is lost, or scans have not confirmed it yet."""
        return self.localizing and (self.lost is not None or not self.confirmed)

    @property
    def is_certain(self) -> bool:
        """True if nothing contradicts the pose now; drives check it before they report success."""
        return not self.localizing or not (self.in_doubt or self.contradicted or self.denied)

    @property
    def sigma(self) -> float:
        """Standard deviation (m) of the position in its worst direction."""
        return worst(self.doubt)

    @property
    def score(self) -> float:
        """The quality as clients see it (0..1): less than the scans' fit where they leave the place open."""
        return self.quality / (1.0 + (self.sigma / HALF_SURE) ** 2) if self.localizing else self.quality

    @property
    def pose(self) -> Pose:
        """Current pose of base_link in map (m, rad)."""
        return self.map_to_odom.compose(self.odometry.reading.pose)

    def move_to(self, pose: Pose, odometry: Pose) -> None:
        """Set the pose (map) of base_link at the time of ``odometry`` (odom)."""
        self.map_to_odom = pose.compose(odometry.inverse())

    def widen(self, covariance: NDArray[np.float64]) -> None:
        """Make the pose as much less certain as ``covariance`` has become."""
        self.doubt, self.covariance = self.doubt + (covariance - self.covariance), covariance

    def take_pose(self, pose: Pose) -> None:
        """Set a pose (map) given by a client."""
        self.move_to(pose, self.odometry.reading.pose)
        self.covariance = self.doubt = np.diag(SET_BY_CLIENT)
        self.search = True

    def take_map(self, grid: EvidenceGrid, pose: Pose) -> None:
        """Use ``grid`` from now on, with the robot at ``pose`` in it, given by a client."""
        self.take_pose(pose)
        self.map, self.frame, grid.given = grid, grid.fingerprint(), grid.evidence < 0
        self.revision += 1

    def forget_map(self) -> None:
        """Forget the map; the present pose becomes the new origin."""
        self.move_to(ORIGIN, self.odometry.reading.pose)
        self.covariance, self.doubt = _sure(), _sure()
        self.search, self.map, self.frame = False, EvidenceGrid(), ""
        self.revision += 1
