"""The path_monitor of a robot that drives behind another one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from roboglot.autonomy.navigation.path_monitor import PathMonitor
from roboglot.autonomy.navigation.pilot_tuning import PilotTuning
from roboglot.model.clock import LockstepClock
from roboglot.model.geometry import Point, Pose


@pytest.mark.parametrize(
    ("speed", "others", "held_up"),
    [(0.8, True, 0.0), (0.1, True, 5.0), (0.8, False, 5.0)],
    ids=["behind", "held", "wall"],
)
async def test_robot_ahead_is_no_obstacle_while_driving_behind(speed: float, others: bool, held_up: float) -> None:
    """Otherwise a robot turns back before the place that the one ahead is about to leave."""
    clock, path = LockstepClock(), np.stack([np.arange(0.0, 3.0, 0.05), np.zeros(60)], axis=1)
    published = list[object]()
    watch: Any = SimpleNamespace(
        _tuning=PilotTuning(),
        _planner=SimpleNamespace(free_way=lambda *_: 1.0, radius=0.25),
        _traffic=SimpleNamespace(is_among_others=lambda _: others),
        _robot=SimpleNamespace(events=SimpleNamespace(publish=published.append)),
        _clock=clock,
        _action=None,
        _stop_for_others=lambda *_: None,
        blocked=False,
    )
    route = SimpleNamespace(ahead=lambda *_: path, centre=lambda *_: (1.0, False))
    follower: Any = SimpleNamespace(route=route, along=0.0, speed=speed, carrot=lambda: (Point(), 0.0))
    for _ in range(6):
        PathMonitor._look_ahead(watch, follower, Pose(), path, path[:0])
        await clock.advance(1.0)
    assert clock.time() - 1.0 - watch.blocked_at == pytest.approx(held_up)
    assert len(published) == 1
