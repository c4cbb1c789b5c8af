"""Dataclasses whose methods are compiled at their first use. Knows no robot.

``dataclasses`` compiles up to seven methods of every class while it is imported: a third of a start, and most of the
four hundred classes are not used in it. Here a class gets its fields and slots at once; ``__init__`` and its kin are
that library's own, made when they are first looked up. For type checkers it is that library's decorator.
"""

from __future__ import annotations

import dataclasses
import gc
import sys
from collections.abc import Callable
from types import MemberDescriptorType
from typing import TYPE_CHECKING, TypeVar, cast

C = TypeVar("C", bound=type)


class _Factory:
    """Default of a parameter that has a default factory."""

    def __repr__(self) -> str:
        return "<factory>"


FACTORY = _Factory()


class _Later:
    """Descriptor that compiles a method at its first use, and is then replaced by it."""

    __slots__ = ("_frozen", "_name", "_owner")

    def __init__(self, owner: type, name: str, *, frozen: bool) -> None:
        self._owner, self._name, self._frozen = owner, name, frozen

    def __get__(self, instance: object, _class: type | None = None) -> object:
        method = _method(self._owner, self._name, frozen=self._frozen and self._name == "__init__")
        setattr(self._owner, self._name, method)
        return method if instance is None else method.__get__(instance)


if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass

    from _typeshed import DataclassInstance
else:

    def dataclass(
        plain: C | None = None,
        /,
        *,
        frozen: bool = False,
        slots: bool = False,
        eq: bool = True,
        kw_only: bool = False,
        order: bool = False,
    ) -> C | Callable[[C], C]:
        """Act as the library's decorator, but compile methods at their first use."""
        if order:
            return dataclasses.dataclass(plain, frozen=frozen, slots=slots, eq=eq, kw_only=kw_only, order=True)

        def decorate(plain: C) -> C:
            own = {*vars(plain)} - ({"__hash__"} if _is_unhashable_by_eq(plain) else set())
            plain.__doc__ = plain.__doc__ or f"{plain.__name__}()"  # the library's own takes long to word
            made = dataclasses.dataclass(init=False, repr=False, eq=False, slots=slots, kw_only=kw_only)(plain)
            _check(made, frozen=frozen)
            _give_methods(made, own, frozen=frozen, eq=eq)
            if frozen:
                _freeze(made, own, slots=slots)
            return made

        return decorate if plain is None else decorate(plain)


def make_initialisers() -> None:
    """Compile ``__init__`` of all classes now, for processes that are forked from this one."""
    for found in gc.get_objects():
        if type(found) is _Later and found._name == "__init__" and vars(found._owner).get("__init__") is found:
            _Later.__get__(found, None)  # type: ignore[arg-type] # mypy takes it for what it is compared with


def _is_unhashable_by_eq(plain: type) -> bool:
    """Return whether Python took ``__hash__`` away because the class defines ``__eq__``."""
    return "__eq__" in vars(plain) and vars(plain).get("__hash__") is None


def _check(made: type, *, frozen: bool) -> None:
    """Raise TypeError for what the library refuses, and for what is not supported here."""
    for field in vars(made)["__dataclass_fields__"].values():
        if field._field_type is vars(dataclasses)["_FIELD_INITVAR"]:  # fields() leaves these out
            raise TypeError(f"{made.__name__}.{field.name} is an InitVar: use the library's dataclass")
    for base in made.__mro__[1:-1]:
        if "__dataclass_fields__" in vars(base) and ("__setattr__" in vars(base)) is not frozen:
            raise TypeError(f"{made.__name__} and {base.__name__} are not both frozen")
    default = ""
    for field in dataclasses.fields(made):
        if not field.init or field.kw_only:
            continue
        if field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING:
            default = field.name
        elif default:
            raise TypeError(f"non-default argument {field.name!r} follows default argument {default!r}")


def _give_methods(made: type, own: set[str], *, frozen: bool, eq: bool) -> None:
    """Add the methods that a class does not define."""
    names = ["__init__", "__repr__"]
    if eq:
        names.append("__eq__")
        if frozen:
            names.append("__hash__")
        elif "__hash__" not in own:
            setattr(made, "__hash__", None)  # noqa: B010
    for name in names:
        if name not in own:
            setattr(made, name, _Later(made, name, frozen=frozen))


