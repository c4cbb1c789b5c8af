"""Chapter "system": sleep, wake up, shut down, restart."""

from __future__ import annotations

from roboglot.model.components.energy.power import Power
from roboglot.model.components.system.firmware import Firmware, Module
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.motion.errands import SOURCE
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters.system.devices import Restart, RestartMode, Shutdown

API = "/api/core/system/v1/power"


MODULES = {RestartMode.SOFT: Module.SOFTWARE, RestartMode.BASE: Module.BASE}


@TABLE.on(f"POST {API}/:shutdown", right=Right.ADMIN, needs=(Power,))
def shutdown(context: Context, body: Shutdown) -> bool:
    """Switch off, at once or later, and optionally on again. There are no answers while off."""
    restart = body.restart_time_interval * 60.0 or None
    context.robot[Power].shut_down(source=SOURCE, after=body.shutdown_time_interval * 60.0, restart_after=restart)
    return True


@TABLE.on(f"POST {API}/:hibernate", right=Right.ADMIN, needs=(Power,))
def hibernate(context: Context) -> None:
    """Sleep: the lidar rests and nothing moves until it is woken up."""
    context.robot[Power].sleep(source=SOURCE)


@TABLE.on(f"POST {API}/:wakeup", right=Right.ADMIN, needs=(Power,))
def wakeup(context: Context) -> None:
    """Wake up, which takes some seconds."""
    context.robot[Power].wake(source=SOURCE)


@TABLE.on(f"POST {API}/:restartmodule", right=Right.ADMIN, needs=(Firmware,))
def restart_module(context: Context, body: Restart) -> bool:
    """Restart the robot (without answers meanwhile), its software, or its base; 403 during an update."""
    if body.mode is RestartMode.HARD:
        context.robot[Firmware].reboot(source=SOURCE)
    else:
        context.robot[Firmware].restart(MODULES[body.mode], source=SOURCE)
    context.actions.abort()  # only now: a refusal stops nothing
    return True
