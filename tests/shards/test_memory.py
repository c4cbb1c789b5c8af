"""Worlds that do not fit into the memory are named before they start."""

from __future__ import annotations

from pathlib import Path

import pytest

from roboglot.shards import memory
from roboglot.shards.plan import plan_fleet


@pytest.mark.parametrize(
    ("meminfo", "worlds", "why"),
    [
        (
            "MemFree: 9 kB\nMemAvailable:    4194304 kB\n",
            200,
            "200 worlds with 200 robots take about 6.6 GB of memory, and this machine has 4.0 GB free: it may end some"
            " of them",
        ),
        ("MemAvailable:    4194304 kB\n", 25, ""),
        ("MemAvailable: some\n", 200, ""),
        (None, 200, ""),
    ],
)
def test_worlds_without_room_are_named(
    meminfo: str | None, worlds: int, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "MEMINFO", tmp_path / "meminfo")
    if meminfo is not None:
        (tmp_path / "meminfo").write_text(meminfo)
    assert memory.shortage(plan_fleet(worlds, 1, {}, tmp_path)) == why
