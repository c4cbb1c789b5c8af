"""Propagation of radio waves in a world: loss by distance, walls and slabs."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.logistics.traffic_radio import Announcement
from roboglot.model.geometry import Point, Pose
from roboglot.simulation.building.blueprint import SolidKind, solids_of
from roboglot.simulation.building.keeping import WORLDS_MAX, kept
from roboglot.simulation.world.description import AccessPoint, Mobile, WorldDescription

EXPONENT = 2.2  # indoors, with line of sight
WALL_LOSS = 4.0  # dB
SLAB_LOSS = 15.0
SILENCE = -200.0


FIRST_HOST = 100  # of the assigned addresses
HOSTS_MAX = 154


class Claimant(Protocol):
    """Part of a robot's traffic radio that the others receive."""

    @property
    def claims(self) -> frozenset[str]:
        """Names of the places that the robot claims."""

    @property
    def announced(self) -> Announcement | None:
        """Last announcement of the robot."""

    @property
    def pose(self) -> Pose:
        """Pose of the robot, world frame."""


class Radio:
    """All access points of a world, and their assigned addresses."""

    def __init__(self, world: WorldDescription) -> None:
        self.points = tuple(
            (number, point) for number, floor in enumerate(world.floors) for point in floor.access_points
        )
        self.mobile: Mobile = world.mobile
        self._walls = walls_of(world)
        self._aerials = [(Point(*point.at), point.power, away, point.ssid) for away, point in self.points]
        self._ends = np.array([(point.x, point.y) for point, *_ in self._aerials]).reshape(-1, 2)
        self.traffic: list[Claimant] = []  # those of the robots
        self._leases: dict[str, list[str]] = {}

    def network(self, ssid: str) -> AccessPoint | None:
        """Return the first access point of a network; None: there is none."""
        return next((point for _, point in self.points if point.ssid == ssid), None)

    def levels(self, at: Point, floor: int) -> dict[str, float]:
        """Return each network's signal at a place, dBm: that of its strongest access point."""
        found: dict[str, float] = {}
        if not self._aerials:
            return found
        walls = crossings(self._walls[floor], self._ends, at).tolist()
        for (point, power, away, ssid), between in zip(self._aerials, walls, strict=True):
            found[ssid] = max(self._faded(point, power, away, at, floor, between), found.get(ssid, -math.inf))
        return found

    def lease(self, ssid: str, mac: str) -> str:
        """Return the IP address that a network assigns to a card, always the same in a world."""
        point = self.network(ssid)
        assert point is not None
        cards = self._leases.setdefault(ssid, [])
        if mac not in cards:
            cards.append(mac)
        return f"{point.addresses}.{FIRST_HOST + cards.index(mac) % HOSTS_MAX}"

    def walls_between(self, a: Point, b: Point, floor: int) -> int:
        """Return the number of the floor's walls between two points."""
        return crossed(self._walls[floor], a, b)

    def heard(self, point: Point, power: float, point_floor: int, at: Point, floor: int) -> float:
        """Return a sender's signal at a place, dBm; ``power``: its signal at 1 m, dBm."""
        return self._faded(point, power, point_floor, at, floor, crossed(self._walls[floor], point, at))

    @staticmethod
    def _faded(point: Point, power: float, point_floor: int, at: Point, floor: int, walls: int) -> float:
        slabs = abs(point_floor - floor)
        distance = math.hypot(point.distance_to(at), 3.0 * slabs)
        loss = 10 * EXPONENT * math.log10(max(1.0, distance))
        return power - loss - SLAB_LOSS * slabs - WALL_LOSS * walls


@kept(WORLDS_MAX)
def walls_of(world: WorldDescription) -> list[NDArray[np.float64]]:
    """Return the walls' middle lines by floor: rows x, y of both ends, then of their difference (6, n; m)."""
    floors = []
    for floor in world.floors:
        ends = []
        for solid in solids_of(floor, world.lift, lift_here=False):
            if solid.kind is SolidKind.WALL:
                half, c, s = solid.size[0] / 2, math.cos(solid.pose.yaw), math.sin(solid.pose.yaw)
                x, y = solid.pose.x, solid.pose.y
                ends.append((x - c * half, y - s * half, x + c * half, y + s * half))
        lines = np.array(ends).reshape(-1, 4).T
        floors.append(np.ascontiguousarray(np.concatenate((lines, lines[2:] - lines[:2]))))
    return floors


def crossed(walls: NDArray[np.float64], a: Point, b: Point) -> int:
    """Return the number of walls (from ``walls_of``) between two points."""
    return int(crossings(walls, np.array(((a.x, a.y),)), b)[0])


def crossings(walls: NDArray[np.float64], ends: NDArray[np.float64], b: Point) -> NDArray[np.intp]:
    """Return the number of walls (from ``walls_of``) between each of ``ends`` (n, 2) and one point."""
    x1, y1, x2, y2, wall_x, wall_y = walls
    x, y = ends[:, :1], ends[:, 1:]
    way_x, way_y = b.x - x, b.y - y
    parts_points = (wall_x * (y - y1) - wall_y * (x - x1)) * (wall_x * (b.y - y1) - wall_y * (b.x - x1)) < 0
    parts_walls = (way_x * (y1 - y) - way_y * (x1 - x)) * (way_x * (y2 - y) - way_y * (x2 - x)) < 0
    counts: NDArray[np.intp] = np.count_nonzero(parts_points & parts_walls, axis=1)
    return counts
