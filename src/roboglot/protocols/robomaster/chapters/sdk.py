"""SDK mode: entering, leaving, and the version (manual 3.2.1; ``version`` is in no manual but in every sample)."""

from __future__ import annotations

from roboglot.model.components.sensing.camera import Camera
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.table import TABLE
from roboglot.wire.robomaster.replies import Reply

OUTSIDE_SDK_MODE = frozenset({"command", "quit", "version", "version ?"})  # all that is understood before `command`


@TABLE.on("command", right=Right.SEE)
def command(context: Context) -> Reply | None:
    """Enter SDK mode (3.2.1.1)."""
    if context.active:
        return Reply.ALREADY_IN_SDK_MODE
    context.begin()
    if Camera in context.robot:
        context.robot[Camera].prepare()  # clients expect the first picture within a second of `stream on`
    return None


@TABLE.on("quit", right=Right.DRIVE)
async def quit_(context: Context) -> Reply | None:
    """Leave SDK mode, stop and reset everything; answers once the robot stands (3.2.1.2)."""
    if not context.active:
        return Reply.QUIT_FAILED
    for action in context.end("quit"):
        await action.done()
    return None


@TABLE.on("version", "version ?", right=Right.SEE)
def version(context: Context) -> str:
    """Return the version of the text SDK: ``version 00.00.00.70``."""
    return f"version {context.profile.version}"
