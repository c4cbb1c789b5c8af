"""cyberdog.bms: the battery (4.4.10)."""

from __future__ import annotations

from roboglot.model.components.battery import Battery, DockContact
from roboglot.programs.functions.results import header
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

FULL = 0.995  # charge


@ABILITIES.on("cyberdog.bms.data")
async def data(session: Session) -> Record:
    """The battery now, as BmsStatus (attribute); current is negative while discharging.

    What the model's battery does not know (health, wireless charging, the motors' power cut, soft switch-off) stays at
    the type's default.
    """
    robot = session.robot
    battery = robot[Battery].state
    full = battery.charging and battery.percentage >= FULL
    docked = DockContact in robot and robot[DockContact].docked
    return Record(
        "BmsStatus",
        {
            "header": header(robot.clock.epoch(), "bms"),
            "batt_volt": round(battery.voltage * 1000),
            "batt_curr": round(battery.current * 1000),
            "batt_soc": round(battery.percentage * 100),
            "batt_temp": round(battery.temperature),
            "batt_st": (not battery.charging) | (battery.charging and not full) << 1 | full << 2,
            "batt_loop_number": battery.cycles,
            "power_normal": not battery.charging,
            "power_wired_charging": battery.charging and not full,
            "power_finished_charging": full,
            "power_expower_supply": docked,
        },
    )


@ABILITIES.on("cyberdog.bms.get_data")
async def get_data(session: Session, timeout: int = 5) -> Record:
    """The newest BmsStatus; the battery always has one, so nothing is waited for."""
    return await data(session)
