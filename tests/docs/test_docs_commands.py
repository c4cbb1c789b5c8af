"""Each ``roboglot`` command that the pages show is one that the command line takes, with the options shown."""

from __future__ import annotations

import functools
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from roboglot.cli import COMMANDS, loaded
from tests.docs.test_docs import PAGES, ROOT

FENCED = re.compile(r"^ *```\w*[^\n]*\n(.*?)^ *```", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`([^`\n]*roboglot [^`\n]*)`")
COMMAND = re.compile(r"\s*(?:\$ |[A-Z_]+=\S+ )*(?:\.venv/bin/)?roboglot (.*)")
ENDS = re.compile(r"\s#.*|[;&|>].*|\s<<.*")
WRONG: Any = typer.BadParameter.__base__  # raised by Typer for wrong options and arguments
IN_PROSE = ("MissingParameter", "BadOptionUsage")  # names of commands, or placeholders in capitals


def shown(page: Path) -> Iterator[tuple[str, bool]]:
    """Arguments of the commands that begin a line of a block (True) or are quoted in a sentence (False)."""
    text = page.read_text()
    lines = [line for block in FENCED.findall(text) for line in block.replace("\\\n", " ").splitlines()]
    quoted = INLINE.findall(FENCED.sub("", text))
    for full, commands in ((True, lines), (False, quoted)):
        for command in commands:
            found = COMMAND.match(command)
            if found and (arguments := ENDS.sub("", found[1]).strip()):
                yield arguments, full


@functools.cache
def made(name: str) -> Any:
    """Return the command of this name, which Typer makes of its function's parameters."""
    return typer.main.get_command(loaded(name))


def refusal(arguments: str, full: bool = True) -> str:
    """Return why the command line does not take this; "" if it does."""
    name, *rest = shlex.split(re.sub(r"[…\[\]]", "", arguments))
    if name == "help":
        return refusal(" ".join(rest) if rest and rest != ["COMMAND"] else "--help", full)
    if name not in COMMANDS:
        return "" if name in ("--help", "--version") else f"there is no command {name!r}"
    command: Any = made(name)
    if not rest:
        return ""
    try:
        context = command.make_context(name, rest)
        while hasattr(command, "resolve_command") and (rest := [*context._protected_args, *context.args]):
            name, command, rest = command.resolve_command(context, rest)
            context = command.make_context(name, rest, parent=context)
    except typer.Exit:
        return ""  # after --help
    except WRONG as error:
        sketched = type(error).__name__ in IN_PROSE or re.search(r"\b[A-Z]{3,}\b", arguments)
        return "" if sketched and not full else str(error.format_message())
    return ""


def test_a_misspelt_command_is_found() -> None:
    assert "--no-such" in refusal("up --no-such")
    assert "--rigths" in refusal("access add x --rigths drive")
    assert "foo" in refusal("program foo")
    assert "no command" in refusal("upp")
    assert "no command" in refusal("help upp")
    assert not refusal("help up")
    assert not refusal("up --robot a=hermes --lockstep")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_are_ones_that_exist(page: Path) -> None:
    wrong = {command: why for command, full in shown(page) if (why := refusal(command, full))}
    assert not wrong
