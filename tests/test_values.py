"""A dataclass of ``roboglot.values`` does what the library's does; its methods are compiled at their first use."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
import threading
from collections.abc import Callable
from typing import Any, ClassVar, cast, get_type_hints

import msgspec
import pytest

from roboglot import values

BOTH = pytest.mark.parametrize("dataclass", [values.dataclass, dataclasses.dataclass], ids=["ours", "library"])


@values.dataclass(frozen=True, slots=True)
class Point:
    """Kept in a file by pickle."""

    x: float
    y: float = 0.0


def made(dataclass: Callable[..., Any], **options: bool) -> Any:
    """Return a class with every kind of field."""

    @dataclass(slots=True, **options)
    class Base:
        name: str
        count: int = 2

    @dataclass(slots=True, **options)
    class Thing(Base):
        words: list[str] = dataclasses.field(default_factory=list)
        late: float = dataclasses.field(init=False, default=1.5)
        hidden: str = dataclasses.field(default="", repr=False, compare=False)

        def __post_init__(self) -> None:
            object.__setattr__(self, "late", self.count / 2)

    return Thing


@BOTH
@pytest.mark.parametrize("options", [{}, {"frozen": True}, {"kw_only": True}, {"eq": False}], ids=str)
def test_class_behaves_as_the_library_s(dataclass: Callable[..., Any], options: dict[str, bool]) -> None:
    thing = made(dataclass, **options)
    signature = "(name: 'str', count: 'int' = 2, words: 'list[str]' = <factory>, hidden: 'str' = '') -> None"
    if options.get("kw_only"):
        signature = signature.replace("(name", "(*, name")
    assert str(inspect.signature(thing)) == signature
    one, other = thing(name="a", count=5), thing(name="a", count=5, hidden="x")
    assert one.late == 2.5
    assert repr(one).endswith(".Thing(name='a', count=5, words=[], late=2.5)")
    assert one.words is not other.words
    assert (one == other) is options.get("eq", True)
    assert one != "a"
    assert dataclasses.asdict(dataclasses.replace(one, count=7))["late"] == 3.5
    assert dataclasses.asdict(one) == {"name": "a", "count": 5, "words": [], "late": 2.5, "hidden": ""}
    assert thing.__slots__ == ("words", "late", "hidden")
    with pytest.raises(TypeError, match=r"missing 1 required"):
        thing()
    with pytest.raises(TypeError, match=r"unexpected keyword argument 'colour'"):
        thing(name="a", colour="red")


@BOTH
def test_frozen_values_are_refused_changes_and_hashable(dataclass: Callable[..., Any]) -> None:
    @dataclass(frozen=True, slots=True)
    class Pair:
        left: int
        right: int = 1

    pair: Any = Pair(4)
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'left'"):
        pair.left = 5
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot delete field 'left'"):
        del pair.left
    assert {pair: 1}[Pair(4, 1)] == 1
    assert hash(pair) == hash((4, 1))
    match pair:
        case Pair(left, right):
            assert (left, right) == (4, 1)
    assert msgspec.json.decode(msgspec.json.encode(pair), type=Pair) == pair


@BOTH
def test_values_that_change_have_no_hash(dataclass: Callable[..., Any]) -> None:
    @dataclass(slots=True)
    class Count:
        number: int

    @dataclass(slots=True, eq=False)
    class Seat:
        number: int

    with pytest.raises(TypeError, match="unhashable"):
        hash(Count(1))
    seat = Seat(1)
    assert {seat: 2}[seat] == 2
    assert seat != Seat(1)


@BOTH
def test_methods_of_the_class_remain_its_own(dataclass: Callable[..., Any]) -> None:
    @dataclass(frozen=True, slots=True)
    class Word:
        text: str

        def __eq__(self, other: object) -> bool:
            return isinstance(other, Word) and self.text.lower() == other.text.lower()

        def __hash__(self) -> int:
            return hash(self.text.lower())

        def __repr__(self) -> str:
            return f"<{self.text}>"

    assert len({Word("Ja"), Word("ja")}) == 1
    assert repr(Word("ja")) == "<ja>"


def test_values_are_copied_and_pickled() -> None:
    point = Point(1.0, 2.0)
    assert copy.copy(point) == copy.deepcopy(point) == pickle.loads(pickle.dumps(point)) == point


def test_nothing_is_compiled_before_it_is_used() -> None:
    @values.dataclass(frozen=True, slots=True)
    class Unused:
        number: int

    assert isinstance(vars(Unused)["__init__"], values._Later)
    assert Unused(3) == Unused(3)
    assert inspect.isfunction(vars(Unused)["__init__"])
    assert inspect.isfunction(vars(Unused)["__eq__"])
    assert isinstance(vars(Unused)["__repr__"], values._Later)
    assert inspect.signature(Unused.__init__).parameters.keys() == {"self", "number"}


@BOTH
def test_invalid_dataclasses_are_refused_as_by_the_library(dataclass: Callable[..., Any]) -> None:
    @dataclass(frozen=True)
    class Fixed:
        x: int = 1

    @dataclass
    class Open:
        x: int = 1

    with pytest.raises(TypeError, match="frozen"):
        dataclass(type("Opened", (Fixed,), {}))
    with pytest.raises(TypeError, match="frozen"):
        dataclass(frozen=True)(type("Closed", (Open,), {}))
    with pytest.raises(TypeError, match="non-default argument 'y' follows default argument"):
        dataclass(type("Late", (Open,), {"__annotations__": {"y": "int"}}))
    with pytest.raises(ValueError, match="mutable default"):
        dataclass(type("Shared", (), {"__annotations__": {"y": "list[int]"}, "y": []}))


def test_initialisation_only_variables_are_refused() -> None:
    """They would be left out silently: the library's decorator is for them."""
    with pytest.raises(TypeError, match=r"Begun\.x is an InitVar"):
        values.dataclass(type("Begun", (), {"__annotations__": {"x": dataclasses.InitVar[int]}}))


