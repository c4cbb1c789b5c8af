"""Names that the host offers a program: pure data, sent when a run starts.

Knows names and fields only; the host makes the calls.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

from roboglot.programs.language.names import Namespace
from roboglot.programs.worker.values import pack, unpack
from roboglot.values import dataclass

TIME_CALLS = frozenset({"time.sleep", "time.time", "time.monotonic"})
"""Host calls that every program can make: sleep (s), Unix time (s), and seconds since a fixed moment.

All use the robot's clock.
"""


@dataclass(frozen=True, slots=True)
class RecordType:
    """A type of records.

    ``fields``: every field and its default (a value, a list, a dict, or ``Record("Point")`` for another type's
    defaults); defaults are copied for each new record. ``aliases``: other names of fields; the target ``""`` is the
    record itself. ``constructible``: programs may build it by calling its name (all fields optional); other types are
    only returned by calls.
    """

    fields: Mapping[str, object] = field(default_factory=dict)
    aliases: Mapping[str, str] = field(default_factory=dict)
    constructible: bool = False


@dataclass(frozen=True, slots=True)
class Prelude:
    """All names available to a program in addition to the language.

    ``calls``: dotted names of functions (``cyberdog.motion.turn``). ``attributes``: dotted names fetched from the
    host at each read (``cyberdog.motion.state``), by a call without arguments. ``records`` and ``enums``: by name.
    ``utc_offset``: seconds east of UTC for ``time.localtime`` and the like.
    """

    calls: frozenset[str] = frozenset()
    attributes: frozenset[str] = frozenset()
    records: Mapping[str, RecordType] = field(default_factory=dict)
    enums: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    utc_offset: int = 0

    def __post_init__(self) -> None:
        both = self.calls & self.attributes
        if both:
            raise ValueError(f"both a call and an attribute: {', '.join(sorted(both))}")

    def callable_names(self) -> frozenset[str]:
        """Return the names that the program may call."""
        return self.calls | self.attributes | TIME_CALLS

    def names(self, functions: frozenset[str] = frozenset()) -> Namespace:
        """Return the names for the checker; ``functions``: those of the program's modules."""
        members = {f"{enum}.{member}" for enum, values in self.enums.items() for member in values}
        constructible = {name for name, kind in self.records.items() if kind.constructible}
        return Namespace(frozenset(constructible | set(self.enums) | functions), self.calls | self.attributes | members)

    def to_wire(self) -> dict[str, object]:
        """Return the prelude in JSON types, for the worker."""
        return {
            "calls": sorted(self.calls),
            "attributes": sorted(self.attributes),
            "records": {
                name: {"f": pack(kind.fields), "a": dict(kind.aliases), "c": kind.constructible}
                for name, kind in self.records.items()
            },
            "enums": {name: dict(members) for name, members in self.enums.items()},
            "utc_offset": self.utc_offset,
        }

    @classmethod
    def from_wire(cls, wire: Mapping[str, Any]) -> Prelude:
        """Return the prelude of a ``to_wire``, unchecked: the worker trusts its host."""
        return cls(
            calls=frozenset(wire["calls"]),
            attributes=frozenset(wire["attributes"]),
            records={
                name: RecordType(unpack(kind["f"]), kind["a"], kind["c"]) for name, kind in wire["records"].items()
            },
            enums=wire["enums"],
            utc_offset=wire["utc_offset"],
        )
