"""Ground truth of a simulated world for a recording: topics under ``/truth``, in the frame ``world``."""

from __future__ import annotations

import time

from roboglot.model.stage import Stage
from roboglot.recording.entries import Entry, Put
from roboglot.recording.messages import plain

SELDOM_BEATS = 5
PERSON = 0.25, 1.75  # radius and height in m
THING = 0.1, 0.2


class TruthSampler:
    """Samples the stage."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._before: object = None

    def again(self) -> None:
        """Report latched values again."""
        self._before = None

    def beat(self, number: int, at: int, put: Put) -> None:
        """Sample once; ``at``: ns since 1970."""
        wall = time.time_ns()
        for placed in self._stage.robots:
            put(Entry(f"/truth/{placed.name}/pose", "pose", at, wall, ("world", placed.pose)))
        if number % SELDOM_BEATS == 0:
            self._look_around(at, wall, put)

    def _look_around(self, at: int, wall: int, put: Put) -> None:
        stage = self._stage
        figures = tuple(
            (placed.name, "world", placed.pose, *size, False)
            for placed_there, size in ((stage.people, PERSON), (stage.things, THING))
            for placed in placed_there
        )
        if figures:
            put(Entry("/truth/figures", "scene", at, wall, figures))
        state = {"faults": plain(list(stage.faults)), "obstacles": plain(list(stage.obstacles))}
        if state != self._before:
            self._before = state
            put(Entry("/truth/state", "state", at, wall, state))
