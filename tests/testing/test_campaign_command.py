"""`roboglot campaign` as a command: its exit status and its words."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest
import typer

from roboglot.cli import campaign
from roboglot.testing.campaign.table import Table
from roboglot.testing.campaign.trials import Outcome, Result, Trial

SCENARIO = """
name: stays
given: {world: empty}
when: [{run: "true"}]
then: [{moved: {x: 0, y: 0, within: 1}}]
"""


def play_one(left: list[Trial], table: Table, _player: object) -> bool:
    table.add(left[0], Result(Outcome.PASSED))
    return False


def no_room(*_: object) -> str:
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_report_without_room_is_no_failed_trial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.yaml").write_text(SCENARIO)
    monkeypatch.setattr(campaign, "_play", play_one)
    monkeypatch.setattr("roboglot.testing.campaign.report.report", no_room)
    with pytest.raises(typer.Exit) as ended:
        campaign.command([tmp_path / "a.yaml"], seeds=1, first_seed=1, workers=1, on="", out=tmp_path, longest=9.0)
    assert ended.value.exit_code == 2
    assert capsys.readouterr().err.splitlines() == [
        f"roboglot campaign: {tmp_path / 'report.md'}: No space left on device",
        "the same command resumes",
    ]