def _freeze(made: type, own: set[str], *, slots: bool) -> None:
    """Refuse assignments to the fields of a class."""
    if own & {"__setattr__", "__delattr__"}:
        raise TypeError(f"{made.__name__} is frozen and has assignments of its own")
    names = frozenset(field.name for field in dataclasses.fields(made))

    def set_attribute(self: object, name: str, value: object) -> None:
        if type(self) is made or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        object.__setattr__(self, name, value)

    def delete_attribute(self: object, name: str) -> None:
        if type(self) is made or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        object.__delattr__(self, name)

    given: dict[str, Callable[..., object]] = {"__setattr__": set_attribute, "__delattr__": delete_attribute}
    if slots:  # pickle and copy would assign
        given |= {"__getstate__": _state, "__setstate__": _restore}
    for name, method in given.items():
        if name not in own:
            setattr(made, name, method)


def _state(self: DataclassInstance) -> list[object]:
    return [getattr(self, field.name) for field in dataclasses.fields(self)]


def _restore(self: DataclassInstance, state: list[object]) -> None:
    for field, value in zip(dataclasses.fields(self), state, strict=True):
        object.__setattr__(self, field.name, value)


def _method(owner: type, name: str, *, frozen: bool) -> Callable[..., object]:
    """Return a method for the fields of ``owner``: the library's, from a class made for it alone."""
    if name == "__init__":
        method = _initialiser(owner, frozen=frozen)
    else:
        fields = [(field.name, object, _like(field)) for field in dataclasses.fields(owner)]
        alone = dataclasses.make_dataclass(
            owner.__name__,
            fields,
            namespace={"__doc__": owner.__doc__ or name},  # the library would word one, slowly
            init=False,
            repr=name == "__repr__",
            eq=name == "__eq__",
            unsafe_hash=name == "__hash__",
        )
        method = cast("Callable[..., object]", vars(alone)[name])
    method.__qualname__, method.__module__ = f"{owner.__qualname__}.{name}", owner.__module__
    return method


def _like(field: dataclasses.Field[object]) -> object:
    return dataclasses.field(repr=field.repr, hash=field.hash, compare=field.compare, default=None)


def _initialiser(owner: type, *, frozen: bool) -> Callable[..., object]:
    """Return ``__init__``; for frozen classes it sets slots by their descriptors, faster than the library's."""
    known: dict[str, object] = {"_factory": FACTORY, "_set": object.__setattr__}
    in_order: list[str] = []
    by_name: list[str] = []
    lines: list[str] = []
    for field in dataclasses.fields(owner):
        default, value = _default(field, known)
        if field.init:
            (by_name if field.kw_only else in_order).append(field.name + default)
        if value:
            lines.append(_assignment(owner, field.name, value, known) if frozen else f"self.{field.name} = {value}")
    if hasattr(owner, "__post_init__"):
        lines.append("self.__post_init__()")
    parameters = ", ".join(["self", *in_order, *(["*", *by_name] if by_name else [])])
    # A closure in the class's module: annotations are looked up there.
    text = "\n  ".join([f"def create({', '.join(known)}):\n def __init__({parameters}):", *(lines or ["pass"])])
    found: dict[str, Callable[..., Callable[..., object]]] = {}
    exec(f"{text}\n return __init__", vars(sys.modules[owner.__module__]), found)
    method = found["create"](**known)
    method.__annotations__ = {field.name: field.type for field in dataclasses.fields(owner) if field.init}
    method.__annotations__["return"] = None
    return method


def _default(field: dataclasses.Field[object], known: dict[str, object]) -> tuple[str, str]:
    """Return a field's default in the parameters, and the expression for its value; "" for none.

    Names that they use are added to ``known``.
    """
    name = field.name
    if field.default_factory is not dataclasses.MISSING:
        known[f"_make_{name}"] = field.default_factory
        made = f"_make_{name}()"
        return "=_factory", f"{made} if {name} is _factory else {name}" if field.init else made
    if field.default is not dataclasses.MISSING:
        known[f"_default_{name}"] = field.default
        return f"=_default_{name}", name if field.init else f"_default_{name}"
    return "", name if field.init else ""


def _assignment(owner: type, name: str, value: str, known: dict[str, object]) -> str:
    """Return the statement that sets a field of a frozen class; a descriptor that it uses is added to ``known``."""
    slot = getattr(owner, name, None)
    if isinstance(slot, MemberDescriptorType):
        known[f"_set_{name}"] = slot.__set__
        return f"_set_{name}(self, {value})"
    return f"_set(self, {name!r}, {value})"
