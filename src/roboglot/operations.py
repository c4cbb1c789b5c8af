"""A table from wire names to typed handlers, shared by every protocol that calls operations by name.

The handler's signature is the schema: ``async def move(session, *, x: Metres = 0, ...)``. The door passes its first
parameter (a robot, a session); the others are read by name from the wire, converted (``"0.5"`` becomes a float) and
checked against their annotations. Knows no robot, no socket and no vendor.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Hashable, Iterator, Mapping
from enum import StrEnum
from functools import cached_property
from types import CoroutineType
from typing import Any, Generic, Literal, TypeVar

import msgspec

from roboglot.confirmation import Confirmation
from roboglot.validation import KINDS, why_invalid
from roboglot.values import dataclass

K = TypeVar("K", bound=Hashable)
Handler = TypeVar("Handler", bound=Callable[..., object])
Rename = Literal["camel"]
_ZEROS = re.compile(r"(?<=^-)0+(?=\d)|^0+(?=\d)")  # of the first number, which JSON would not allow


class Right(StrEnum):
    """Right of a client on a robot; each operation needs one of them.

    SEE: read values, listen, watch. DRIVE: move it, let it act and speak. PROGRAM: store and run programs. EDIT: change
    maps, places and settings. ADMIN: power, network, firmware, people.
    """

    SEE = "see"
    DRIVE = "drive"
    PROGRAM = "program"
    EDIT = "edit"
    ADMIN = "admin"


class BadParameters(ValueError):
    """The parameters do not fit the handler's signature; the message names the parameter and the expected value."""


class Schema:
    """Schema of a handler, from its signature; read at the first use, as most operations are never called."""

    def __init__(self, handler: Callable[..., object], *, exact: bool = False, rename: Rename | None = None) -> None:
        self._handler, self._exact, self._rename = handler, exact, rename

    @cached_property
    def signature(self) -> inspect.Signature:
        """The signature, with types for annotations."""
        return inspect.signature(self._handler, eval_str=True)

    @cached_property
    def parameters(self) -> type[msgspec.Struct]:
        """Struct of the parameters after the first."""
        return _parameters_of(self._handler.__qualname__, self.signature, self._exact, self._rename)

    def without_zeros(self, values: Mapping[str, object]) -> Mapping[str, object]:
        """Return ``values`` without the zeros before a number ("000", "-07"), which JSON does not allow."""
        found = msgspec.inspect.type_info(self.parameters)
        fields = found.fields if isinstance(found, msgspec.inspect.StructType) else ()
        numbers = {field.encode_name for field in fields if _is_number(field.type)}
        return {
            name: _ZEROS.sub("", value) if isinstance(value, str) and name in numbers else value
            for name, value in values.items()
        }


@dataclass(frozen=True, slots=True)
class Operation(Generic[K]):
    """One handler under its wire name: a coroutine function if it may wait, else a plain one.

    ``partial``: the missing part in plain words; empty if the operation is complete. The coverage page counts only
    complete ones. ``right``: the right that a client needs; None, which a test refuses, means ADMIN. ``needs``:
    components of the robot without which the handler refuses; ``some``: those that only some values of its parameters
    need.
    """

    key: K
    handler: Callable[..., Any]
    schema: Schema
    partial: str
    right: Right | None
    needs: frozenset[type]
    some: frozenset[type] = frozenset()

    @property
    def parameters(self) -> type[msgspec.Struct]:
        """Struct of the handler's parameters after the first."""
        return self.schema.parameters

    @property
    def answer(self) -> object:
        """The handler's return type."""
        return self.schema.signature.return_annotation

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters' names, in the order of the signature."""
        return self.parameters.__struct_fields__

    def requires(self, name: str) -> bool:
        """Return True if the parameter has no default."""
        return any(field.name == name and field.required for field in msgspec.structs.fields(self.parameters))

    @property
    def summary(self) -> str:
        """The first line of the handler's docstring."""
        return (self.handler.__doc__ or "").strip().partition("\n")[0]

    def parse(
        self, values: Mapping[str, object], kinds: Mapping[str, str] = KINDS, *, strict: bool = False
    ) -> dict[str, object]:
        """Convert and check wire values by name; zeros before a number are ignored, and unknown names if not ``exact``.

        ``strict``: only whole numbers become other values (floats). Raises BadParameters, in the words of ``kinds``.
        """
        try:
            checked = msgspec.convert(dict(values), self.parameters, strict=strict)
        except msgspec.ValidationError as error:
            if not strict and (plain := self.schema.without_zeros(values)) != values:
                return self.parse(plain, kinds)
            raise BadParameters(why_invalid(error, kinds=kinds, wanted=self.parameters)) from None
        return {name: getattr(checked, name) for name in self.names}

    async def call(self, context: object, values: Mapping[str, object]) -> Any:
        """Parse ``values`` and run the handler with ``context`` first."""
        return await self.run(context, self.parse(values) if values or self.parameters.__struct_fields__ else {})

    async def run(self, context: object, values: Mapping[str, object]) -> object:
        """Run the handler with parsed values; return its answer once a real robot has confirmed what it sent.

        Raises the RobotError of a command that the robot refuses.
        """
        with Confirmation() as confirmation:
            answer = self.handler(context, **values)
            if isinstance(answer, CoroutineType):
                answer = await answer
        await confirmation.wait()
        return answer


