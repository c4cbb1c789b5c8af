"""The blaster chapter (manual 3.2.5)."""

from __future__ import annotations

from roboglot.model.components.interaction.blaster import Blaster
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.ranges import Beads
from roboglot.protocols.robomaster.table import TABLE


@TABLE.on("blaster bead", right=Right.DRIVE, needs=(Blaster,))
def set_beads(context: Context, num: Beads) -> None:
    """Set the number of beads that a shot fires (3.2.5.1); 1 again when the session ends."""
    blaster = context.robot[Blaster]
    blaster.set_beads(num)
    context.at_end("blaster bead", lambda: blaster.set_beads(1))


@TABLE.on("blaster bead ?", right=Right.SEE, needs=(Blaster,))
def get_beads(context: Context) -> tuple[int, ...]:
    """Return the number of beads that a shot fires (3.2.5.3)."""
    return (context.robot[Blaster].beads,)


@TABLE.on("blaster fire", right=Right.DRIVE, needs=(Blaster,))
def fire(context: Context) -> None:
    """Fire a shot, bead by bead; `fail` with an empty magazine or during a shot (3.2.5.2)."""
    blaster = context.robot[Blaster]
    blaster.fire()
    context.at_end("blaster fire", blaster.cease)
