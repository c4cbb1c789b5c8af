"""Names and types of the ability set, available to programs in addition to the language.

All names of the manual are included, so that programs with functions that are not built yet can be saved; calling them
raises NotImplementedError.
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
    """Return the prelude of every run."""
    names = {row.key for row in contract("visual")} | set(SPELLINGS)
    attributes = {name for name in names if name.endswith(ATTRIBUTES)}
    return Prelude(frozenset(names - attributes), frozenset(attributes), RECORDS, ENUMS)


def implemented() -> set[str]:
    """Return the manual's names that work fully, for the coverage page."""
    return ABILITIES.implemented()


def partly() -> dict[str, str]:
    """Return the manual's names that work in part, with their missing features."""
    return ABILITIES.partly()