class OperationTable(Generic[K]):
    """All operations of one protocol; a name declared twice fails at import.

    ``exact``: unknown parameters are refused, not ignored. ``rename``: the form of the parameters' names on the wire.
    """

    def __init__(
        self, name: str, right: Right | None = None, *, exact: bool = False, rename: Rename | None = None
    ) -> None:
        self.name, self._exact, self._rename = name, exact, rename
        self._right = right  # for all operations that declare none
        self._operations: dict[K, Operation[K]] = {}

    def on(
        self,
        *keys: K,
        right: Right | None = None,
        needs: tuple[type, ...] = (),
        some: tuple[type, ...] = (),
        partial: str = "",
    ) -> Callable[[Handler], Handler]:
        """Register a handler under ``keys``, for clients with ``right`` and robots with ``needs``: see Operation."""

        def register(handler: Handler) -> Handler:
            _refuse_untyped(handler)
            schema = Schema(handler, exact=self._exact, rename=self._rename)
            for key in keys:
                if key in self._operations:
                    raise ValueError(f"{self.name}: {key!r} is declared twice")
                parts = frozenset(needs), frozenset(some)
                self._operations[key] = Operation(key, handler, schema, partial, right or self._right, *parts)
            return handler

        return register

    def implemented(self) -> set[K]:
        """Return the keys of complete operations."""
        return {operation.key for operation in self if not operation.partial}

    def partly(self) -> dict[K, str]:
        """Return the keys of partial operations, each with its missing part."""
        return {operation.key: operation.partial for operation in self if operation.partial}

    def get(self, key: K) -> Operation[K] | None:
        """Return the operation under ``key``, or None."""
        return self._operations.get(key)

    def __getitem__(self, key: K) -> Operation[K]:
        return self._operations[key]

    def __contains__(self, key: K) -> bool:
        return key in self._operations

    def __iter__(self) -> Iterator[Operation[K]]:
        return iter(self._operations.values())

    def __len__(self) -> int:
        return len(self._operations)


def _is_number(kind: msgspec.inspect.Type) -> bool:
    if isinstance(kind, msgspec.inspect.UnionType):
        return all(map(_is_number, kind.types))
    return isinstance(kind, msgspec.inspect.IntType | msgspec.inspect.FloatType | msgspec.inspect.NoneType)


def _refuse_untyped(handler: Callable[..., object]) -> None:
    """Raise TypeError for a parameter after the first without a type; a look at the code takes no signature."""
    code = getattr(inspect.unwrap(handler), "__code__", None)
    if code is None:
        return
    for name in code.co_varnames[1 : code.co_argcount + code.co_kwonlyargcount]:
        if name not in handler.__annotations__:
            raise TypeError(f"{handler.__qualname__}: parameter {name} has no type")


def _parameters_of(name: str, signature: inspect.Signature, exact: bool, rename: Rename | None) -> type[msgspec.Struct]:
    """Return a struct type with a handler's parameters after the first."""
    _, *parameters = signature.parameters.values()
    fields: list[tuple[str, object] | tuple[str, object, object]] = []
    for parameter in parameters:
        field = (parameter.name, parameter.annotation)
        fields.append(field if parameter.default is parameter.empty else (*field, parameter.default))
    return msgspec.defstruct(name, fields, kw_only=True, forbid_unknown_fields=exact, rename=rename)
