"""Reference page of all functions, made from their declarations; ``python -m`` this module writes it."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from pathlib import Path

from roboglot.programs.functions.prelude import ability_set
from roboglot.programs.functions.table import ABILITIES
from tests.programs.functions.examples import Example, examples

_HEAD = """# Functions of robot programs

For authors of block programs who look up a function. After this page you know its parameters, and have an example
that runs.

Made from the declarations by `.venv/bin/python -m tests.programs.functions.reference docs/reference/programs.md`.
The language is described in [its guide](../programs/language.md), the functions' effects on the robot in
[visual programming](../protocols/visual.md).
Names without parentheses are read, not called. Every example is played by the tests on a simulated dog.
"""


def page() -> str:
    """Return the text of the page, Markdown."""
    return "\n".join([_HEAD, *_lines()])


def _lines() -> Iterator[str]:
    attributes, shown = ability_set().attributes, examples()
    group = ""
    for operation in sorted(ABILITIES, key=lambda operation: operation.key.rsplit(".", 1)):
        owner = operation.key.rpartition(".")[0]
        if owner != group:
            group = owner
            yield f"## {group}\n"
        parameters = list(inspect.signature(operation.handler).parameters.values())[1:]
        call = "" if operation.key in attributes else f"({', '.join(map(_parameter, parameters))})"
        partly = f" In part: {operation.partial}." if operation.partial else ""
        yield f"**`{operation.key}{call}`**: {operation.summary}{partly}\n"
        yield _block(shown[operation.key])


def _block(example: Example) -> str:
    when = [f"While {example.when}:\n"] if example.when else []
    printed = [f"# prints {line}" for line in example.prints.splitlines()]
    logged = [f"# log: {example.logs}"] if example.logs else []
    return "\n".join([*when, "```python", example.code.rstrip("\n"), *printed, *logged, "```\n"])


def _parameter(parameter: inspect.Parameter) -> str:
    default = "" if parameter.default is inspect.Parameter.empty else f" = {parameter.default!r}"
    return f"{parameter.name}: {parameter.annotation}{default}"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8")
