"""Turns text into problems or code.

Parsing untrusted text costs time and memory, so the server leaves it to a jailed worker (``Engine.check``); only
command lines and tests call ``check`` directly.
"""

from __future__ import annotations

import ast
import warnings
from itertools import islice
from types import CodeType

from roboglot.programs.language.instrument import Marks, instrument
from roboglot.programs.language.names import Namespace, free_names, unknown_names
from roboglot.programs.language.policy import violations
from roboglot.programs.language.problems import Problem, ProblemKind, from_syntax_error

SOURCE_MAX = 256 * 1024
"""Characters of a program."""
LINES_MAX = 20_000
"""Lines of a program."""
DEPTH_MAX = 250
"""Levels of the syntax tree: parts of one expression, or branches of one ``if``. Pythons differ in what they take."""
PROBLEMS_MAX = 50
"""Findings reported at once."""
_LOOKED_AT_MAX = 4 * PROBLEMS_MAX


def check(source: str, names: Namespace | None = None) -> list[Problem]:
    """Return the problems of a program, in the order of its lines; empty if it can run.

    ``names``: names that the host offers; None skips the search for unknown names.
    """
    tree, problem = _parse(source)
    if tree is None:
        return [problem] if problem else []
    try:
        problems = list(violations(tree))
        if names is not None:
            problems += islice(unknown_names(tree, names), _LOOKED_AT_MAX)  # each requires a search for similar names
    except RecursionError:
        return [_too_deep()]
    if not problems:
        code = _compile(tree, "<program>")
        if isinstance(code, Problem):
            problems = [code]
    return _sorted(problems, source)


def uses(source: str, functions: frozenset[str]) -> list[str]:
    """Return those of ``functions`` that a program reads and does not define, sorted; none if it cannot be parsed."""
    tree, _ = _parse(source)
    return [] if tree is None else sorted(free_names(tree) & functions)


def compile_unit(
    source: str, filename: str, unit: int, marks: Marks, *, policy: bool = True
) -> CodeType | list[Problem]:
    """Return code that marks its lines (see ``instrument``), or the problems of the text.

    With ``policy`` off only the syntax is checked.
    """
    tree, problem = _parse(source)
    if tree is None:
        return [problem] if problem else []
    try:
        problems = list(violations(tree)) if policy else []
        if not problems:
            tree = instrument(tree, unit, marks, rewrite=policy)
    except RecursionError:
        problems = [_too_deep()]
    if problems:
        return _sorted(problems, source)
    code = _compile(tree, filename)
    return [code] if isinstance(code, Problem) else marks.bind(code)


def _sorted(problems: list[Problem], source: str) -> list[Problem]:
    lines = source.splitlines()
    problems = [_in_characters(problem, lines) for problem in problems]
    return sorted(set(problems), key=lambda problem: (problem.line, problem.column))[:PROBLEMS_MAX]


def _parse(source: str) -> tuple[ast.Module | None, Problem | None]:
    if len(source) > SOURCE_MAX or source.count("\n") >= LINES_MAX:
        english = f"The program is too long: at most {LINES_MAX} lines and {SOURCE_MAX} characters."
        return None, Problem(1, 1, ProblemKind.SIZE, english, f"程序太长：最多 {LINES_MAX} 行、{SOURCE_MAX} 个字符。")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(source.removeprefix("\ufeff"))
        return (None, _too_deep()) if _is_deep(tree) else (tree, None)
    except SyntaxError as error:
        return None, from_syntax_error(error.msg, error.lineno or 1, max(1, error.offset or 1), error.text or "")
    except (RecursionError, MemoryError):
        return None, _too_deep()
    except ValueError as error:  # null bytes; lone surrogates raise UnicodeEncodeError, also a ValueError
        return None, from_syntax_error("null bytes" if "null" in str(error) else "invalid character '?'", 1, 1)


def _compile(tree: ast.Module, filename: str) -> CodeType | Problem:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return compile(tree, filename, "exec", dont_inherit=True)
    except SyntaxError as error:
        return from_syntax_error(error.msg, error.lineno or 1, max(1, error.offset or 1))
    except (RecursionError, MemoryError):
        return _too_deep()
    except ValueError as error:
        return from_syntax_error(str(error), 1, 1)


def _is_deep(tree: ast.Module) -> bool:
    level: list[ast.AST] = [tree]
    for _ in range(DEPTH_MAX):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
    return bool(level)


def _too_deep() -> Problem:
    return Problem(1, 1, ProblemKind.SIZE, "The program is nested too deeply.", "程序嵌套得太深。")


def _in_characters(problem: Problem, lines: list[str]) -> Problem:
    """Return the problem with its column in characters; the tree counts UTF-8 bytes."""
    if problem.kind is ProblemKind.SYNTAX or not 1 <= problem.line <= len(lines):
        return problem
    head = lines[problem.line - 1].encode("utf-8", "replace")[: problem.column - 1]
    column = len(head.decode("utf-8", "ignore")) + 1
    return Problem(problem.line, column, problem.kind, problem.english, problem.chinese)
