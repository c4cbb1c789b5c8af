"""Everything that programs find besides the language: the ability set's names and types.

All names of the manual are there, so that a program that uses one not built yet can be saved; calling it raises
NotImplementedError.
"""

from __future__ import annotations

from roboglot.programs.functions import (  # noqa: F401
    audio,
    groups,
    led,
    task,
    time,
)
from roboglot.programs.functions.enums import ENUMS
from roboglot.programs.functions.moving import (  # noqa: F401
    attitudes,
    choreography,
    follow,
    motion,
    navigating,
    performing,
    sequences,
    walking,
)
from roboglot.programs.functions.records import RECORDS
from roboglot.programs.functions.senses import (  # noqa: F401
    bms,
    contact,
    gestures,
    people,
    ranging,
    sensors,
    skeletons,
)
from roboglot.programs.functions.table import ABILITIES, ATTRIBUTES, SPELLINGS
from roboglot.programs.worker.prelude import Prelude
from roboglot.wire.contracts import contract


def ability_set() -> Prelude:
    """The prelude of every run."""
    names = {row.key for row in contract("visual")} | set(SPELLINGS)
    attributes = {name for name in names if name.endswith(ATTRIBUTES)}
    return Prelude(frozenset(names - attributes), frozenset(attributes), RECORDS, ENUMS)


def implemented() -> set[str]:
    """The manual's names that work as a whole, for the coverage page."""
    return ABILITIES.implemented()


def partly() -> dict[str, str]:
    """The manual's names that work in part, with what they cannot do yet."""
    return ABILITIES.partly()
