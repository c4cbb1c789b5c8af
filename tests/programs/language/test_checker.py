"""The checker: what a pupil is shown, and what is let through. In this process, on text that is known."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.programs.language import BUILTINS, Namespace, ProblemKind, check, compile_unit
from roboglot.programs.language.instrument import Marks
from roboglot.programs.language.places import Places
from roboglot.programs.language.policy import attribute_allowed
from roboglot.programs.language.problems import _SYNTAX, from_syntax_error
from roboglot.programs.worker.environment import build_builtins

MARKS = Marks([None], lambda _unit, _line: None)
NAMES = Namespace(
    plain=frozenset({"StateCode", "say"}),
    dotted=frozenset({"cyberdog.motion.turn", "cyberdog.state", "StateCode.fail"}),
)


@pytest.mark.parametrize(
    ("source", "line", "column", "english"),
    [
        ("x = (1,\ny = 2", 1, 5, "never closed"),
        ("print 'a'", 1, 1, "needs parentheses"),
        ("if x\n    pass", 1, 5, "':' is missing"),
        ("if 1:\nx = 1", 2, 1, "must be indented"),
        ("x = 1\n   y = 2", 2, 3, "indented more"),
        ("if 1:\n    x = 1\n  y = 2", 3, 8, "fits no block"),
        ("cyberdog.motion.turn（1）", 1, 21, "full-width"),
        ("x = 'abc", 1, 5, "quote is missing"),
        ("if x = 1: pass", 1, 4, "compare two values"),
        ("return 1", 1, 1, "inside a function"),
        ("break", 1, 1, "inside a loop"),
        ("for 1 in x: pass", 1, 5, "stored in literal"),
        ("a <> b", 1, 3, "not a valid statement"),
        ("if 1:\n    x = 1\nelse if 2:\n    x = 2", 3, None, "writes 'elif' for 'else if'"),
        ("x = 1\nx++", 2, None, "writes '+= 1' for '++'"),
        ("x = 1\nx--", 2, None, "writes '-= 1' for '--'"),
        ("if 1 && 2:\n    x = 1", 1, None, "writes 'and' for '&&'"),
        ("if 1||2:\n    x = 1", 1, None, "writes 'or' for '||'"),
        ("x = '&&' y", 1, None, "not a valid statement"),
        ("def f(a, a): pass", 1, None, "appears twice"),
        ("x = [1 2]", 1, None, "comma"),
        ("2x = 1", 1, 1, "cannot begin with a digit"),
        ("print(f'a } b')", 1, None, "a '}' of the text is written twice"),
        ("print(f'{x!k}')", 1, None, "in the braces of this f-string"),
        ("print(f'{x}", 1, None, "quote is missing"),
        ("x = 1 if 2", 1, None, "needs an 'else'"),
        ("x = {'a': 1, 'b'}", 1, None, "a key, a ':' and a value"),
        ("def f(a=): pass", 1, None, "value is missing after '='"),
        ("def f(a=1, b): pass", 1, None, "come after those without"),
        ("print(a.b=1)", 1, None, "name of an argument"),
    ],
)
def test_syntax_is_explained(source: str, line: int, column: int | None, english: str) -> None:
    (problem,) = check(source, NAMES)
    assert problem.kind is ProblemKind.SYNTAX
    assert problem.line == line
    assert problem.column == column or column is None  # CPython's versions differ
    assert english in problem.english
    assert not problem.chinese.startswith("语法错误")


def test_suggestions_of_python_are_passed_on() -> None:
    """From Python 3.14 on, which recognizes misspelled keywords."""
    problem = from_syntax_error("invalid syntax. Did you mean 'while'?", 1, 1)
    assert problem.english == "This is not a valid statement; perhaps 'while' is meant."
    assert "'while'" in problem.chinese


@pytest.mark.parametrize(
    "source",
    [
        "import os",
        "from os import path",
        "from . import x",
        "import time.x",
        "().__class__",
        "x.__dict__",
        "f.gi_frame",
        "'{}'.format_map({})",
        "__import__('os')",
        "__builtins__",
        "x.__init__ = 1",
        "async def f(): pass",
        "class A(metaclass=type): pass",
        "class A:\n    def __getattr__(self, n): pass",
        "class A:\n    __match_args__ = ('x',)",
        "match x:\n    case Point(x=1): pass",
        "match x:\n    case A(): pass",
        "import time as __builtins__",
        "def f(__class__): pass",
        "f(__class__=1)",
        "global __x__",
        "try: pass\nexcept* ValueError: pass",
    ],
)
def test_code_outside_the_language_is_refused(source: str) -> None:
    problems = check(source)
    assert problems
    assert {problem.kind for problem in problems} == {ProblemKind.POLICY}
    assert isinstance(compile_unit(source, "x", 0, MARKS), list)
    assert (
        not isinstance(compile_unit(source, "x", 0, MARKS, policy=False), list)
        or "global" in source
        or "from ." in source
    )


def test_the_apps_programs_pass() -> None:
    source = """
