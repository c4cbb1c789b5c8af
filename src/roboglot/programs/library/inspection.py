"""Asks the engine what is wrong with a program and which modules it calls, and words the findings as a refusal."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.programs.engine.engine import (
    Engine,
    EngineError,
    EngineSilent,
    SandboxUnavailable,
)
from roboglot.programs.errors import EngineTimeout, EngineUnavailable, InvalidBody, ProgramProblems
from roboglot.programs.language import BUILTINS, MODULES, Problem
from roboglot.programs.worker.prelude import Prelude

PROBLEMS_SHOWN = 3


class Inspector:
    """Looks at programs that find ``prelude``."""

    def __init__(self, engine: Engine, prelude: Prelude) -> None:
        self._engine = engine
        self._prelude = prelude

    def reserved(self, name: str) -> bool:
        """Return whether the language or the robot's functions use this name already."""
        names = self._prelude.names()
        return name in BUILTINS or name in names.plain or name in names.roots or name in MODULES

    async def inspect(self, source: str, functions: frozenset[str]) -> tuple[list[Problem], frozenset[str]]:
        """Return its problems, and which of ``functions`` it uses; raises ProgramError if that fails."""
        try:
            return await self._engine.examine(source, self._prelude, functions=functions)
        except ValueError as error:
            raise InvalidBody(str(error)) from None
        except EngineSilent as late:
            raise EngineTimeout(str(late)) from None
        except (SandboxUnavailable, EngineError) as error:
            raise EngineUnavailable(str(error)) from None


def refuse_wrong(problems: Sequence[Problem]) -> None:
    """Raise what the feedback to a wrong program says, if it is wrong."""
    if problems:
        shown = "; ".join(
            f"line {p.line}, column {p.column}: {p.english} {p.chinese}" for p in problems[:PROBLEMS_SHOWN]
        )
        more = f" (and {len(problems) - PROBLEMS_SHOWN} more)" if len(problems) > PROBLEMS_SHOWN else ""
        raise ProgramProblems(shown + more)