@BOTH
def test_annotations_class_variables_and_subclasses(dataclass: Callable[..., Any]) -> None:
    @dataclass(frozen=True, slots=True)
    class Base:
        number: int
        shared: ClassVar[int] = 7
        _: dataclasses.KW_ONLY
        word: str = "a"

    class Plain(Base):
        """Has no fields of its own, and a ``__dict__``."""

        def __init__(self) -> None:
            super().__init__(3, word="b")

    plain: Any = Plain()
    assert get_type_hints(Base.__init__) == {"number": int, "word": str, "return": type(None)}
    assert Base.__match_args__ == ("number",)
    assert (plain.number, plain.word, Base.shared) == (3, "b", 7)
    assert repr(plain).endswith("Plain(number=3, word='b')")
    assert plain != Base(3, word="b")
    with pytest.raises(dataclasses.FrozenInstanceError):
        plain.number = 4
    with pytest.raises(TypeError, match=r"Base\.__init__\(\) missing 1 required positional argument: 'number'"):
        cast("Any", Base)()
    assert str(inspect.signature(Base, eval_str=True)) == "(number: int, *, word: str = 'a') -> None"


def test_threads_may_use_a_class_first() -> None:
    for _ in range(20):
        made: list[object] = []

        @values.dataclass(frozen=True, slots=True)
        class Shared:
            number: int

        start = threading.Barrier(4)

        def work(kind: Any = Shared, start: threading.Barrier = start, made: list[object] = made) -> None:
            start.wait()
            made.append((hash(kind(1)), repr(kind(1)), kind(1) == kind(1)))

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert len(made) == 4
        assert len(set(made)) == 1


def test_no_signature_is_worded_for_a_class(monkeypatch: pytest.MonkeyPatch) -> None:
    """The library words one for a class without a docstring, which takes as long as all else."""
    monkeypatch.delattr(inspect, "signature")  # the library then fails

    @values.dataclass(frozen=True)
    class Plain:
        """A class like most of ours."""

        x: int

    @values.dataclass(slots=True)
    class Bare:
        x: int

    assert repr(Plain(1)) == f"{Plain.__qualname__}(x=1)"
    assert {Plain(1)} == {Plain(1)}
    assert (Plain.__doc__, Bare.__doc__) == ("A class like most of ours.", "Bare()")


def test_initialisers_can_be_made_ahead() -> None:
    @values.dataclass(frozen=True, slots=True)
    class Early:
        x: int

    values.make_initialisers()
    assert inspect.isfunction(vars(Early)["__init__"])
    assert not inspect.isfunction(vars(Early)["__repr__"])
    assert Early(1) == Early(1)
