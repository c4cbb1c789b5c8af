"""Doubt in a corridor made of arithmetic: bare walls show nothing about the way along it, a pillar does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from roboglot.kernels.matching import match
from roboglot.kernels.occupancy import integrate

RESOLUTION = 0.05
WALLS = (1.013, 3.431)  # y of both
MIDDLE, REACH = 2.2, 4.0  # y of the lidar; m that it sees
POLE = (21.3, 2.9, 0.15)  # x, y, radius
ANGLES = np.arange(360) * math.tau / 360
WEAK = np.diag([0.3**2, 0.1**2, 0.05**2])
SURE = np.diag([0.01**2, 0.005**2, 0.003**2])  # as matches of bare walls alone claim it


def scan(x: float, rng: np.random.Generator, *, pole: bool, noise: float = 0.01) -> np.ndarray:
    """Echoes (n, 2; base_link) of a robot in the middle that looks along the corridor."""
    cos, sin = np.cos(ANGLES), np.sin(ANGLES)
    with np.errstate(divide="ignore"):
        away = np.where(sin > 0, (WALLS[1] - MIDDLE) / sin, (WALLS[0] - MIDDLE) / sin)
    if pole:
        east, north = POLE[0] - x, POLE[1] - MIDDLE
        along, aside = east * cos + north * sin, np.abs(north * cos - east * sin)
        touched = (along > 0) & (aside < POLE[2])
        away = np.where(touched, along - np.sqrt(np.maximum(0.0, POLE[2] ** 2 - aside**2)), away)
    seen = np.abs(away) < REACH
    away = away[seen] + rng.normal(0, noise, int(seen.sum()))
    return np.stack([away * cos[seen], away * sin[seen]], axis=1)


class Corridor:
    """A corridor of 40 m, mapped by a robot on its way."""

    def __init__(self, *, since: float, until: float, pole: bool = False, noise: float = 0.01) -> None:
        shape, rng = (100, 800), np.random.default_rng(3)
        self.evidence, self.slots = np.zeros(shape, np.int16), np.zeros(shape, np.int32)
        self.surfaces, self.marks = np.zeros((shape[0] * shape[1], 5), np.float32), np.zeros(shape, np.int16)
        self.used = 1
        for number, x in enumerate(np.arange(since, until, 0.08), start=1):
            points = scan(x, rng, pole=pole, noise=noise)
            self.paint(number, points, float(x))

    def paint(self, number: int, points: np.ndarray, x: float) -> None:
        arrays, ends = (self.evidence, self.slots, self.surfaces, self.used, self.marks), np.add(points, (x, MIDDLE))
        self.used = integrate(*arrays, number, ends, np.ones(len(points), np.uint8), x, MIDDLE, True, RESOLUTION)

    def matched(self, points: np.ndarray, prior: np.ndarray, claimed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return standard deviations (x, y, yaw) as claimed and in truth, after a prior with ``claimed`` and WEAK."""
        arrays = (self.slots, self.surfaces, self.evidence)
        _, covariance, *_, stays, added = match(*arrays, points, prior, prior, claimed, np.zeros(2), RESOLUTION, 8)
        return np.sqrt(np.diag(covariance)), np.sqrt(np.diag(stays @ WEAK @ stays.T + added))


@pytest.mark.parametrize("until", [23.0, 18.5], ids=["known", "half known"])
def test_bare_corridors_leave_the_way_along_open(until: float) -> None:
    """Noisy directions of its walls, and walls of few echoes, feign 2 cm, where no scan shows anything."""
    corridor, rng = Corridor(since=13.0, until=until, noise=0.03), np.random.default_rng(5)
    for x in (18.0, 18.27, 18.54):
        points, prior = scan(x, rng, pole=False, noise=0.03), np.array((x, MIDDLE, 0.0))
        sigmas, doubts = corridor.matched(points, prior, WEAK)
        assert sigmas[0] < 0.03
        assert 0.25 < doubts[0] < 0.35
        assert doubts[1] < 0.01
        assert doubts[2] < 0.02
        sigmas, doubts = corridor.matched(points, prior, SURE)  # what a match claimed before makes none sure
        assert sigmas[0] < 0.01
        assert 0.25 < doubts[0] < 0.35


def test_a_pillar_shows_the_way_along() -> None:
    corridor, rng = Corridor(since=16.0, until=24.0, pole=True), np.random.default_rng(5)
    for x in (19.7, 20.0, 20.3):
        _, doubts = corridor.matched(scan(x, rng, pole=True), np.array((x, MIDDLE, 0.0)), WEAK)
        assert doubts[0] < 0.1


def test_in_a_room_the_match_is_right() -> None:
    """Without noise there is no wrong direction; both ends of the corridor show the way along it."""
    corridor, ends = Corridor(since=3.0, until=6.0), np.linspace(0.05, 2.35, 40)
    exact = scan(4.2, np.random.default_rng(5), pole=False, noise=0.0)
    wall = np.stack([np.full(40, -3.0), ends + WALLS[0] - MIDDLE], axis=1)
    points = np.concatenate([exact, wall])
    for number in range(1000, 1010):
        corridor.paint(number, points, 4.2)
    sigmas, doubts = corridor.matched(points, np.array((4.2, MIDDLE, 0.0)), WEAK)
    assert sigmas[0] < 0.02
    assert doubts[0] < 2.0 * sigmas[0]
