"""Chapter "electronic skin", which the manual omits: on and off (11001), patterns (11002)."""

from __future__ import annotations

from roboglot.model.components.interaction.skin import ElectronicSkin, Shade, SkinPattern
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.operations import Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.wire.cyberdog.codes import Code, SkinMode
from roboglot.wire.cyberdog.text import Int32

OVER_TIME = frozenset({SkinMode.REARWARD, SkinMode.FORWARD, SkinMode.FLASH, SkinMode.RANDOM})


@TABLE.on(Code.ENABLE_SKIN, right=Right.DRIVE, needs=(ElectronicSkin,))
async def enable_skin(call: Call, *, data: bool) -> dict[str, object]:
    """Switch the skin on, or off (dark)."""
    call.context.robot[ElectronicSkin].enable(data)
    return {"success": True, "message": ""}


@TABLE.on(Code.SET_SKIN, right=Right.DRIVE, needs=(ElectronicSkin,))
async def set_skin(call: Call, *, mode: Int32, wave_cycle_time: Int32) -> dict[str, bool]:
    """Set the mode, 0 to 6; the time, in ms, applies to 2 to 5, and selects the shade of standing legs for 6."""
    skin = call.context.robot[ElectronicSkin]
    if mode not in tuple(SkinMode):
        return call.refused({"success": False}, f"there is no mode {mode}; use one of 0 to {max(SkinMode)}")
    pattern = SkinPattern[SkinMode(mode).name]
    try:
        if mode in OVER_TIME:
            skin.show(pattern, cycle=wave_cycle_time / 1000.0)
        else:
            skin.show(pattern, standing=Shade.DARK if wave_cycle_time else Shade.LIGHT)
    except (InvalidGoal, Refused) as refused:
        return call.refused({"success": False}, str(refused))
    return {"success": True}
