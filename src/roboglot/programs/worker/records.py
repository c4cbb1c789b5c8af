"""Records, vectors and dictionaries of a program.

Knows the records' fields from the prelude, but not their meaning.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping

from roboglot.programs.worker.prelude import RecordType
from roboglot.programs.worker.values import Record


class Vector(list[object]):
    """A list with the vendor's vector operations in addition to Python's own."""

    __slots__ = ()

    def push_back(self, item: object) -> None:
        """Append a copy, as programs fill the same object again and again."""
        self.append(copy.deepcopy(item))

    def pop_back(self) -> None:
        """Drop the last item."""
        self.pop()

    def front(self) -> object:
        """Return the first item."""
        return self[0]

    def back(self) -> object:
        """Return the last item."""
        return self[-1]

    def at(self, index: int) -> object:
        """Return the item at an index. Raises IndexError outside, also below zero."""
        if index < 0:
            raise IndexError("vector index out of range")
        return self[index]

    def size(self) -> int:
        """Return how many items."""
        return len(self)

    def empty(self) -> bool:
        """Return whether there is none."""
        return not self

    def max_size(self) -> int:
        """Return the largest size."""
        return 2**60 - 1

    def capacity(self) -> int:
        """Return the capacity, which is the size here."""
        return len(self)


class Dictionary(dict[object, object]):
    """A dictionary with the vendor's operations besides Python's own."""

    __slots__ = ()

    def size(self) -> int:
        """Return how many entries."""
        return len(self)

    def empty(self) -> bool:
        """Return whether there is none."""
        return not self

    def max_size(self) -> int:
        """Return the largest size."""
        return 2**60 - 1


class ProgramRecord:
    """Base of every record type; a subclass has one slot per field."""

    __slots__: tuple[str, ...] = ()

    def __repr__(self) -> str:
        fields = ", ".join(f"{name}={getattr(self, name)!r}" for name in type(self).__slots__)
        return f"{type(self).__name__}({fields})"

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and all(
            getattr(self, name) == getattr(other, name) for name in type(self).__slots__
        )


class Records:
    """The record types of one run, built on first use."""

    def __init__(self, types: Mapping[str, RecordType]) -> None:
        self._types = types
        self._classes: dict[str, type[ProgramRecord]] = {}

    def class_of(self, name: str) -> type[ProgramRecord]:
        """Return the class of a record type."""
        known = self._classes.get(name)
        if known is None:
            known = self._classes[name] = self._build(name, self._types[name])
        return known

    def join(self, name: str, fields: dict[str, object]) -> object:
        """Return a record from the host; of an undeclared type, a plain dictionary."""
        if name not in self._types:
            return self.enrich(fields)
        return self.class_of(name)(**fields)

    def split(self, value: object) -> tuple[str, Mapping[str, object]] | None:
        """Return type and fields of a record for the host; None for other values."""
        if not isinstance(value, ProgramRecord):
            return None
        return type(value).__name__, {name: getattr(value, name) for name in type(value).__slots__}

    def enrich(self, value: object) -> object:
        """Return lists and dictionaries with the vendor's operations, and host records as the program's."""
        match value:
            case Record(type=name, fields=fields):
                return self.join(name, dict(fields))
            case list():
                return Vector(self.enrich(item) for item in value)
            case dict():
                return Dictionary({key: self.enrich(item) for key, item in value.items()})
        return value

    def _build(self, name: str, kind: RecordType) -> type[ProgramRecord]:
        defaults = kind.fields
        enrich = self.enrich

        def initialise(self: ProgramRecord, **fields: object) -> None:
            for field in defaults:
                given = fields.pop(field, _MISSING)
                # The default is copied each time, so that records share nothing.
                setattr(self, field, enrich(copy.deepcopy(defaults[field])) if given is _MISSING else enrich(given))
            if fields:
                raise TypeError(f"{name} has no field '{next(iter(fields))}'")

        body: dict[str, object] = {"__slots__": tuple(defaults), "__init__": initialise}
        for alias, target in kind.aliases.items():
            body[alias] = property(_reader(target))
        return type(name, (ProgramRecord,), body)


_MISSING = object()


def _reader(target: str) -> Callable[[object], object]:
    return (lambda record: getattr(record, target)) if target else (lambda record: record)
