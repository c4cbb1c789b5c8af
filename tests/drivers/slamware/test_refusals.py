"""A robot that answers, but refuses what it reported before: its software broke or restarts, and the link shows it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

import pytest

from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.robot import Robot
from tests.drivers.clients import Until

Ask = Callable[[SlamwareClient], Awaitable[object]]
pytestmark = pytest.mark.world("empty", body="hermes")


class Broken:
    """Parts of the robot that refuse for now."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.parts: dict[str, int] = {}
        for name in ("get_odo_pose", "get_pose"):
            patch.setattr(SlamwareClient, name, self._wrapped(name, getattr(SlamwareClient, name)))

    def _wrapped(self, name: str, ask: Ask) -> Ask:
        async def asked(client: SlamwareClient) -> object:
            if name in self.parts:
                raise SlamwareRefused(f"GET {name}", self.parts[name], "no such service")
            return await ask(client)

        return asked


@pytest.mark.parametrize("status", [404, *(pytest.param(status, marks=pytest.mark.slow) for status in (500, 502))])
async def test_robot_that_only_refuses_is_lost(
    driven: Robot, until: Until, monkeypatch: pytest.MonkeyPatch, status: int
) -> None:
    broken, link = Broken(monkeypatch), driven[Link]
    broken.parts["get_odo_pose"] = status
    await until(lambda: link.state is LinkState.LOST, patience=2)
    assert link.reason == f"the robot no longer reports its odometry: GET get_odo_pose: {status} no such service"
    assert "link lost" in [fault.name for fault in driven[Health].faults]
    broken.parts.clear()
    await until(lambda: link.state is LinkState.UP)


async def test_sleeping_robot_is_not_lost(driven: Robot, until: Until, monkeypatch: pytest.MonkeyPatch) -> None:
    link = driven[Link]
    Broken(monkeypatch).parts["get_odo_pose"] = 403
    await until(lambda: link.age("odometry") > 3, patience=4)
    assert link.state is LinkState.UP


async def test_part_that_starts_late_is_read_again(
    driven: Robot, until: Until, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a restart the robot answers before it knows its pose."""
    broken, link = Broken(monkeypatch), driven[Link]
    broken.parts |= {"get_odo_pose": 404, "get_pose": 404}
    await until(lambda: link.state is LinkState.LOST, patience=2)
    del broken.parts["get_odo_pose"]
    await until(lambda: link.state is LinkState.UP)
    assert link.age("pose") > 1
    broken.parts.clear()
    await until(lambda: link.age("pose") < 0.5, patience=1)
    assert Localization in driven
