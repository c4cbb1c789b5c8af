"""Blocks at which a run halts: those with a breakpoint, the next one, and the next one after a step.

The worker does steps over and out of calls: it knows the call stack, but halts before statements only. This module
skips its halts until the beginning of a block.
"""

from __future__ import annotations

from roboglot.programs.engine.events import Stops
from roboglot.programs.engine.position import Position
from roboglot.programs.functions.table import SPELLINGS
from roboglot.programs.language.places import Step

MARKS = {"cyberdog.task.block", "cyberdog.task.breakpoint_block"}
MARKS |= {spelling for spelling, name in SPELLINGS.items() if name in MARKS}


class BlockStops:
    """Stops at blocks of one run."""

    __slots__ = ("_blocks", "_next", "_position", "_seeking")

    def __init__(self, position: Position, stops: Stops | None) -> None:
        self._position = position
        self._seeking = False
        self.set(stops or Stops())

    def set(self, stops: Stops) -> None:
        """Halt at these blocks and at no others."""
        self._blocks, self._next = stops.blocks, stops.first_block

    def step(self, step: Step) -> None:
        """Halt at the beginning of the first block after a step."""
        self._next = step is Step.INTO
        self._seeking = step is not Step.INTO
        if self._seeking:
            self._position.step(step)

    def passes(self) -> bool:
        """Return whether to skip a halt before a statement, because the step goes to a block."""
        if not self._seeking or self._position.at_stop:
            self._seeking = False
            return False
        if any(f"{mark}(" in self._position.source_line for mark in MARKS):
            self._seeking, self._next = False, True
        else:
            self._position.step(Step.OVER)
        return True

    def halts(self, block: str) -> bool:
        """Return whether to halt at the beginning of this block."""
        if not self._next and block not in self._blocks:
            return False
        self._next = False
        if self._seeking:
            self._seeking = False
            self._position.clear_step()
        return True
