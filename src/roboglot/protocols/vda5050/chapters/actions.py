"""Chapter 6.2.3: the predefined actions that a robot here can do. Each returns when it is done, with its result."""

from __future__ import annotations

from roboglot.confirmation import confirmed
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.components.motion.docking import Docking
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.geometry import Pose
from roboglot.operations import Right
from roboglot.protocols.vda5050.context import SOURCE, Context
from roboglot.protocols.vda5050.table import TABLE
from roboglot.wire.vda5050.orders import Angle, Id, Metres, Text, Texts


@TABLE.on("startPause", right=Right.DRIVE)
async def start_pause(context: Context) -> str:
    """Stop driving until stopPause; the order is kept."""
    context.pause(True)
    return ""


@TABLE.on("stopPause", right=Right.DRIVE)
async def stop_pause(context: Context) -> str:
    """Go on after startPause."""
    context.pause(False)
    return ""


@TABLE.on("cancelOrder", right=Right.DRIVE)
async def cancel_order(context: Context, *, orderId: str = "") -> str:  # noqa: N803 - the standard's word
    """Stop, and drop the rest of the order; done when the robot stands."""
    await context.cancel_order(orderId)
    return ""


@TABLE.on("stateRequest", right=Right.SEE)
async def request_state(context: Context) -> str:
    """Send the state now."""
    context.touch()
    return ""


@TABLE.on("factsheetRequest", right=Right.SEE)
async def request_factsheet(context: Context) -> str:
    """Send the factsheet now."""
    await context.send_factsheet()
    return ""


@TABLE.on("clearInstantActions", right=Right.DRIVE)
async def clear_instant_actions(context: Context) -> str:
    """Remove ended instant actions from the state."""
    context.clear_instant_actions()
    return ""


@TABLE.on("trigger", right=Right.DRIVE)
async def trigger(context: Context) -> str:
    """Resume an action that waits for a trigger."""
    context.release_trigger()
    return ""


@TABLE.on("waitForTrigger", right=Right.DRIVE)
async def wait_for_trigger(context: Context, *, triggerType: Text | Texts = "") -> str:  # noqa: N803
    """Wait until the trigger action comes, or the order is cancelled; triggerType is only repeated in the result."""
    await context.wait_for_trigger()
    kinds = [triggerType] if isinstance(triggerType, str) else triggerType
    return " ".join(("triggered", *kinds)).strip()


@TABLE.on("initPosition", "initializePosition", right=Right.EDIT, needs=(Localization,))
async def initialize_position(
    context: Context,
    *,
    x: Metres,
    y: Metres,
    theta: Angle,
    mapId: Id,  # noqa: N803
    lastNodeId: Id = "",  # noqa: N803
) -> str:
    """Set the robot's pose in its map."""
    if mapId == context.map_id:
        async with confirmed():
            context.robot[Localization].set_pose(Pose(x, y, theta))
    elif MapLibrary not in context.robot or mapId not in await context.robot[MapLibrary].names():
        raise InvalidGoal(f"there is no map {mapId!r}; the robot's map is {context.map_id!r}")
    elif context.book.nodes:
        raise Refused(f"order {context.book.order_id} is being driven in {context.map_id!r}")
    else:
        await context.maps.use(await context.maps.kept(mapId, ""), Pose(x, y, theta))
    context.book.place_at(lastNodeId, 0)
    return ""


@TABLE.on("startCharging", right=Right.DRIVE, needs=(Docking,))
async def start_charging(context: Context) -> str:
    """Drive to the dock and onto its contacts."""
    await context.performer.carry_out(context.robot[Docking].dock(source=SOURCE))
    return "charging"


@TABLE.on("stopCharging", right=Right.DRIVE, needs=(Docking,))
async def stop_charging(context: Context) -> str:
    """Leave the dock."""
    await context.performer.carry_out(context.robot[Docking].undock(source=SOURCE))
    return ""


@TABLE.on("retry", right=Right.DRIVE)
async def retry(context: Context, *, actionId: Id) -> str:  # noqa: N803
    """Retry a failed action that is RETRIABLE."""
    context.performer.answer(actionId, again=True)
    return ""


@TABLE.on("skipRetry", right=Right.DRIVE)
async def skip_retry(context: Context, *, actionId: Id) -> str:  # noqa: N803
    """Fail an action that is RETRIABLE."""
    context.performer.answer(actionId, again=False)
    return ""
