"""Usage of the command, however it is called, and readers of its output that go."""

import gc
import os
import shlex
import sqlite3
import subprocess
import sys
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
import typer
from rich.text import Text
from typer.core import TyperGroup
from typer.main import get_command

from roboglot import cli
from roboglot.cli import COMMANDS, loaded, screen, up


def ended(*arguments: str, reader: str = "cat") -> "subprocess.CompletedProcess[str]":
    """Run ``python -m roboglot`` with its output going to ``reader``; its own status comes last."""
    line = f"{shlex.quote(sys.executable)} -m roboglot {' '.join(arguments)} | {reader}; exit ${{PIPESTATUS[0]}}"
    return subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False, timeout=180)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
@pytest.mark.parametrize("words", [("--version",), ("coverage",), ("test", "--schema")])
def test_output_to_a_full_disk_is_named(words: tuple[str, ...]) -> None:
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "roboglot", *words]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False, timeout=180)
    assert done.returncode == 1
    assert done.stderr == f"roboglot {words[0]}: No space left on device\n"


@pytest.mark.parametrize("name", ["up", "access"])
def test_usage_names_the_command_as_it_is_installed(name: str) -> None:
    done = ended(name, "--nonsense")
    assert done.returncode == 2
    assert f"Usage: roboglot {name} " in done.stderr


@pytest.mark.parametrize("words", [("--help",), ("--version",), pytest.param(("coverage",), marks=pytest.mark.slow)])
def test_reader_that_goes_is_no_error_worth_traceback(words: tuple[str, ...]) -> None:
    assert ended(*words, reader="true").stderr == ""


@pytest.mark.parametrize("name", COMMANDS)
def test_help_shows_words_in_square_brackets(name: str) -> None:
    """Help is markup, in which ``[access]`` is a style and not shown."""
    command = get_command(loaded(name))
    commands = command.commands.values() if isinstance(command, TyperGroup) else [command]
    texts = [text for each in commands for part in (each, *each.params) if (text := getattr(part, "help", None))]
    assert [Text.from_markup(text).plain for text in texts] == [text.replace("\\[", "[") for text in texts]


@pytest.mark.parametrize(("inside", "shown"), [(True, ".venv/bin/roboglot"), (False, "{}/.venv/bin/roboglot")])
def test_lines_to_copy_name_a_program(
    inside: bool, shown: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / ".venv" / "bin" / "roboglot"
    program.parent.mkdir(parents=True)
    program.touch(0o755)
    monkeypatch.setattr(sys, "executable", str(program.with_name("python")))
    monkeypatch.setenv("PATH", "/usr/bin")
    (tmp_path / "home").mkdir()
    monkeypatch.chdir(tmp_path if inside else tmp_path / "home")
    assert screen.as_typed("roboglot scan 10.0.0.1") == f"{shown.format(tmp_path)} scan 10.0.0.1"
    other = tmp_path / "my robots" / "bin" / "roboglot"
    other.parent.mkdir(parents=True)
    other.touch(0o755)
    monkeypatch.setattr(sys, "executable", str(other.with_name("python")))
    assert screen.as_typed("roboglot scan").endswith("my robots/bin/roboglot' scan")
    monkeypatch.setattr(sys, "executable", str(program.with_name("python")))
    assert screen.as_typed("curl http://a") == "curl http://a"
    assert screen.as_typed("WHERE='tcp/a' ros2 topic list") == "WHERE='tcp/a' ros2 topic list"
    monkeypatch.setenv("PATH", str(program.parent))
    assert screen.as_typed("roboglot scan") == "roboglot scan"


@pytest.mark.parametrize(("typed", "called"), [("help up", ["--help"]), ("up --speed 2", ["--speed", "2"])])
def test_word_asks_for_help_on_command(typed: str, called: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[list[str]] = []
    monkeypatch.setattr(cli, "built", lambda name: lambda **_: seen.append([name, *sys.argv[1:]]))
    monkeypatch.setattr(sys, "argv", ["roboglot", *typed.split()])
    cli.main()
    assert seen == [["up", *called]]


@pytest.mark.parametrize("typed", ["", "help", "--help", "-h"])
def test_usage_names_every_command_and_the_version(
    typed: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["roboglot", *typed.split()])
    cli.main()
    shown = capsys.readouterr().out
    assert all(f"  {command} " in shown for command in COMMANDS)
    assert "roboglot --version" in shown


def test_misspelt_option_before_any_command_is_no_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["roboglot", "--versoin"])  # codespell:ignore
    with pytest.raises(SystemExit, match=r"there is no option '--versoin'; did you mean '--version'\?"):
        cli.main()


@pytest.mark.parametrize(("free", "words"), [(15, "the disk is full"), (16, "disk I/O error")])
def test_full_disk_is_named(free: int, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "statvfs", lambda _: Mock(f_bavail=free, f_frsize=4096))
    assert up._why(sqlite3.OperationalError("disk I/O error"), tmp_path) == words


def test_a_robot_is_given_once() -> None:
    bodies = [(robot["name"], robot["body"]) for robot in up._robots(["b=hermes", "a=cyberdog2"])]
    assert bodies == [("a", "cyberdog2"), ("b", "hermes")]
    with pytest.raises(ValueError, match=r"robot b is given twice: by 'b=hermes', and before$"):
        up._robots(["b=universal", "b=hermes"])


def test_collector_scans_nothing_loaded_before_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its first look at all that takes a fortieth of a start."""
    kept: list[int] = []
    monkeypatch.setattr(cli, "built", lambda _: lambda **_: kept.append(gc.get_freeze_count()))
    monkeypatch.setattr(sys, "argv", ["roboglot", "doctor"])
    before, loaded_before = gc.get_freeze_count(), [[number] for number in range(10_000)]
    cli.main()
    assert kept[0] - before > len(loaded_before) / 2


def numbers(kind: str) -> dict[str, Any]:
    """Return the options of all commands that are numbers of a kind, by the command's and their own name."""
    found = {}
    for name in COMMANDS:
        command: Any = get_command(loaded(name))
        for each in getattr(command, "commands", {name: command}).values():
            found |= {f"{name} {part.name}": part for part in each.params if part.type.name.startswith(kind)}
    return found


def test_floating_options_refuse_what_is_no_number() -> None:
    """Speeds are left out: a clock refuses a wrong one itself."""
    floats = {name: option for name, option in numbers("float").items() if not name.endswith(" speed")}
    assert len(floats) > 2
    for option in floats.values():
        for word in ("nan", "inf", "-1e300", "1e300"):
            with pytest.raises(typer.BadParameter):
                option.process_value(Mock(resilient_parsing=False), word)


def test_options_for_ports_are_ports() -> None:
    ports = {name: option for name, option in numbers("int").items() if name.endswith((" http", "port"))}
    assert len(ports) > 2
    assert {name: option.type.max for name, option in ports.items()} == dict.fromkeys(ports, 65535)
