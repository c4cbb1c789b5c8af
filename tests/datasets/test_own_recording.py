"""Recordings of ``roboglot up --record`` become a map with one command."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from roboglot.cli.maps.build import build
from roboglot.config import ConsoleConfig, RecordConfig, RobotConfig, load_config
from roboglot.datasets.drive_log import BadDriveLog
from roboglot.datasets.formats import read_drive_log
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.driving import Driving
from roboglot.model.geometry import Pose
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses

ADDRESS = free_addresses(1)


async def test_our_own_recording_becomes_a_map(tmp_path: Path) -> None:
    path = tmp_path / "drive.mcap"
    base = load_config(None, {"data": str(tmp_path / "data"), "world": "empty", "lockstep": True})
    robots, record = (RobotConfig("a", "universal", ADDRESS),), RecordConfig(to=str(path))
    started = Runtime(dataclasses.replace(base, robots=robots, record=record, console=ConsoleConfig(enabled=False)))
    await started.start()
    assert isinstance(started.clock, LockstepClock)
    await started.clock.advance(1.0)
    started.fleet.robots["a"][Driving].move_by(Pose(2.0), speed=0.5)
    await started.clock.advance(6.0)
    await started.close()
    log = read_drive_log(path)
    assert len(log.scans) >= 60
    first, last = log.scans[0], log.scans[-1]
    assert (last.scan.range_min, last.scan.range_max) == pytest.approx((0.15, 12.0), abs=0.002)
    assert last.odometry.distance_to(first.odometry) == pytest.approx(2.0, abs=0.1)
    build(path, tmp_path / "out", None)
    assert {"map.yaml", "map.stcm", "trajectory.tum", "map.png", "report.md"} <= {
        p.name for p in (tmp_path / "out").iterdir()
    }
    words = (tmp_path / "out" / "trajectory.tum").read_text().splitlines()[-1].split()
    assert abs(float(words[1])) == pytest.approx(2.0, abs=0.1)
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(BadDriveLog):
        read_drive_log(path)
