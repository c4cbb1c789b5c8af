"""The tour begins when everything is compiled: its clients have only so much patience."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from roboglot.cli import demo
from roboglot.kernels import ahead


def test_kernels_are_compiled_before_the_robot_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    done: list[str] = []

    def compile_ahead(*, report: Callable[[str, int, int], None]) -> None:
        report("search", 1, 2)
        done.append("compiled")

    async def tour(*_: object) -> int:
        done.append("drove")
        return 0

    monkeypatch.setattr(ahead, "compile_ahead", compile_ahead)
    monkeypatch.setattr(demo, "_demo", tour)
    with pytest.raises(SystemExit) as ended:
        demo.command("office", "127.0.0.79", tmp_path / "tour.png", 1.0)
    assert ended.value.code == 0
    assert done == ["compiled", "drove"]
    assert "compiled kernel 1 of 2: search" in capsys.readouterr().out


def test_kernels_that_cannot_be_kept_are_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def compile_ahead(**_: object) -> None:
        raise ahead.KernelsUnavailable("/nowhere cannot hold compiled kernels: Read-only file system")

    monkeypatch.setattr(ahead, "compile_ahead", compile_ahead)
    with pytest.raises(SystemExit, match="roboglot demo: /nowhere cannot hold"):
        demo.command("office", "127.0.0.79", tmp_path / "tour.png", 1.0)
