"""Class of two robots: what one of them refuses is still done with the other."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest
import pytest_asyncio

from roboglot.config import ConsoleConfig, RobotConfig, load_config
from roboglot.model.clock import LockstepClock
from roboglot.model.components.system.lease import TEACHER, Lease
from roboglot.model.errors import Refused
from roboglot.model.geometry import Pose
from roboglot.runtime import Runtime
from tests.console.conftest import ADDRESS, OTHER_ADDRESS, ServedConsole


@pytest_asyncio.fixture
async def taught(tmp_path: Path) -> AsyncIterator[ServedConsole]:
    """Two robots, each with a pupil in the open class."""
    base = load_config(None, {"data": str(tmp_path), "world": "empty", "lockstep": True})
    robots = (RobotConfig("a", "universal", ADDRESS), RobotConfig("b", "universal", OTHER_ADDRESS))
    runtime = Runtime(replace(base, robots=robots, console=ConsoleConfig(port=0)))
    assert isinstance(runtime.clock, LockstepClock)
    assert runtime.console is not None
    await runtime.start()
    await runtime.console.ready()
    served = ServedConsole(runtime, runtime.fleet.robots["a"], runtime.clock, runtime.console.address)
    _, class_ = await served.ask("/api/class", {"do": "open"})
    for name in ("Anna", "Ben"):
        assert (await served.ask("/api/sign_in", {"name": name, "code": class_["code"]}))[0] == 200
    yield served
    await runtime.close()


async def test_class_is_reset_beside_a_refusal(taught: ServedConsole) -> None:
    stage = taught.runtime.fleet.world.stage
    start, other = (placed.pose for placed in stage.robots)
    for name, pose in (("a", start), ("b", other)):
        stage.place(name, Pose(pose.x + 2.0, pose.y, pose.yaw))
    stage.add_obstacle(start)
    status, answer = await taught.ask("/api/class", {"do": "reset"})
    assert status >= 400
    assert "a cannot go back to its start" in str(answer)
    assert stage.robots[1].pose.distance_to(other) < 0.01


async def test_failed_lock_is_not_shown(taught: ServedConsole, monkeypatch: pytest.MonkeyPatch) -> None:
    robots = taught.runtime.fleet.robots
    take = Lease.take

    async def full(lease: Lease, who: str) -> None:
        if lease is robots["a"][Lease]:
            raise Refused("the disk is full")
        await take(lease, who)

    with monkeypatch.context() as broken:
        broken.setattr(Lease, "take", full)
        assert (await taught.ask("/api/class", {"do": "lock"}))[0] >= 400
    _, class_ = await taught.ask("/api/class")
    assert {pupil["robot"]: pupil["locked"] for pupil in class_["pupils"]} == {"a": False, "b": True}
    status, class_ = await taught.ask("/api/class", {"do": "lock"})
    assert status == 200
    assert all(pupil["locked"] for pupil in class_["pupils"])
    assert {robot[Lease].taken_by for robot in robots.values()} == {TEACHER}
