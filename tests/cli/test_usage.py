"""Usage of the command, however it is called, and readers of its output that go."""

import subprocess
import sys

import click
import pytest
from rich.text import Text
from typer.main import get_command

from roboglot.cli import COMMANDS, loaded


def ended(*arguments: str, reader: str = "cat") -> "subprocess.CompletedProcess[str]":
    """Run ``python -m roboglot`` with its output going to ``reader``; its own status comes last."""
    line = f"{sys.executable} -m roboglot {' '.join(arguments)} | {reader}; exit ${{PIPESTATUS[0]}}"
    return subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False, timeout=180)


@pytest.mark.parametrize("name", ["up", "access"])
def test_usage_names_the_command_as_it_is_installed(name: str) -> None:
    done = ended(name, "--nonsense")
    assert done.returncode == 2
    assert f"Usage: roboglot {name} " in done.stderr


@pytest.mark.parametrize("words", [("--help",), ("--version",), ("coverage",)])
def test_reader_that_goes_is_no_error_worth_traceback(words: tuple[str, ...]) -> None:
    assert ended(*words, reader="true").stderr == ""


@pytest.mark.parametrize("name", COMMANDS)
def test_help_shows_words_in_square_brackets(name: str) -> None:
    """Help is markup, in which ``[access]`` is a style and not shown."""
    command = get_command(loaded(name))
    commands = command.commands.values() if isinstance(command, click.Group) else [command]
    texts = [text for each in commands for part in (each, *each.params) if (text := getattr(part, "help", None))]
    assert [Text.from_markup(text).plain for text in texts] == [text.replace("\\[", "[") for text in texts]
