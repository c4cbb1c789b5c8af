"""The armor chapter (manual 3.2.6)."""

from __future__ import annotations

from roboglot.model.components.interaction.armor import Armor
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.event_switches import EventSwitches
from roboglot.protocols.robomaster.ranges import OnOff, Sensitivity
from roboglot.protocols.robomaster.table import TABLE

SENSITIVITY = 5  # the default, restored when the session ends


@TABLE.on("armor sensitivity", right=Right.DRIVE, needs=(Armor,))
def set_sensitivity(context: Context, value: Sensitivity) -> None:
    """Set the sensitivity: 1 hard hits only, 10 every touch (3.2.6.1)."""
    armor = context.robot[Armor]
    armor.set_sensitivity(value)
    context.at_end("armor sensitivity", lambda: armor.set_sensitivity(SENSITIVITY))


@TABLE.on("armor sensitivity ?", right=Right.SEE, needs=(Armor,))
def get_sensitivity(context: Context) -> tuple[int, ...]:
    """Return the sensitivity (3.2.6.2)."""
    return (context.robot[Armor].sensitivity,)


@TABLE.on("armor event", right=Right.SEE, needs=(Armor,))
def switch_events(context: Context, *, hit: OnOff) -> None:
    """Switch reports of hits on the event port (3.2.6.3)."""
    context.part(EventSwitches).armor(hit == "on")
