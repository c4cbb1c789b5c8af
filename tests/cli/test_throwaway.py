"""uvx and pipx run a command that lacks an extra again, with the extra."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from roboglot.cli import throwaway


def environment_of(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "prefix", str(folder))
    monkeypatch.delenv(throwaway.AGAIN, raising=False)


def test_uv_runs_it_again_only_from_its_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("UV", "/usr/bin/uv")
    environment_of(tmp_path / "uv" / "archive-v0" / "x", monkeypatch)
    assert throwaway.runner() == ["/usr/bin/uv", "tool", "run", "--from"]
    monkeypatch.setenv(throwaway.AGAIN, "1")
    assert throwaway.runner() == []
    environment_of(tmp_path / "project" / ".venv", monkeypatch)
    assert throwaway.runner() == []


def test_pipx_runs_it_again_only_if_not_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("UV", raising=False)
    pipx = tmp_path / "pipx"
    pipx.write_text("#!/bin/sh\n")
    pipx.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    environment_of(tmp_path / ".cache" / "pipx" / "x", monkeypatch)
    assert throwaway.runner() == [str(pipx), "run", "--spec"]
    environment_of(tmp_path / ".local" / "pipx" / "venvs" / "roboglot", monkeypatch)
    assert throwaway.runner() == []


def test_the_same_roboglot_is_wanted_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    class FromFile:
        version = "1.2"

        def read_text(self, _name: str) -> str:
            return json.dumps({"url": "file:///w/roboglot-1.2-py3-none-any.whl", "archive_info": {}})

    monkeypatch.setattr(throwaway, "distribution", lambda _name: FromFile())
    assert throwaway.requirement("demo") == "roboglot[demo] @ file:///w/roboglot-1.2-py3-none-any.whl"
    monkeypatch.setattr(FromFile, "read_text", lambda *_: None)
    assert throwaway.requirement("up") == "roboglot[up]==1.2"


def test_all_words_of_the_command_are_said_again(tmp_path: Path) -> None:
    said = tmp_path / "uv"
    said.write_text('#!/bin/sh\nprintf "%s|" "$@"\n')
    said.chmod(0o755)
    words = ["demo", "--speed", "2 "]
    code = f"from roboglot.cli.throwaway import run_again; run_again([{str(said)!r}, 'x'], 'demo', {words})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("|roboglot|demo|--speed|2 |")
    assert version("roboglot") in done.stdout or " @ file:" in done.stdout
    assert "fetched once" in done.stderr
