"""Certificates of apps belong to the list of people: worlds that share it take them alike."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from roboglot.access.store import Grant, open_store
from roboglot.config import AccessConfig, ConsoleConfig, RobotConfig, load_config
from roboglot.operations import Right
from roboglot.runtime import Runtime
from tests.access.matrix import ADDRESS, dog_answers


@pytest.mark.parametrize("world", ["w1", "w2"])
async def test_apps_certificate_holds_in_each_world(world: str, tmp_path: Path) -> None:
    """As ``roboglot access add phone --cyberdog ... --data FLEET`` writes it."""
    store = open_store(tmp_path)
    store.add_app("phone", [Grant("a", frozenset({Right.DRIVE}))])
    store.close()
    base = load_config(None, {"data": str(tmp_path / "shards" / world), "world": "empty", "lockstep": True})
    access = AccessConfig(on=True, local=False, people=str(tmp_path))
    robots, console = (RobotConfig("a", "cyberdog2", ADDRESS),), ConsoleConfig(enabled=False)
    runtime = Runtime(replace(base, robots=robots, access=access, console=console))
    await runtime.start()
    try:
        answers = await dog_answers(tmp_path / "cyberdog", "phone", [10001])
        assert answers[10001]
        assert "error_code" not in answers[10001][0]
    finally:
        await runtime.close()
