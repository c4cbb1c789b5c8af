"""Checks programs with the engine: their problems, the modules that they call, and a refusal with the problems."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Callable, Sequence

from roboglot.programs.engine.engine import Engine, EngineError, EngineSilent, SandboxUnavailable
from roboglot.programs.errors import EngineTimeout, EngineUnavailable, InvalidBody, ProgramProblems
from roboglot.programs.language import BUILTINS, MODULES, Problem, ProblemKind
from roboglot.programs.worker.prelude import Prelude

PROBLEMS_SHOWN = 3
KEPT_MAX = 64  # cached judgements, those of the newest programs
KEPT_CHARACTERS_MAX = 16 * 1024  # longest program whose judgement is cached
Judgement = tuple[list[Problem], frozenset[str]]


class Inspector:
    """Checks programs against ``prelude``; caches results, as a text is checked while typed, saved and run."""

    def __init__(self, engine: Engine, prelude: Callable[[], Prelude]) -> None:
        self._engine = engine
        self._prelude = prelude
        self._judged: OrderedDict[tuple[str, frozenset[str]], asyncio.Future[Judgement]] = OrderedDict()

    def reserved(self, name: str) -> bool:
        """Return whether the language or the robot's functions already use this name."""
        names = self._prelude().names()
        return name in BUILTINS or name in names.plain or name in names.roots or name in MODULES

    async def inspect(self, source: str, functions: frozenset[str]) -> Judgement:
        """Return a program's problems and those of ``functions`` that it uses. Raises ProgramError if that fails."""
        if len(source) > KEPT_CHARACTERS_MAX:
            return await self._examine(source, functions)
        key = (source, functions)
        judging = self._judged.get(key)
        if judging is None:
            judging = self._judged[key] = asyncio.ensure_future(self._examine(source, functions))
            judging.add_done_callback(lambda done: None if _holds(done) else self._forget(key))
            if len(self._judged) > KEPT_MAX:
                self._judged.popitem(last=False)
        else:
            self._judged.move_to_end(key)
        return await asyncio.shield(judging)  # others may wait for the same future

    def _forget(self, key: tuple[str, frozenset[str]]) -> None:
        self._judged.pop(key, None)

    async def _examine(self, source: str, functions: frozenset[str]) -> Judgement:
        try:
            return await self._engine.examine(source, self._prelude(), functions=functions)
        except ValueError as error:
            raise InvalidBody(str(error)) from None
        except EngineSilent as late:
            raise EngineTimeout(str(late)) from None
        except (SandboxUnavailable, EngineError) as error:
            raise EngineUnavailable(str(error)) from None


def _holds(judged: asyncio.Future[Judgement]) -> bool:
    """Return whether a judgement depends on the text alone; failures and SIZE may come from a busy machine."""
    if judged.cancelled() or judged.exception() is not None:
        return False
    return all(problem.kind is not ProblemKind.SIZE for problem in judged.result()[0])


def refuse_wrong(problems: Sequence[Problem]) -> None:
    """Raise ProgramProblems with the first problems, if there are any."""
    if problems:
        shown = "; ".join(
            f"line {p.line}, column {p.column}: {p.english} {p.chinese}" for p in problems[:PROBLEMS_SHOWN]
        )
        more = f" (and {len(problems) - PROBLEMS_SHOWN} more)" if len(problems) > PROBLEMS_SHOWN else ""
        raise ProgramProblems(shown + more)
