"""Functions that programs can call: one file per group of the manual's ability set (chapter 4.4).

Knows robots, no process.
"""

from roboglot.programs.functions.prelude import ability_set, implemented

__all__ = ["ability_set", "implemented"]
