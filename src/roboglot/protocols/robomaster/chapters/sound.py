"""The sound chapter (manual 3.2.7)."""

from __future__ import annotations

from roboglot.model.components.sensing.hearing import Hearing
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.event_switches import EventSwitches
from roboglot.protocols.robomaster.ranges import OnOff
from roboglot.protocols.robomaster.switching import switch_or_undo
from roboglot.protocols.robomaster.table import TABLE


@TABLE.on("sound event", right=Right.SEE, needs=(Hearing,))
async def switch_events(context: Context, *, applause: OnOff) -> None:
    """Switch reports of applause on the event port (3.2.7.1)."""
    switches = context.part(EventSwitches)
    await switch_or_undo(lambda: switches.applause(applause == "on"), lambda: switches.applause(False))