cyberdog.motion.turn(1, 2);
while True:
    if cyberdog.state.code == StateCode.fail:
        say('好');
    for _ in range(3):
        self_ = {'a': 1}.has_key('a')
"""
    assert check(source, NAMES) == []
    for case in (Path(__file__).parent / "cases").glob("*.py"):
        assert check(case.read_text("utf-8"), NAMES) == [], case


def test_unknown_names_are_found_where_they_stand() -> None:
    problems = check("狗 = cyberdog.motion.trun(1)\nprnt(狗, 猫)\nopen('x')\ncyberdog.motion.turn().anything", NAMES)
    assert [(p.line, p.column, p.kind) for p in problems] == [
        (1, 5, ProblemKind.NAME),
        (2, 1, ProblemKind.NAME),
        (2, 9, ProblemKind.NAME),
        (3, 1, ProblemKind.NAME),
    ]
    assert "Did you mean 'turn'" in problems[0].english
    assert "是不是想写 'print'" in problems[1].chinese
    assert "not available" in problems[3].english
    assert check("cyberdog = 1\ncyberdog.x\nfrom math import *\nprint(floor(pi))", NAMES) == []


def test_too_long_is_refused_before_it_is_parsed() -> None:
    (problem,) = check("x = 1\n" * 20_001)
    assert problem.kind is ProblemKind.SIZE


def test_marks_change_no_meaning() -> None:
    """Instrumented code computes the same and reports its lines; a docstring stays one."""
    source = """def f(n):
    "doc"
    while len(str(n)) < 3:
        n *= 2
    else:
        n += 1
    return n
x = f(5)
"""
    seen: list[tuple[int, int]] = []

    class Tell(list[object]):
        def __setitem__(self, index: object, value: object) -> None:
            assert isinstance(value, tuple)
            seen.append(value)

    code = compile_unit(source, "x", 3, Marks(Tell([None]), lambda unit, line: (unit, line)))
    assert not isinstance(code, list)
    scope: dict[str, object] = {}
    exec(code, scope)
    assert scope["x"] == 161
    assert scope["f"].__doc__ == "doc"
    assert set(seen) == {(3, line) for line in (1, 3, 4, 6, 7, 8)}
    assert seen[-4:] == [(3, 4), (3, 3), (3, 6), (3, 7)]


@given(st.lists(st.text("ab\n\r", max_size=20), max_size=5), st.data())
def test_places_come_back(units: list[str], data: st.DataObject) -> None:
    places = Places(units)
    for unit, text in enumerate(units):
        for line in range(1, len(text.splitlines()) + 1):
            number = places.number(unit, line)
            assert places.place(number) == (unit, line)
            assert 8 * (1 + number) < places.memory()
    unit, line = data.draw(st.integers(-3, 9)), data.draw(st.integers(-3, 99))
    assert places.place(places.number(unit, line)) in {(unit, line), (0, 0)}
    assert places.place(data.draw(st.integers())) is not None


@given(st.text(alphabet="abx=()[]{}:,.'\"\\\n\t 01;#@*%-<>！（，狗\ufeff", max_size=60))
def test_any_text_is_answered(source: str) -> None:
    problems = check(source, NAMES)
    compiled = compile_unit(source, "x", 0, MARKS)
    if not check(source):
        assert not isinstance(compiled, list)
    assert all(
        1 <= problem.line <= source.count("\n") + source.count("\r") + 2 and problem.column >= 1 for problem in problems
    )


def test_the_tables_agree() -> None:
    offered = build_builtins(lambda _text: None, {})
    assert set(BUILTINS) <= set(offered)
    assert all(len(entry) == 3 for entry in _SYNTAX)
    assert not attribute_allowed("__class__")
    assert attribute_allowed("_private")


@pytest.mark.parametrize("source", ["{}", "a.{}()", "cyberdog.{}", "__{}__", "def __{}__(): pass", "import {}"])
def test_only_beginning_of_long_name_is_quoted(source: str) -> None:
    (problem, *_) = check(source.format("x" * 30_000), NAMES)
    assert len(problem.english) < 400
    assert len(problem.chinese) < 400


@pytest.mark.parametrize(
    ("head", "level", "tail"),
    [
        ("x = 1\nx", ".a", ""),
        ("x = 1\nx", "[0]", ""),
        ("x = ", "1 + ", "1"),
        ("x = ", "-", "1"),
        ("x = ", "lambda: ", "0"),
        ("x = ", "1 if 1 else ", "2"),
        ("if 0: pass\n", "elif 1: pass\n", ""),
    ],
)
def test_depth_has_one_limit_everywhere(head: str, level: str, tail: str) -> None:
    """Python 3.14 reads 50,000 levels; what looks at them took 10 s, and checks allowed what runs refused."""
    for levels, deep in ((240, False), (260, True), (6_000, True)):
        source = head + level * levels + tail
        whys = [problem.english for problem in check(source, NAMES)]
        code = compile_unit(source, "<program>", 0, MARKS)
        if isinstance(code, list):
            assert whys == [problem.english for problem in code] == ["The program is nested too deeply."]
        assert (whys != [], isinstance(code, list)) == (deep, deep)
