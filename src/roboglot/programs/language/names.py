"""Names that a program may use: the built-in ones, its own, and those the host offers.

Knows only the names' spelling. Finds unknown names in a syntax tree and suggests known ones.
"""

from __future__ import annotations

import ast
import builtins
import math
from collections.abc import Iterable, Iterator, Sequence

from roboglot.programs.language.problems import Problem, ProblemKind
from roboglot.spelling import WORD_MAX, nearest
from roboglot.values import dataclass

MODULES = frozenset({"time", "math", "random", "numbers"})
"""Modules that may be imported. ``time`` needs no import, as the vendor's programs have none."""


def words(text: str) -> frozenset[str]:
    """Return the blank-separated words of a table."""
    return frozenset(text.split())


_FUNCTIONS = words("""
abs all any ascii bin bool bytearray bytes callable chr complex delattr dict divmod enumerate exit filter float format
frozenset getattr hasattr hash hex id int isinstance issubclass iter len list map max min next object oct ord pow print
property quit range repr reversed round set setattr slice sorted staticmethod classmethod str sum super tuple type zip
""")
EXCEPTIONS = words("""
BaseException Exception ArithmeticError AssertionError AttributeError EOFError FloatingPointError GeneratorExit
IndexError KeyError KeyboardInterrupt LookupError MemoryError NameError NotImplementedError OSError OverflowError
RecursionError ReferenceError RuntimeError StopIteration SystemExit TimeoutError TypeError UnboundLocalError
UnicodeError ValueError ZeroDivisionError Warning UserWarning ConnectionError PermissionError BlockingIOError
InterruptedError
""")
"""Exception types available to programs; the host may raise them too."""
BUILTINS = _FUNCTIONS | EXCEPTIONS | words("NotImplemented Ellipsis true false RobotError")
"""All names available without a definition or import. ``true`` and ``false`` are the vendor's spelling."""

_STAR_NAMES = {"math": frozenset(name for name in dir(math) if not name.startswith("_"))}


@dataclass(frozen=True, slots=True)
class Namespace:
    """Names that the host offers.

    ``plain`` names (types, enums, module functions) and ``dotted`` ones such as ``cyberdog.motion.turn``.
    """

    plain: frozenset[str] = frozenset()
    dotted: frozenset[str] = frozenset()

    @property
    def roots(self) -> frozenset[str]:
        """First parts of the dotted names."""
        return frozenset(name.partition(".")[0] for name in self.dotted)


def unknown_names(tree: ast.Module, names: Namespace) -> Iterator[Problem]:
    """Yield problems for undefined names and for misspelt parts of dotted names (``cyberdog.motion.trun``)."""
    bound = set(_bound(tree))
    known = bound | BUILTINS | names.plain | names.roots | {"time", "__name__"}
    roots = names.roots - bound
    branches = {prefix for name in names.dotted for prefix in _prefixes(name)}
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name, ctx=ast.Load()) if name not in known:
                yield _unknown(node, name, "", known)
            case ast.Attribute():
                chain = _chain(node)
                if chain and chain[0] in roots:
                    yield from _misspelt(node, chain, names.dotted, branches)


def _misspelt(
    node: ast.Attribute, chain: Sequence[str], dotted: frozenset[str], branches: set[str]
) -> Iterator[Problem]:
    """Yield the problem if only the last part of a dotted name is unknown: shorter chains are visited on their own."""
    owner, part = ".".join(chain[:-1]), chain[-1]
    path = f"{owner}.{part}"
    if owner in branches and path not in branches and path not in dotted:
        siblings = [name[len(owner) + 1 :] for name in dotted if name.startswith(f"{owner}.")]
        yield _unknown(node, part, owner, (name.partition(".")[0] for name in siblings))


def free_names(tree: ast.Module) -> frozenset[str]:
    """Return the names that a program reads and binds nowhere."""
    read = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    return frozenset(read.difference(_bound(tree)))


def _prefixes(name: str) -> Iterator[str]:
    parts = name.split(".")
    return (".".join(parts[:count]) for count in range(1, len(parts)))


def _chain(node: ast.expr) -> list[str] | None:
    """Return ``a.b.c`` as ["a", "b", "c"]; None if it doesn't start with a name."""
    parts: list[str] = []
    while isinstance(node, ast.Attribute):
        parts.append(node.attr)
        node = node.value
    if not isinstance(node, ast.Name):
        return None
    return [node.id, *reversed(parts)]


def _bound(tree: ast.Module) -> Iterator[str]:
    """Yield every identifier that the program binds, regardless of scopes."""
    for node in ast.walk(tree):
        match node:
            case ast.Name(id=name, ctx=ast.Store() | ast.Del()):
                yield name
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                yield name
            case ast.ExceptHandler(name=str(name)) | ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)):
                yield name
            case ast.MatchMapping(rest=str(name)):
                yield name
            case ast.Global(names=many) | ast.Nonlocal(names=many):
                yield from many
            case ast.Import(names=aliases):
                yield from (alias.asname or alias.name.partition(".")[0] for alias in aliases)
            case ast.ImportFrom(module=module, names=aliases):
                yield from _imported(module, aliases)


def _imported(module: str | None, aliases: Iterable[ast.alias]) -> Iterator[str]:
    """Yield the names that ``from module import …`` binds."""
    for alias in aliases:
        if alias.name == "*":
            yield from _STAR_NAMES.get(module or "", _everything(module))
        else:
            yield alias.asname or alias.name


def _everything(module: str | None) -> frozenset[str]:
    """Return the names that ``from module import *`` binds, for the small modules."""
    return {
        "time": frozenset({"sleep", "time", "monotonic", "localtime", "gmtime", "strftime", "strptime", "mktime"}),
        "random": frozenset({"random", "randint", "choice", "shuffle", "uniform", "sample", "randrange", "seed"}),
        "numbers": frozenset({"Number", "Complex", "Real", "Rational", "Integral"}),
    }.get(module or "", frozenset())


def _unknown(node: ast.Name | ast.Attribute, name: str, owner: str, candidates: Iterable[str]) -> Problem:
    near = nearest(name, candidates)
    hint = f" Did you mean '{near}'?" if near else ""
    hint_zh = f"是不是想写 '{near}'？" if near else ""
    name, owner = name[:WORD_MAX], owner[:WORD_MAX]
    if owner:
        english, chinese = f"'{owner}' has no '{name}'.{hint}", f"'{owner}' 里没有 '{name}'。{hint_zh}"
    elif hasattr(builtins, name):
        english, chinese = f"'{name}' is not available in robot programs.", f"机器人程序里不能使用 '{name}'。"
    else:
        english, chinese = f"The name '{name}' is not known.{hint}", f"不认识名字 '{name}'。{hint_zh}"
    return Problem(node.lineno, node.col_offset + 1, ProblemKind.NAME, english, chinese)
