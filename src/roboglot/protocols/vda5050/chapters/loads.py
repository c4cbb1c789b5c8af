"""Chapter 6.2.3: picking and dropping loads with the jack."""

from __future__ import annotations

from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.tag_docking import Mark, MarkGoal, TagDocking
from roboglot.model.errors import NotFound, Refused
from roboglot.operations import Right
from roboglot.protocols.vda5050.context import SOURCE, Context
from roboglot.protocols.vda5050.table import TABLE
from roboglot.protocols.vda5050.vocabulary import JACK_POSITION, SHELF
from roboglot.wire.vda5050.orders import NotNegative, Text


@TABLE.on("pick", right=Right.DRIVE, needs=(Jack, TagDocking, Localization))
async def pick(
    context: Context,
    *,
    lhd: Text = "",
    stationType: Text = "",  # noqa: N803 - the standard's words
    stationName: Text = "",  # noqa: N803, ARG001
    loadType: Text = "",  # noqa: N803
    loadId: Text = "",  # noqa: N803
    height: NotNegative | None = None,
    depth: NotNegative | None = None,
    side: Text = "",
) -> str:
    """Lift the load above the robot; at stationType "shelf" the robot finds the shelf's legs and drives under it."""
    robot, jack = context.robot, context.robot[Jack]
    _check(lhd, stationType, height, depth, side)
    if jack.loaded:
        raise Refused("the robot carries a load already")
    if stationType == SHELF:
        start = robot[Localization].pose
        await context.performer.carry_out(
            robot[TagDocking].dock_at(MarkGoal(mark=Mark.SHELF, start=start, lift=True), source=SOURCE)
        )
    else:
        await context.performer.carry_out(jack.raise_platform(source=SOURCE))
    if not jack.loaded:
        await context.performer.carry_out(jack.lower_platform(source=SOURCE))
        raise NotFound("there is no load over the platform")
    context.load = {key: said for key, said in (("loadId", loadId), ("loadType", loadType)) if said}
    return "the load is on the jack"


@TABLE.on("drop", right=Right.DRIVE, needs=(Jack, TagDocking))
async def drop(
    context: Context,
    *,
    lhd: Text = "",
    stationType: Text = "",  # noqa: N803
    stationName: Text = "",  # noqa: N803, ARG001
    loadType: Text = "",  # noqa: N803, ARG001
    loadId: Text = "",  # noqa: N803
    height: NotNegative | None = None,
    depth: NotNegative | None = None,
    side: Text = "",
) -> str:
    """Set the load down; at stationType "shelf" the robot drives out from under it, too."""
    robot, jack = context.robot, context.robot[Jack]
    _check(lhd, stationType, height, depth, side)
    if not jack.loaded:
        raise Refused("the robot carries no load")
    if loadId and loadId != context.load.get("loadId", loadId):
        raise Refused(f"the load on the jack is {context.load['loadId']}, not {loadId}")
    await context.performer.carry_out(jack.lower_platform(source=SOURCE))
    if jack.loaded:
        raise Refused("the load is still on the platform")
    if stationType == SHELF:
        await context.performer.carry_out(robot[TagDocking].back_off(Mark.SHELF, source=SOURCE))
    return "the load stands on the floor"


def _check(lhd: str, station: str, height: float | None, depth: float | None, side: str) -> None:
    """Raise Refused for a load that a jack cannot handle."""
    if lhd not in ("", JACK_POSITION):
        raise Refused(f"there is no load handling device {lhd!r}; the robot's is {JACK_POSITION!r}")
    if station not in ("", SHELF):
        raise Refused(f"there is no station type {station!r}; it is {SHELF!r} or left out")
    for name, value in (("height", height), ("depth", depth), ("side", side or None)):
        if value is not None:
            raise Refused(f"a jack has no {name}")
