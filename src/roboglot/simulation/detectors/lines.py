"""Detector of coloured lines on the floor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from roboglot.model.perception import LINE_POINTS, LinePoint, LineSeen
from roboglot.simulation.detectors.observation import PIXEL_NOISE, Floats, Observation
from roboglot.simulation.detectors.tapes import Tape

LINE_RANGE = 3.0  # m
SHORTEST = 12  # points of uninterrupted tape that make a line
CURVATURE_NOISE = 0.02  # 1/m


def see_lines(observation: Observation) -> list[LineSeen]:
    """Return the nearest visible piece of each line, if it is long enough; nearest line first."""
    found = []
    for tape in observation.around.tapes(observation.floor):
        run = _nearest_run(tape, observation)
        if run is not None and not observation.overlooked():
            away = float(np.hypot(*(tape.points[run[0]] - observation.view.at[:2])))
            found.append((away, _line(tape, run, observation)))
    return [line for _, line in sorted(found, key=lambda entry: entry[0])]


def _nearest_run(tape: Tape, observation: Observation) -> NDArray[np.intp] | None:
    """Return the indices of the nearest visible piece, from its nearer end; None: there is none."""
    away = np.hypot(*(tape.points - observation.view.at[:2]).T)
    seen = away <= LINE_RANGE
    if not seen.any():
        return None
    seen[seen] = observation.visible(_on_floor(tape.points[seen], observation))
    runs = [run for run in _runs(seen, tape.closed) if len(run) >= SHORTEST]
    if not runs:
        return None
    run = min(runs, key=lambda one: float(away[one].min()))
    return run[::-1] if away[run[-1]] < away[run[0]] else run


def _runs(seen: NDArray[np.bool_], closed: bool) -> list[NDArray[np.intp]]:
    """Return the runs of neighbouring visible points (indices)."""
    which = np.flatnonzero(seen)
    if not len(which):
        return []
    runs = np.split(which, np.flatnonzero(np.diff(which) > 1) + 1)
    if closed and len(runs) > 1 and seen[0] and seen[-1]:
        runs = [np.concatenate((runs[-1], runs[0])), *runs[1:-1]]
    return list(runs)


def _line(tape: Tape, run: NDArray[np.intp], observation: Observation) -> LineSeen:
    view, random = observation.view, observation.random
    picked = np.linspace(0, len(run) - 1, LINE_POINTS).round().astype(np.intp)
    places, _ = view.project(_on_floor(tape.points[run], observation))
    before, after = np.maximum(picked - 2, 0), np.minimum(picked + 2, len(run) - 1)
    ahead = places[after] - places[before]
    angles = np.arctan2(ahead[:, 0] * view.aspect, -ahead[:, 1])
    backwards = (run[1] - run[0]) % len(tape.points) != 1  # against the tape's own direction
    bends = tape.curvature[run[picked]] * (-1.0 if backwards else 1.0)
    bends += random.standard_normal(LINE_POINTS) * CURVATURE_NOISE
    shown = places[picked] + random.standard_normal((LINE_POINTS, 2)) * PIXEL_NOISE * (1.0, view.aspect)
    points = zip(shown.tolist(), angles.tolist(), bends.tolist(), strict=True)
    return LineSeen(tape.colour, tuple(LinePoint(x, y, angle, bend) for (x, y), angle, bend in points))


def _on_floor(points: Floats, observation: Observation) -> Floats:
    return np.column_stack((points, np.full(len(points), observation.ground)))
