"""Syntax of the robot language: an allow-list over Python's syntax tree.

Anything not listed is refused, including constructs of future Pythons. The list gives clear messages and a second
layer of defence; a program that gets past it is still in the worker's jail.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from roboglot.programs.language.names import MODULES, words
from roboglot.programs.language.problems import Problem, ProblemKind
from roboglot.spelling import WORD_MAX

_ALLOWED: tuple[type[ast.AST], ...] = (
    ast.Module, ast.expr_context, ast.operator, ast.unaryop, ast.boolop, ast.cmpop,
    ast.FunctionDef, ast.ClassDef, ast.Return, ast.Delete, ast.Assign, ast.AugAssign, ast.AnnAssign, ast.For,
    ast.While, ast.If, ast.With, ast.Raise, ast.Try, ast.Assert, ast.Import, ast.ImportFrom, ast.Global, ast.Nonlocal,
    ast.Expr, ast.Pass, ast.Break, ast.Continue, ast.Match, ast.match_case, ast.MatchValue, ast.MatchSingleton,
    ast.MatchSequence, ast.MatchMapping, ast.MatchStar, ast.MatchAs, ast.MatchOr, ast.MatchClass,
    ast.BoolOp, ast.NamedExpr, ast.BinOp, ast.UnaryOp, ast.Lambda, ast.IfExp, ast.Dict, ast.Set, ast.ListComp,
    ast.SetComp, ast.DictComp, ast.GeneratorExp, ast.Yield, ast.YieldFrom, ast.Compare, ast.Call, ast.FormattedValue,
    ast.JoinedStr, ast.Constant, ast.Attribute, ast.Subscript, ast.Starred, ast.Name, ast.List, ast.Tuple, ast.Slice,
    ast.comprehension, ast.ExceptHandler, ast.arguments, ast.arg, ast.keyword, ast.alias, ast.withitem,
)  # fmt: skip

_FORBIDDEN: dict[str, tuple[str, str]] = {
    **dict.fromkeys(
        ("AsyncFunctionDef", "AsyncFor", "AsyncWith", "Await"),
        ("'async' and 'await' are not part of the robot language.", "机器人语言不支持 'async' 和 'await'。"),
    ),
    "TryStar": ("'except*' is not part of the robot language.", "机器人语言不支持 'except*'。"),
    "TypeAlias": ("'type' statements are not part of the robot language.", "机器人语言不支持 'type' 语句。"),
}

# Methods that a class may define, and the few of them that may be called by name.
_METHODS = words("""
__init__ __repr__ __str__ __len__ __iter__ __next__ __contains__ __getitem__ __setitem__ __delitem__ __call__ __bool__
__hash__ __eq__ __ne__ __lt__ __le__ __gt__ __ge__ __add__ __radd__ __iadd__ __sub__ __rsub__ __isub__ __mul__
__rmul__ __imul__ __truediv__ __rtruediv__ __itruediv__ __floordiv__ __rfloordiv__ __mod__ __rmod__ __pow__ __rpow__
__neg__ __pos__ __abs__ __invert__ __and__ __or__ __xor__ __lshift__ __rshift__ __enter__ __exit__ __format__ __int__
__float__ __index__ __round__ __reversed__
""")
_READABLE = frozenset({"__init__", "__name__", "__enter__", "__exit__", "__len__", "__str__", "__repr__", "__eq__"})

# Attributes that lead from a value to its frames and code, and text formatting, which reaches attributes.
_BLOCKED = words("""
ag_await ag_code ag_frame co_code co_consts cr_await cr_code cr_frame gi_code gi_frame gi_yieldfrom tb_frame tb_next
f_back f_builtins f_code f_generator f_globals f_lasti f_lineno f_locals f_trace format_map mro with_traceback
""")

# Class patterns read attributes named by the class (__match_args__): allowed only for types whose list is known and
# empty.
_PATTERN_TYPES = words("bool bytearray bytes dict float frozenset int list set str tuple")

# Fields of nodes that hold identifiers as plain text.
_IDENTIFIERS: dict[type[ast.AST], tuple[str, ...]] = {
    ast.Name: ("id",),
    ast.arg: ("arg",),
    ast.keyword: ("arg",),
    ast.alias: ("name", "asname"),
    ast.ClassDef: ("name",),
    ast.ExceptHandler: ("name",),
    ast.Global: ("names",),
    ast.Nonlocal: ("names",),
    ast.MatchAs: ("name",),
    ast.MatchStar: ("name",),
    ast.MatchMapping: ("rest",),
}


def attribute_allowed(name: str) -> bool:
    """Return whether ``object.name`` may be read; also used by ``getattr`` in running programs."""
    if name.startswith("__") and name.endswith("__"):
        return name in _READABLE
    return name not in _BLOCKED


def violations(tree: ast.Module) -> Iterator[Problem]:
    """Yield a problem for each construct outside the language."""
    for node in ast.walk(tree):
        if not isinstance(node, _ALLOWED):
            yield _construct(node)
            continue
        for name in _identifiers(node):
            if _reserved(name) and not (name == "__name__" and isinstance(getattr(node, "ctx", None), ast.Load)):
                name = name[:WORD_MAX]
                yield _problem(node, f"Names like '{name}' are reserved.", f"'{name}' 这样的名字是保留的。")
        yield from _special(node)


def _special(node: ast.AST) -> Iterator[Problem]:
    match node:
        case ast.Attribute(attr=name) if not attribute_allowed(name) or (
            name in _READABLE and not isinstance(node.ctx, ast.Load)
        ):
            name = name[:WORD_MAX]
            yield _problem(node, f"'.{name}' cannot be used in robot programs.", f"机器人程序不能使用 '.{name}'。")
        case ast.FunctionDef(name=name) if _reserved(name) and name not in _METHODS:
            name = name[:WORD_MAX]
            yield _problem(node, f"A method '{name}' cannot be defined here.", f"不能定义方法 '{name}'。")
        case ast.ClassDef(keywords=[_, *_]):
            yield _problem(
                node, "A class takes base classes only, no keywords.", "类定义只能写基类，不能写关键字参数。"
            )
        case ast.Import(names=aliases):
            yield from (_import(node, alias.name) for alias in aliases if alias.name not in MODULES)
        case ast.ImportFrom(module=module, level=level) if level or module not in MODULES:
            yield _import(node, "." * level + (module or ""))
        case ast.MatchClass(cls=cls, kwd_attrs=keywords):
            if keywords or not (isinstance(cls, ast.Name) and cls.id in _PATTERN_TYPES):
                yield _problem(
                    node,
                    "'case' can test plain types such as int or str only.",
                    "'case' 只能匹配 int、str 等基本类型。",
                )


def _construct(node: ast.AST) -> Problem:
    word = type(node).__name__
    default = (f"'{word}' is not part of the robot language.", f"机器人语言不支持 '{word}'。")
    return _problem(node, *_FORBIDDEN.get(word, default))


def _import(node: ast.AST, module: str) -> Problem:
    allowed = ", ".join(sorted(MODULES))
    return _problem(
        node,
        f"'{module[:WORD_MAX]}' cannot be imported in robot programs; these can: {allowed}.",
        f"机器人程序不能导入 '{module[:WORD_MAX]}'；可以导入：{allowed}。",
    )


def _reserved(name: str) -> bool:
    return name.startswith("__") and name.endswith("__")


def _identifiers(node: ast.AST) -> Iterator[str]:
    for field in _IDENTIFIERS.get(type(node), ()):
        value = getattr(node, field)
        if isinstance(value, list):
            yield from value
        elif value is not None:
            yield value


def _problem(node: ast.AST, english: str, chinese: str) -> Problem:
    line, column = getattr(node, "lineno", 1), getattr(node, "col_offset", 0) + 1
    return Problem(line, column, ProblemKind.POLICY, english, chinese)
