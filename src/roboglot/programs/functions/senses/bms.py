"""cyberdog.bms: the battery (4.4.10)."""

from __future__ import annotations

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.motion.emergency_stop import is_stopped
from roboglot.model.components.system.link import require_heard
from roboglot.model.robot import Robot
from roboglot.model.sensing import BatteryState, Supply
from roboglot.programs.functions.results import header
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

FULL = 0.995  # charge
TOPPED = 0.97  # charge above which a charger that has finished stays off
# power_supply and status: the manual gives names without numbers. The numbers are ours.
SUPPLIES = {Supply.NONE: 0, Supply.WIRE: 1, Supply.CONTACTS: 2, Supply.WIRELESS: 3}
IN_USE, CHARGING, CHARGED, LOCKED = range(4)


@ABILITIES.on("cyberdog.bms.data", needs=(Battery,))
async def data(session: Session) -> Record:
    """State of the battery as BmsStatus (attribute); the current is negative while discharging."""
    robot = session.robot
    require_heard(robot)
    battery = robot[Battery].state
    supplied = battery.supply is not Supply.NONE
    full = supplied and battery.percentage >= (FULL if battery.charging else TOPPED)
    filling = battery.charging and not full
    unpowered, off = _motors_off(robot), Power in robot and robot[Power].mode is PowerMode.OFF
    return Record(
        "BmsStatus",
        {
            "header": header(robot.clock.epoch(), "bms"),
            **_measured(battery),
            "batt_st": (not supplied) | filling << 1 | full << 2 | unpowered << 3 | off << 4,
            "key_val": int(off),
            "status": LOCKED if battery.charge_locked else CHARGED if full else CHARGING if filling else IN_USE,
            "power_normal": not supplied,
            "power_wired_charging": filling and battery.wired_charging,
            "power_finished_charging": full,
            "power_motor_shutdown": unpowered,
            "power_soft_shutdown": off,
            "power_wp_place": battery.supply in (Supply.CONTACTS, Supply.WIRELESS),
            "power_wp_charging": filling and battery.dock_charging,
            "power_expower_supply": supplied,
        },
    )


@ABILITIES.on("cyberdog.bms.get_data", needs=(Battery,))
async def get_data(session: Session, timeout: int = 5) -> Record:  # noqa: ARG001 - the vendor has it
    """Return the newest BmsStatus, without waiting: the battery always has one."""
    return await data(session)


def _measured(battery: BatteryState) -> dict[str, object]:
    """Return the measured fields in mV, mA, percent and degrees; switches are 0 or 1."""
    return {
        "batt_volt": round(battery.voltage * 1000),
        "batt_curr": round(battery.current * 1000),
        "batt_soc": round(battery.percentage * 100),
        "batt_temp": round(battery.temperature),
        "batt_health": round(battery.health * 100),
        "batt_loop_number": battery.cycles,
        "disable_charge": int(battery.charge_locked),
        "buzze": int(battery.buzzing),
        "power_supply": SUPPLIES[battery.supply],
    }


def _motors_off(robot: Robot) -> bool:
    """Return whether the motors have no power: the robot sleeps, or its emergency stop is engaged."""
    asleep = Power in robot and robot[Power].mode is not PowerMode.AWAKE
    return asleep or is_stopped(robot)
