"""Functions that programs can call: one file per group of the manual's ability set (chapter 4.4).

Knows robots, no process.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from roboglot.programs.worker.prelude import Prelude


@cache
def ability_set() -> Prelude:
    """Return the prelude of every run; the functions are loaded at the first call, not while doors wait to open."""
    from roboglot.programs.functions import prelude

    return prelude.ability_set()
