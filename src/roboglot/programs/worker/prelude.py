"""Names that the host offers a program: pure data, sent when a run starts.

Knows names and shapes only; what a call does is the host's business.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from roboglot.programs.language.names import Names
from roboglot.programs.worker.values import pack, unpack

TIME_CALLS = frozenset({"time.sleep", "time.time", "time.monotonic"})
"""Host calls every program can make.

Sleep(seconds), seconds since 1970, and seconds since any fixed moment, all on the robot's clock.
"""


@dataclass(frozen=True, slots=True)
class RecordType:
    """A type of records.

    ``fields``: every field and its default (a value, a list, a dict, or ``Record("Point")`` for another type's
    defaults); defaults are copied for each new record. ``aliases``: other names of fields; the target ``""`` is the
    record itself. ``constructible``: programs may build it by calling its name (all fields optional); others only
    come out of calls.
    """

    fields: Mapping[str, object] = field(default_factory=dict)
    aliases: Mapping[str, str] = field(default_factory=dict)
    constructible: bool = False


@dataclass(frozen=True, slots=True)
class Prelude:
    """Everything a program finds besides the language.

    ``calls``: dotted names of functions (``cyberdog.motion.turn``). ``attributes``: dotted names fetched from the
    host each time they are read (``cyberdog.motion.state``); the host sees a call without arguments. ``records`` and
    ``enums``: by name. ``utc_offset``: seconds east of UTC for ``time.localtime`` and its like.
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
        """Every name a call of the program may carry."""
        return self.calls | self.attributes | TIME_CALLS

    def names(self, functions: frozenset[str] = frozenset()) -> Names:
        """The names for the checker; ``functions`` are those of the program's modules."""
        members = {f"{enum}.{member}" for enum, values in self.enums.items() for member in values}
        constructible = {name for name, kind in self.records.items() if kind.constructible}
        return Names(frozenset(constructible | set(self.enums) | functions), self.calls | self.attributes | members)

    def to_wire(self) -> dict[str, object]:
        """Return it as JSON, for the worker."""
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
        """The prelude ``to_wire`` wrote; the worker trusts its host."""
        return cls(
            calls=frozenset(wire["calls"]),
            attributes=frozenset(wire["attributes"]),
            records={
                name: RecordType(unpack(kind["f"]), kind["a"], kind["c"]) for name, kind in wire["records"].items()
            },
            enums=wire["enums"],
            utc_offset=wire["utc_offset"],
        )
