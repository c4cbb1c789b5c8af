"""Claim: at >= 1,000 places of six buildings, whole and half mapped: none wrong, >= 97 % right, <= 30 ms median.

Each scan is searched in the whole map, as localization does. An answer is right within 10 cm and 3 degrees. No answer
is expected at places that the map does not show (less than 85 % of the echoes on its surfaces), and at places whose
scan would look the same at a rival place (nine in ten echoes within 15 cm). Half a map may show only the rival, which
no scan can tell apart: such an answer is counted as a twin. ``--quick``: 40 places a building. ``--drawn SEED``: four
buildings drawn from that seed, on which nothing was tuned.
"""

from __future__ import annotations

import asyncio
import math
import statistics
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from _buildings import BUILDINGS, Building, building
from _claim import Claims
from _generated import KINDS, generate

from roboglot.autonomy.slam.evidence import EvidenceGrid
from roboglot.autonomy.slam.matcher import FREE, Match, fit, places
from roboglot.autonomy.slam.scan_points import ScanPoints, ScanReader
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.sensing import LaserScan

PLACES, QUICK = 120, 40
DRAWN_PLACES = 150
BEGUN = 2.0  # m east of the start that even half a map covers
SYMMETRIC = ("twins", "turned")
SHARE_MIN, MILLISECONDS_MAX = 0.97, 30.0
GOOD, GOOD_YAW = 0.1, math.radians(3.0)  # m, rad from the truth
SHOWN = 0.85  # m, RMS of echoes against the map
ALIKE, ALIKE_SHARE = 0.15, 0.9  # m, share of the echoes


def is_right(found: Pose, truth: Pose) -> bool:
    return found.distance_to(truth) < GOOD and abs(wrap_angle(found.yaw - truth.yaw)) < GOOD_YAW


async def is_alike(house: Building, points: ScanPoints, truth: Pose, found: list[Match]) -> bool:
    """Return True if a scan at one of the other places found would be the same."""
    for rival in found:
        if is_right(rival.pose, truth):
            continue
        other = ScanReader().read(await house.scan_at(rival.pose))
        if not len(other.points):
            continue
        away = np.hypot(*(points.points[:, None] - other.points).transpose(2, 0, 1))
        if min((away.min(axis=axis) < ALIKE).mean() for axis in (0, 1)) >= ALIKE_SHARE:
            return True
    return False


async def verdict(house: Building, grid: EvidenceGrid, scan: LaserScan, seconds: list[float]) -> str:
    """Outcome of one scan."""
    truth, points = house.truth, ScanReader().read(scan)
    began = time.thread_time()
    found = places(grid, points, None)
    seconds.append(time.thread_time() - began)
    if len(found) == 1 and is_right(found[0].pose, truth):
        return "right"
    shown = fit(grid, points, truth, FREE, iterations=0)
    is_shown = shown.fit >= SHOWN * shown.points
    if len(found) == 1:
        return "twin" if not is_shown and await is_alike(house, points, truth, found) else "WRONG"
    if not is_shown:
        return "not shown"
    if found and await is_alike(house, points, truth, found):
        return "alike"
    return "shy"


async def measure(name: str, count: int, seconds: list[float]) -> Counter[str]:
    """Return the verdicts in one building, on the map of all of it and of its western half."""
    verdicts = Counter[str]()
    async with building(name) as house:
        whole = await house.survey()
        floor, draw = house.floor(whole), np.random.default_rng(1)
        maps = {"whole": whole, "half": await house.survey(max(BEGUN, float(np.median(floor[:, 0]))))}
        for number in draw.integers(0, len(floor), count):
            x, y = floor[number].tolist()
            pose = Pose(x, y, float(draw.uniform(-math.pi, math.pi)))
            for part, grid in maps.items():
                if part == "half" and Path(name).stem in SYMMETRIC:
                    continue  # only what is missing tells this wing from the other
                scan = await house.scan_at(pose)
                said = await verdict(house, grid, scan, seconds)
                verdicts[said] += 1
                if said in ("WRONG", "shy", "twin"):
                    print(f"  {Path(name).stem}, {part}: {said} at ({pose.x:.2f}, {pose.y:.2f}, {pose.yaw:.2f})")
    print(
        f"{Path(name).stem:9}", ", ".join(f"{said} {number}" for said, number in sorted(verdicts.items())), flush=True
    )
    return verdicts


def buildings(folder: str) -> Iterator[tuple[str, int]]:
    """Buildings to measure in, and the number of places."""
    if "--drawn" in sys.argv:
        seed = int(sys.argv[sys.argv.index("--drawn") + 1])
        for kind in KINDS:
            yield str(generate(kind, seed, Path(folder))), DRAWN_PLACES
        return
    for name in BUILDINGS:
        yield name, PLACES


async def main() -> None:
    total, seconds = Counter[str](), list[float]()
    with tempfile.TemporaryDirectory() as folder:
        for name, count in buildings(folder):
            total += await measure(name, QUICK if "--quick" in sys.argv else count, seconds)
    unambiguous = total["right"] + total["shy"] + total["WRONG"]
    claims = Claims()
    claims.at_least("scans", sum(total.values()), 0 if "--quick" in sys.argv else 1000, "")
    claims.at_most("wrong", total["WRONG"], 0, "")
    claims.at_least("right where it is unambiguous", 100.0 * total["right"] / unambiguous, 100.0 * SHARE_MIN, "%")
    worst = max(seconds) * 1000
    claims.at_most(f"median; worst {worst:.0f} ms", statistics.median(seconds) * 1000, MILLISECONDS_MAX, "ms")
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main())
