"""Routes over the map and around recently seen obstacles. Needs the kernels, so it is imported once they are loaded."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.docking.shelf_legs import Load
from roboglot.autonomy.navigation.low_memory import LowMemory
from roboglot.autonomy.navigation.low_sight import LowView
from roboglot.autonomy.navigation.planning_options import KeepClear, PlanningOptions
from roboglot.autonomy.navigation.route import Route
from roboglot.autonomy.navigation.rules import GridFrame, Layers, layers
from roboglot.autonomy.navigation.scan_memory import Cells, ScanMemory
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.evidence import RESOLUTION, is_too_large
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.autonomy.traffic.doubtful_things import without_doubtful, without_gone
from roboglot.autonomy.traffic.waiting_place import shun, waiting_place
from roboglot.kernels.distance import distances
from roboglot.kernels.obstacles import free_way
from roboglot.kernels.search import corners, inflated_cost, line_cost, nearest_open, reopen, shortest_path, ways_from
from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.components.motion.navigation import Tracks
from roboglot.model.errors import Unreachable
from roboglot.model.geometry import Point, Pose
from roboglot.values import dataclass

MARGIN = 0.05  # m of clearance beyond the hull in plans
REACH = 0.5  # m beyond the hull within which obstacles add cost
NEAR_COST = 8.0
UNKNOWN_COST = 3.0
SLACK = 1.02  # a straight line may cost this much more than the cells that it replaces
ESCAPE_MAX = 0.8  # m to the nearest open cell, for a robot that stands too close to an obstacle
OBSTACLE_SECONDS = 10.0  # how long an obstacle out of sight is remembered
MOVING_SECONDS, MOVING_REACH = 1.0, 0.4  # … one that moves, and m around its centre that it occupies
SLOW = 0.35  # m/s past obstacles
HALF_DIAGONAL = 0.036  # m from a cell's centre to its corner: the cell may reach into a goal's tolerance
DOUBT = 5.0  # s
THIN = 0.1  # m: the radius of a hull that passes most gaps
TREAD_MAX = 0.3  # m between two scans; a larger step is a correction of the estimated pose
SQUEEZE = 0.06  # m less than the hull's radius that the map may show where the robot has been: walls are whole cells
TRODDEN_QUALITY = 0.5  # quality of localization from which the robot's own track counts
OFF_MAP = 30.0  # m beyond the known map within which a goal may lie
ROOM = 20  # cells of margin around start and goal that the grid must hold
ROUGH_CELLS = 16_000  # of the coarse grid on which many routes are measured at once

Floats = NDArray[np.float64]
Window = tuple[NDArray[np.int16], NDArray[np.float32], NDArray[np.uint8], Point]


@dataclass(frozen=True, slots=True)
class PlanningTask:
    """Planning task on copies of the arrays, for a thread; positions in map, ``corner``: of cell (0, 0)."""

    evidence: NDArray[np.int16]
    seen: NDArray[np.float32]
    trodden: NDArray[np.uint8]
    corner: Point
    start: Point
    goals: tuple[Point, ...]
    since: float
    radius: float
    top: float
    acceleration: float
    tolerance: float
    drawn: Annotations
    tracks: Tracks
    straight: bool = False
    explains: bool = False  # computes the width of the narrowest place when there is no route
    keep_clear: KeepClear = ()

    def solve(self) -> Route:
        """Return the route through all goals. Raises Unreachable."""
        rules = layers(self.drawn, GridFrame(self.corner, self.evidence.shape), self.tracks, self.start, self.goals)
        self._check_near()
        bare = self.cost(rules)
        cost = self._shunning(bare)
        legs: list[Floats] = []
        start, driven = self.start, dict[tuple[Point, Point], Floats]()  # a patrol repeats
        for number, goal in enumerate(self.goals, start=1):
            leg = driven.get((start, goal))
            if leg is None:
                leg = self._leg(cost, start, goal, f"goal {number} at ({goal.x:z.2f}, {goal.y:z.2f})")
                if legs:
                    driven[start, goal] = leg
                else:
                    self._open_way_out(cost, leg)
            legs.append(leg if not legs else leg[1:])
            start = goal
        route = Route(legs, self.goals, self.tolerance)
        cells = np.floor((route.points - (self.corner.x, self.corner.y)) / RESOLUTION).astype(np.int64)
        near = np.sqrt(np.clip((bare[cells[:, 1], cells[:, 0]] - 1.0) / NEAR_COST, 0.0, 1.0)).astype(np.float64)
        ceilings = self.top - max(0.0, self.top - SLOW) * near
        if rules and rules.speed is not None:
            ceilings = np.minimum(ceilings, rules.speed[cells[:, 1], cells[:, 0]])
        route.set_speeds(ceilings, self.acceleration)
        unknown = self.evidence[cells[:, 1], cells[:, 0]] == 0
        route.unknown = float(np.diff(route.along, prepend=0.0)[unknown].sum())
        route.ends_known = all(self.evidence[self._cell(goal)] < 0 for goal in self.goals)
        return route

    def _check_near(self) -> None:
        """Raise Unreachable for goals more than OFF_MAP m beyond the known map."""
        if all(self.evidence[self._cell(goal)] for goal in self.goals):
            return  # all are on it
        rows, columns = (np.flatnonzero(self.evidence.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return
        west, east = self.corner.x + columns[0] * RESOLUTION, self.corner.x + (columns[-1] + 1) * RESOLUTION
        south, north = self.corner.y + rows[0] * RESOLUTION, self.corner.y + (rows[-1] + 1) * RESOLUTION
        for goal in self.goals:
            off = math.hypot(max(west - goal.x, 0.0, goal.x - east), max(south - goal.y, 0.0, goal.y - north))
            if off > OFF_MAP:
                raise Unreachable(f"({goal.x:z.2f}, {goal.y:z.2f}) lies {off:.0f} m off the map")

    def lengths(self) -> Floats:
        """Return rough distances between start and goals (n + 1, n + 1; m); inf: unreachable.

        Several cells count as one, which is open if one of them is: obstacles are inflated by the hull's radius.
        """
        frame = GridFrame(self.corner, self.evidence.shape)
        cost = self.cost(layers(self.drawn, frame, self.tracks, self.start, self.goals))
        side = max(1, math.ceil(math.sqrt(cost.size / ROUGH_CELLS)))
        rows, columns = -(-cost.shape[0] // side), -(-cost.shape[1] // side)
        padded = np.full((rows * side, columns * side), np.inf, np.float32)
        padded[: cost.shape[0], : cost.shape[1]] = cost
        pooled = padded.reshape(rows, side, columns, side).min(axis=(1, 3))
        rough = np.where(np.isfinite(pooled), np.float32(1.0), np.float32(np.inf))
        reaches = [ESCAPE_MAX] + [self.tolerance] * len(self.goals)
        stops = (self.start, *self.goals)
        cells = [self._open_cell(cost, stop, reach) for stop, reach in zip(stops, reaches, strict=True)]
        found = np.full((len(stops), len(stops)), np.inf)
        there = [number for number, cell in enumerate(cells) if cell is not None]
        at = np.array([cell for cell in cells if cell is not None], np.int64).reshape(-1, 2) // side
        for number, (row, column) in zip(there, at.tolist(), strict=True):
            found[number, there] = ways_from(rough, row, column)[at[:, 0], at[:, 1]] * (side * RESOLUTION)
        straight = np.array([[a.distance_to(b) for b in stops] for a in stops])
        lengths: Floats = np.maximum(np.minimum(found, found.T), straight)
        return lengths

    def floor(self) -> tuple[NDArray[np.bool_], GridFrame]:
        """Return a mask of the known cells where the hull may stand, and its frame."""
        frame = GridFrame(self.corner, self.evidence.shape)
        cost = self.cost(layers(self.drawn, frame, self.tracks, self.start, self.goals))
        return np.isfinite(cost) & (self.evidence < 0), frame

    def cost(self, rules: Layers | None) -> NDArray[np.float32]:
        """Return each cell's cost for the hull; inf: closed."""
        if rules:
            self.seen[rules.closed] = np.inf  # a closed area never expires
        cost: NDArray[np.float32] = inflated_cost(
            self.evidence,
            self.seen,
            self.since,
            RESOLUTION,
            self.radius + MARGIN,
            self.radius + REACH,
            NEAR_COST,
            UNKNOWN_COST,
        )
        self._reopen(cost)
        if rules and rules.extra is not None:
            cost += rules.extra
        return cost

    def _shunning(self, cost: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return ``cost`` raised on the keep_clear ways, which makes routes longer there but not slower."""
        raised = cost.copy() if self.keep_clear else cost
        shun(raised, GridFrame(self.corner, self.evidence.shape), self.keep_clear)
        return raised

    def waiting_place(self) -> Point | None:
        """Return the nearest place off the keep_clear ways; None: there is none nearby."""
        frame = GridFrame(self.corner, self.evidence.shape)
        cost = self._shunning(self.cost(layers(self.drawn, frame, self.tracks, self.start, self.goals)))
        return waiting_place(cost, self.evidence, frame, self.start, self.keep_clear)

    def _reopen(self, cost: NDArray[np.float32]) -> None:
        """Open the cells of the robot's own track, as far as the hull fits."""
        reach = (self.radius - SQUEEZE) / RESOLUTION
        reopen(cost, self.evidence, self.seen, self.since, self.trodden, reach, 1.0 + NEAR_COST + UNKNOWN_COST)

    def _open_way_out(self, cost: NDArray[np.float32], leg: Floats) -> None:
        """Open the first leg's way out of a narrow place, such as a dock, for later legs."""
        here, there = Point(*leg[0].tolist()), Point(*leg[min(1, len(leg) - 1)].tolist())
        if here.distance_to(there) <= ESCAPE_MAX:
            _mark_line(self.trodden, self.corner, here, there)
            self._reopen(cost)

    def _leg(self, cost: NDArray[np.float32], start: Point, goal: Point, name: str) -> Floats:
        """Return the vertices (n, 2; map, m) from ``start`` to ``goal``. Raises Unreachable."""
        first = self._open_cell(cost, start, ESCAPE_MAX)
        last = self._open_cell(cost, goal, self.tolerance + HALF_DIAGONAL)
        if first is None:
            raise Unreachable("the robot has no free floor around it")
        if last is None:
            raise Unreachable(f"{name} is too close to an obstacle, or in one")
        path = self._path(cost, first, last)
        if not len(path):  # the robot may fit where it stands although no route leads on from there, as beside a dock
            never = np.where(self.trodden > 0, np.float32(np.inf), cost)
            elsewhere = self._open_cell(never, start, ESCAPE_MAX)
            if elsewhere is not None and elsewhere != first:
                first, path = elsewhere, self._path(cost, elsewhere, last)
        if not len(path):
            raise Unreachable(f"no path leads to {name}{self._too_narrow(first, last) if self.explains else ''}")
        kept = path[corners(cost, path, SLACK)]
        inner = (kept[:, ::-1] + 0.5) * RESOLUTION + (self.corner.x, self.corner.y)
        # The ends are the given points themselves, unless those lie in closed cells.
        at_start, at_goal = first == self._cell(start), last == self._cell(goal)
        inside = inner[int(at_start) : len(inner) - int(at_goal)]
        end = goal if at_goal else self._within_tolerance(goal, Point(*inner[-1].tolist()))
        return np.concatenate([[[start.x, start.y]], inside, [[end.x, end.y]]])

    def _path(self, cost: NDArray[np.float32], first: tuple[int, int], last: tuple[int, int]) -> NDArray[np.int32]:
        """Return the cells of the way; empty if there is none."""
        if self.straight and math.isfinite(line_cost(cost, *map(float, first), *map(float, last))):
            return np.array([first, last], np.int32)
        path: NDArray[np.int32] = shortest_path(cost, *first, *last)
        return path

    def _too_narrow(self, first: tuple[int, int], last: tuple[int, int]) -> str:
        """Return a message on a gap too narrow for this hull but not for a thin one; "" if there is none."""
        reach = self.radius + REACH
        cost = inflated_cost(self.evidence, self.seen, self.since, RESOLUTION, THIN, reach, NEAR_COST, UNKNOWN_COST)
        path = shortest_path(cost, *first, *last)
        if not len(path):
            return ""
        occupied = (self.evidence > 0) | ((self.seen > 0.0) & (self.seen >= self.since))
        away = distances(occupied.astype(np.uint8), reach / RESOLUTION)[path[:, 0], path[:, 1]]
        width, needed = (2.0 * float(away.min()) - 1.0) * RESOLUTION, 2.0 * (self.radius + MARGIN)
        return f": a gap on the way is about {width:.2f} m wide, {needed:.2f} m are needed" if width < needed else ""

    def _within_tolerance(self, goal: Point, near: Point) -> Point:
        """Return ``near``, moved towards ``goal`` just into the tolerance."""
        away = goal.distance_to(near)
        share = min(1.0, self.tolerance / away)
        return Point(goal.x + share * (near.x - goal.x), goal.y + share * (near.y - goal.y))

    def _cell(self, point: Point) -> tuple[int, int]:
        return int((point.y - self.corner.y) // RESOLUTION), int((point.x - self.corner.x) // RESOLUTION)

    def _open_cell(self, cost: NDArray[np.float32], point: Point, reach: float) -> tuple[int, int] | None:
        """Return the cell of ``point`` if open, or the nearest open one within ``reach`` m; None: none, or off grid."""
        row, column = self._cell(point)
        if not (0 <= row < cost.shape[0] and 0 <= column < cost.shape[1]):
            return None
        if np.isfinite(cost[row, column]):
            return row, column
        x, y = (point.x - self.corner.x) / RESOLUTION, (point.y - self.corner.y) / RESOLUTION
        found = nearest_open(cost, y, x, reach / RESOLUTION)
        return (int(found[0]), int(found[1])) if len(found) else None


class Planner:
    """Memory of obstacles that are not on the map, and maker of planning tasks, for the hull and its load."""

    def __init__(self, belief: Belief, radius: float, load: Load) -> None:
        self._belief, self._hull, self._load = belief, radius, load
        self._scans, self._low = ScanMemory(), LowMemory()
        self._trodden = Cells(np.uint8)  # where the robot's centre has been
        self._trodden_radius = 0.0  # m that were free around it, at least
        self._last: Pose | None = None
        self._stood: tuple[object, ...] = ()  # the last stroke that was marked: map, from, to and radius
        self._doubted: NDArray[np.int16] = np.zeros((0, 0), np.int16)
        self._doubted_until = -math.inf

    @property
    def radius(self) -> float:
        """Radius around base_link that must stay free, of the hull or the load on the jack, m."""
        return max(self._hull, self._load.radius)

    def observe(self, scan: ScanPoints, pose: Pose, now: float) -> Floats:
        """Remember obstacles of a scan; return its near echoes in map (n, 2; m)."""
        grid = self._belief.map
        gone = self._load.gone_from(grid)
        doubts = now < self._doubted_until and self._doubted.shape == grid.evidence.shape
        shown = self._doubted if doubts else grid.evidence
        evidence = without_gone(shown, grid.corner, gone) if len(gone) else shown
        return self._scans.observe(grid, evidence, scan, pose, now)

    def forget_soon(self, places: Sequence[Point], now: float) -> None:
        """Shorten the memory of obstacles around ``places``, which are about to move."""
        self._age(places, max(now - OBSTACLE_SECONDS + MOVING_SECONDS, 1e-3))

    def forget(self, places: Sequence[Point]) -> None:
        """Forget obstacles around ``places``, which will have moved before the robot gets there."""
        self._age(places, 0.0)

    def _age(self, places: Sequence[Point], until: float) -> None:
        """Make sightings around ``places`` at most as new as ``until``, s."""
        if not places:
            return
        grid = self._belief.map
        frame, memories = GridFrame(grid.corner, grid.evidence.shape), [self._scans.seen(grid), *self._low.kept(grid)]
        for window in (frame.around((place,), MOVING_REACH) for place in places):
            for seen in memories:
                np.minimum(seen[window], np.float32(until), out=seen[window])

    def observe_low(self, view: LowView, echoes: Floats, pose: Pose, now: float) -> Floats:
        """Remember obstacles off the lidar's plane that ``echoes`` (map) do not show; return them in map (n, 2; m)."""
        return self._low.observe(self._belief.map, view, echoes, pose, now)

    def low_around(self, pose: Pose, reach: float, now: float) -> Floats:
        """Return the remembered low obstacles within ``reach`` m, in map (n, 2; m)."""
        return self._low.around(self._belief.map, pose, reach, now - OBSTACLE_SECONDS)

    def doubt(self, now: float) -> bool:
        """Doubt single things on the map for a while; return whether they are in doubt already."""
        already = now < self._doubted_until
        self._doubted, self._doubted_until = without_doubtful(self._belief.map), now + DOUBT
        return already

    def tread(self, pose: Pose) -> None:
        """Mark the robot's track: a place that it passed once, driven by any client, it can pass again.

        The map may show less room there: its walls are whole cells thick.
        """
        last, self._last = self._last, pose
        if not (self._belief.localizing and self._belief.quality >= TRODDEN_QUALITY):
            return
        grid, radius = self._belief.map, self.radius
        if (here := (grid, last, pose, radius)) == self._stood:
            return  # already marked
        self._stood = here
        trodden = self._trodden.of(grid)
        if radius > self._trodden_radius:  # the load is wider than what passed there before
            trodden[:] = 0
        self._trodden_radius = radius
        begin = pose if last is None or last.distance_to(pose) > TREAD_MAX else last
        _mark_line(trodden, grid.corner, begin.point, pose.point)

    def free_way(self, path: Floats, points: Floats, pose: Pose, margin: float) -> float:
        """Return the distance along ``path`` until a point is within ``margin`` m of the hull, m; inf: none is."""
        return float(free_way(path, points, pose.x, pose.y, self.radius + margin))

    def task(self, start: Point, goals: Sequence[Point], options: PlanningOptions) -> PlanningTask:
        """Return a planning task on copies of the map and of the remembered obstacles. Raises Unreachable."""
        grid = self._belief.map
        shown = grid.evidence if options.obstacles and options.things else without_doubtful(grid)
        evidence, seen, trodden, corner = self._window(shown, start, *goals)
        return PlanningTask(
            evidence,
            seen if options.obstacles else np.zeros_like(seen),
            trodden,
            corner,
            start,
            tuple(goals),
            options.now - OBSTACLE_SECONDS,
            self.radius,
            options.top,
            options.acceleration,
            options.tolerance,
            options.drawn,
            options.tracks,
            options.straight,
            not options.obstacles,
            options.keep_clear,
        )

    def _window(self, shown: NDArray[np.int16], *points: Point) -> Window:
        """Return copies of the ``shown`` map and of memory that contain all ``points``. Raises Unreachable."""
        grid = self._belief.map
        known = without_gone(shown, grid.corner, self._load.gone_from(grid))
        height, width = known.shape
        rows = [math.floor(p.y / RESOLUTION) - grid.first_row for p in points]
        columns = [math.floor(p.x / RESOLUTION) - grid.first_column for p in points]
        top, bottom = min(0, min(rows) - ROOM), max(height, max(rows) + ROOM)
        left, right = min(0, min(columns) - ROOM), max(width, max(columns) + ROOM)
        if is_too_large(bottom - top, right - left):
            raise Unreachable("the goal is too far from the known map")
        standing, driven = np.maximum(self._scans.seen(grid), self._low.seen(grid)), self._trodden.of(grid)
        if (top, bottom, left, right) == (0, height, 0, width):
            return known, standing, driven.copy(), grid.corner
        evidence = np.zeros((bottom - top, right - left), np.int16)
        seen, trodden = np.zeros(evidence.shape, np.float32), np.zeros(evidence.shape, np.uint8)
        inner = (slice(-top, height - top), slice(-left, width - left))
        evidence[inner], seen[inner], trodden[inner] = known, standing, driven
        return evidence, seen, trodden, Point(grid.corner.x + left * RESOLUTION, grid.corner.y + top * RESOLUTION)


def _mark_line(trodden: NDArray[np.uint8], corner: Point, start: Point, end: Point) -> None:
    """Set the cells of ``trodden`` under a straight way, two cells wide."""
    count = math.ceil(start.distance_to(end) / RESOLUTION) + 1
    if count <= 2:  # as from one scan to the next
        for place in (start, end)[:count]:
            column = math.floor((place.x - corner.x) / RESOLUTION - 0.5)
            row = math.floor((place.y - corner.y) / RESOLUTION - 0.5)
            trodden[max(0, row) : max(0, row + 2), max(0, column) : max(0, column + 2)] = 1
        return
    x, y = start.x - corner.x, start.y - corner.y
    along, up = (end.x - start.x) / (count - 1), (end.y - start.y) / (count - 1)
    for number in range(count):
        column = math.floor((x + number * along) / RESOLUTION - 0.5)
        row = math.floor((y + number * up) / RESOLUTION - 0.5)
        trodden[max(0, row) : max(0, row + 2), max(0, column) : max(0, column + 2)] = 1
