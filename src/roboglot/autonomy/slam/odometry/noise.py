"""Noise of odometry: the described one, times factors that are learnt while driving."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.sensing.odometry import OdometryNoise
from roboglot.model.geometry import Pose, bounded
from roboglot.values import dataclass

RISE, FALL = 0.2, 0.02  # weight of a surprise, of a confirmation
UNKNOWN_WHEELS = 3.0  # times the nominal noise, until matches have shown otherwise
FACTOR_MAX = 100.0  # times the nominal noise, as a standard deviation
SURPRISE_MAX = 400.0  # squared ratio: more is a collision or a hand, not noise
LEARNT_MIN = 0.2  # share of a correction that must come from the scan for it to count

BIAS_GAIN = 0.02  # weight of a correction, at least
TURN_UNKNOWN, SCALE_UNKNOWN = 0.01, 0.12  # rad/s, share of the distance: standard deviations before anything is learnt
SCALE_KEPT = 0.02  # … of a scale that was learnt before a restart, at least: wheels may have been changed meanwhile
TURN_BIAS_MAX, SCALE_BIAS_MAX = 0.05, 0.25  # rad/s; share of the distance
LEARNT_TURN_MAX, LEARNT_WAY_MAX = math.radians(1.0), 0.05  # rad, m: larger corrections have other reasons
SCALES = ("scale_x", "scale_y")
LEARNT_WAY_MIN = 0.03  # m driven from which a correction indicates the wheels' scale

Rows = list[list[float]]  # of a covariance


@dataclass(frozen=True, slots=True)
class Doubt:
    """Uncertainty of a correction, without a bias: variances of way (m2) and yaw (rad2)."""

    way: float
    yaw: float


class LearntNoise:
    """The described noise times factors (at least 1) learnt from corrections by matches.

    Unknown wheels begin with a larger factor.
    """

    def __init__(self, described: OdometryNoise) -> None:
        self.described = described
        self.way_factor, self.yaw_factor = UNKNOWN_WHEELS**2, 1.0  # factors of the variances
        self._described, self._before = (0.0, 0.0), np.zeros((3, 3))

    def spread(self, covariance: NDArray[np.float64], way: float, turn: float) -> NDArray[np.float64]:
        """Return ``covariance`` (x, y, yaw) after odometry moved by ``way`` m and ``turn`` rad."""
        along, around = self._described = self.described.variances(way, turn)
        self._before, wider = covariance, covariance.copy()
        wider[0, 0] += along * self.way_factor
        wider[1, 1] += along * self.way_factor
        wider[2, 2] += around * self.yaw_factor
        return wider

    def learn(
        self,
        correction: tuple[float, float, float],
        prior: Rows,
        posterior: Rows,
        direction: float,
        *,
        rising: Callable[[], bool] = lambda: True,
    ) -> None:
        """Learn from a match's ``correction`` (m, m, rad) from ``prior`` to ``posterior`` (covariances).

        ``direction``: of the motion (rad, map); errors across it come from turning, not from the way. The way's factor
        rises only if ``rising()``, which is called only if needed.
        """
        c, s = math.cos(direction), math.sin(direction)
        before, (way, around) = self._before.tolist(), self._described
        correction_along = c * correction[0] + s * correction[1]
        factor = _learnt(
            self.way_factor, correction_along, _along(prior, c, s), _along(posterior, c, s), _along(before, c, s), way
        )
        if factor <= self.way_factor or rising():
            self.way_factor = factor
        self.yaw_factor = _learnt(self.yaw_factor, correction[2], prior[2][2], posterior[2][2], before[2][2], around)

    @property
    def newest(self) -> Doubt:
        """Variances of the last ``spread``."""
        return Doubt(self._described[0] * self.way_factor, self._described[1] * self.yaw_factor)

    @property
    def kept(self) -> dict[str, float]:
        """Values to store for the next start."""
        return {"way_factor": self.way_factor, "yaw_factor": self.yaw_factor}

    def restore(self, kept: Mapping[str, object]) -> None:
        """Continue from ``kept`` values; others than finite numbers are ignored."""
        for name in self.kept:
            if (value := _number(kept.get(name))) is not None:
                setattr(self, name, min(max(value, 1.0), FACTOR_MAX**2))

    @property
    def factors(self) -> tuple[float, float]:
        """Factors of the standard deviations of way and yaw; 1: as described."""
        return math.sqrt(self.way_factor), math.sqrt(self.yaw_factor)


def _along(matrix: Rows, c: float, s: float) -> float:
    """Return the variance in the direction with cosine ``c`` and sine ``s``."""
    return c * c * matrix[0][0] + 2.0 * c * s * matrix[0][1] + s * s * matrix[1][1]


def _learnt(factor: float, correction: float, prior: float, posterior: float, before: float, described: float) -> float:
    """Return ``factor`` after a correction in one direction, with variances in it and the step's described one."""
    share = 1.0 - posterior / prior
    if share < LEARNT_MIN:  # the scan does not constrain this direction
        return factor
    surprise = (correction / share) ** 2 - posterior / share - before
    return _followed(factor, min(max(surprise, 0.0) / described, SURPRISE_MAX))


