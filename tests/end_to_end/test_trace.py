"""Same seed, same trace: two processes in lockstep do the same to the byte, with driving, mapping and people."""

from __future__ import annotations

import pytest

from roboglot.testing.process import child

SCENARIO = """
import asyncio, hashlib, sys
from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.events import Event, ScanTaken
from roboglot.model.geometry import Point
from roboglot.storage.database import Database

async def main():
    clock, database, trace = LockstepClock(), Database(":memory:"), hashlib.sha256()
    robots, seed = [RobotConfig("a"), RobotConfig("b")], int(sys.argv[1])
    fleet = build_fleet("office", robots, clock=clock, seed=seed, database=database)
    await fleet.start(wait=True)
    a, b = fleet.robots.values()
    a.events.listen(Event, lambda e: trace.update(f"{type(e).__name__} {e.stamp!r};".encode()))
    a.events.listen(ScanTaken, lambda e: trace.update(e.scan.ranges.tobytes()))
    a[Navigation].navigate_to([Point(2, 1), Point(1, 3)], NavigationOptions(yaw=1.0))
    b[Navigation].navigate_to([Point(1, 0)], NavigationOptions())
    for _ in range(40):
        await clock.advance(0.5)
        for robot in (a, b):
            trace.update(repr((robot[Localization].pose, robot[Imu].reading, robot[Battery].state)).encode())
    trace.update(a[Mapping].grid.log_odds.tobytes())
    await fleet.close()
    database.close()
    print(trace.hexdigest())

asyncio.run(main())
"""


@pytest.mark.slow  # three whole programs; tests/simulation/test_world_trace.py has the world's trace
def test_the_same_seed_gives_the_same_trace() -> None:
    with child(SCENARIO, "5") as one, child(SCENARIO, "5") as again, child(SCENARIO, "6") as another:
        first, second, other = (run.communicate()[0] for run in (one, again, another))
    assert len(first.strip()) == 64
    assert first == second
    assert first != other
