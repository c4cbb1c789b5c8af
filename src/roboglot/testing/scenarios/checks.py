"""Checks of the world at the end of a scenario; each returns the mismatch, or an empty text."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.system.health import Health
from roboglot.model.geometry import Point, Pose
from roboglot.model.tap import Direction
from roboglot.testing import assert_pose, passed_in_order
from roboglot.testing.scenarios.files import CHECKS, Check, Exchanged, Place, Range, Visits, verb_of
from roboglot.testing.server import RobotServer


class Checker:
    """Checks the server of one scenario. ``printed`` grows while commands and programs print."""

    def __init__(self, server: RobotServer) -> None:
        self._server = server
        self.printed: list[str] = []
        self._checks: Mapping[str, Callable[[object], str]] = {name: getattr(self, f"_{name}") for name in CHECKS}

    def wrong(self, check: Check) -> str:
        """Return why the check fails, in plain words; empty if it holds."""
        verb = verb_of(check, CHECKS)
        if reason := self._checks[verb](getattr(check, verb)):
            return f"{verb}: {reason}"
        return ""

    def _pose(self, place: Place) -> str:
        return _misplaced(self._server.pose(place.robot), place)

    def _moved(self, place: Place) -> str:
        return _misplaced(self._server.moved(place.robot), place)

    def _track(self, robot: str) -> Sequence[Point]:
        name = robot or next(iter(self._server.addresses))
        track = self._server.call(lambda: [Point(x, y) for x, y in self._server.tracks.get(name, ())])
        here = self._server.pose(name)
        return [*track, Point(here.x, here.y)]

    def _visited(self, visits: Visits) -> str:
        goals = [Point(x, y) for x, y in visits.places]
        track = self._track(visits.robot)
        passed = passed_in_order([track[0], *track], goals, visits.within)
        return "" if passed == len(goals) else f"it came to {passed} of {len(goals)} places, in their order"

    def _travelled(self, bounds: Range) -> str:
        track = self._track(bounds.robot)
        return _outside(sum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in pairwise(track)), bounds, "m")

    def _battery(self, bounds: Range) -> str:
        robot = self._server.runtime.fleet.robots[bounds.robot or next(iter(self._server.addresses))]
        return _outside(self._server.call(lambda: robot[Battery].state.percentage) * 100, bounds, "%")

    def _faults(self, names: Sequence[str]) -> str:
        robots = self._server.runtime.fleet.robots.values()
        have = self._server.call(lambda: {fault.name for robot in robots for fault in robot[Health].faults})
        return "" if have == set(names) else f"there are {', '.join(sorted(have)) or 'none'}"

    def _exchanged(self, wanted: Exchanged) -> str:
        found = 0
        for exchange in tuple(self._server.exchanges):
            direction = Direction.REPLY if wanted.status else Direction.REQUEST
            found += exchange.direction is direction and all(
                given in ("", have)
                for given, have in (
                    (wanted.door, exchange.door),
                    (wanted.operation, exchange.operation),
                    (wanted.status, exchange.status),
                    (wanted.robot, exchange.robot),
                )
            )
        return _outside(found, Range(wanted.at_least, wanted.at_most), "such requests")

    def _refused(self, most: int) -> str:
        refused = [exchange for exchange in tuple(self._server.exchanges) if exchange.refusal]
        if len(refused) <= most:
            return ""
        return f"{len(refused)} requests were refused; the last: {refused[-1].operation}: {refused[-1].refusal}"

    def _printed(self, text: str) -> str:
        return "" if any(text in line for line in self.printed) else f"{text!r} was not printed"


def _misplaced(pose: Pose, place: Place) -> str:
    try:
        assert_pose(pose, x=place.x, y=place.y, deg=place.degrees, within=place.within, within_deg=place.within_degrees)
    except AssertionError as error:
        return str(error)
    return ""


def _outside(value: float, bounds: Range, unit: str) -> str:
    if bounds.at_least is not None and value < bounds.at_least:
        return f"{value:g} {unit}, not at least {bounds.at_least:g}"
    if bounds.at_most is not None and value > bounds.at_most:
        return f"{value:g} {unit}, not at most {bounds.at_most:g}"
    return ""
