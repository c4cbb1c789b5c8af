"""A few kills in the suite; ``kills.py`` has the loop, and is run by hand with more of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.protocols.slamware.kills import Places, run


@pytest.mark.parametrize("kills", [2, pytest.param(10, marks=pytest.mark.slow)])
def test_nothing_acknowledged_is_lost(tmp_path: Path, kills: int) -> None:
    assert run(kills, 7, tmp_path) == []


def test_the_judge_notices_what_is_lost() -> None:
    class Forgetful(Places):
        def read(self, _ask: object) -> dict[str, int]:
            return {"k1": 7, "k3": 5}

    writer = Forgetful(known={"k1": 7, "k2": 8}, flying=("k3", 5))
    assert [problem.split()[1] for problem in writer.check(print)] == ["k2:"]  # type: ignore[arg-type]