def _followed(factor: float, ratio: float) -> float:
    gain = RISE if ratio > factor else FALL
    return min(max(factor + gain * (ratio - factor), 1.0), FACTOR_MAX**2)


class LearntBias:
    """Systematic errors of odometry: a wrong wheel size, a drifting gyro.

    Learnt fast at first, like a Kalman filter, and slowly later.
    """

    def __init__(self) -> None:
        self.turn = 0.0  # rad/s missing from odometry's rate of turn
        self.scale_x = self.scale_y = 0.0  # share of the distance, ahead and to the left, missing from odometry
        self._unknown = {"turn": TURN_UNKNOWN**2, "scale_x": SCALE_UNKNOWN**2, "scale_y": SCALE_UNKNOWN**2}

    @property
    def kept(self) -> dict[str, float]:
        """Values to store for the next start; not the doubt of ``turn``: gyros drift differently each time."""
        doubts = {f"{name}_doubt": max(math.sqrt(self._unknown[name]), SCALE_KEPT) for name in SCALES}
        return {"turn": self.turn, "scale_x": self.scale_x, "scale_y": self.scale_y} | doubts

    @property
    def scale_doubt(self) -> float:
        """Standard deviation of the scale that is not learnt yet, as a share of the way."""
        return math.sqrt(max(self._unknown["scale_x"], self._unknown["scale_y"]))

    def restore(self, kept: Mapping[str, object]) -> None:
        """Continue from ``kept`` values; others than finite numbers are ignored."""
        for name in ("turn", *SCALES):
            if (value := _number(kept.get(name))) is not None:
                setattr(self, name, bounded(value, TURN_BIAS_MAX if name == "turn" else SCALE_BIAS_MAX))
        for name in SCALES:
            if (doubt := _number(kept.get(f"{name}_doubt"))) is not None:
                self._unknown[name] = min(max(doubt, SCALE_KEPT), SCALE_UNKNOWN) ** 2

    def spread(self, covariance: NDArray[np.float64], moved: Pose, seconds: float) -> NDArray[np.float64]:
        """Return ``covariance`` (x, y, yaw) widened by the bias not learnt yet, after ``moved`` in ``seconds``."""
        wider = covariance.copy()
        along = self._unknown["scale_x"] * moved.x**2 + self._unknown["scale_y"] * moved.y**2
        wider[0, 0] += along
        wider[1, 1] += along
        wider[2, 2] += self._unknown["turn"] * seconds**2
        return wider

    def missing(self, moved: Pose, seconds: float) -> Pose:
        """Return the correction, in base_link, of odometry that ``moved`` (base_link before) in ``seconds``."""
        back = Pose(yaw=-moved.yaw).compose(Pose(self.scale_x * moved.x, self.scale_y * moved.y))
        return Pose(back.x, back.y, self.turn * seconds)

    def learn(self, moved: Pose, seconds: float, correction: Pose, seen: tuple[float, float], doubt: Doubt) -> None:
        """Learn from a match's ``correction`` (base_link); ``seen``: shares along x and y that come from the scan."""
        if abs(correction.yaw) < LEARNT_TURN_MAX:
            self.turn = bounded(self.turn + self._share("turn", correction.yaw, seconds, doubt.yaw), TURN_BIAS_MAX)
        if math.hypot(correction.x, correction.y) > LEARNT_WAY_MAX:
            return
        turned = Pose(yaw=moved.yaw).compose(Pose(correction.x, correction.y))
        if abs(moved.x) > LEARNT_WAY_MIN and seen[0] > LEARNT_MIN:
            learnt = self._share("scale_x", turned.x, moved.x, doubt.way)
            self.scale_x = bounded(self.scale_x + learnt, SCALE_BIAS_MAX)
        if abs(moved.y) > LEARNT_WAY_MIN and seen[1] > LEARNT_MIN:
            learnt = self._share("scale_y", turned.y, moved.y, doubt.way)
            self.scale_y = bounded(self.scale_y + learnt, SCALE_BIAS_MAX)

    def _share(self, name: str, correction: float, step: float, doubt: float) -> float:
        """Return the learnt part of a correction after a step (s or m), and reduce its uncertainty."""
        gain = self._unknown[name] / (self._unknown[name] + doubt / step**2)
        self._unknown[name] *= 1.0 - gain
        return max(gain, BIAS_GAIN) * correction / step


def _number(value: object) -> float | None:
    usable = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    return float(value) if usable and isinstance(value, (int, float)) else None
