"""The manual's tables (0.2.2.1 and 0.2.2.3), cell by cell, transcribed here a second time from the vendor's words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.system.firmware import (
    Firmware,
    FirmwareProgress,
    FirmwareState,
    Module,
)
from roboglot.model.robot import Description, Robot
from roboglot.model.sensing import BatteryState
from roboglot.programs.tasks.reports import REFUSED_MAX, NewestRun, Reading
from roboglot.programs.tasks.robot_modes import ALLOWED, RobotMode, mode_of
from roboglot.programs.tasks.states import TaskOperation, TaskState, next_state

COLUMNS = ["inquiry", "save", "delete", "debug", "run", "suspend", "recover", "shutdown", "start", "stop"]
# The vendor's words, shortened: 空状态, 错误状态, 等待运行状态, 运行等待状态, 运行状态, 暂停状态, 终止状态, 非法操作.
WORDS = {
    "空": "null",
    "错": "error",
    "待": "wait_run",
    "注": "run_wait",
    "运": "run",
    "停": "suspend",
    "终": "shutdown",
}
MANUAL = """
null     | 空 | 错待 | 空 | 错注 | 非 | 非 | 非 | 非   | 非 | 非
error    | 错 | 错待 | 空 | 错注 | 非 | 非 | 非 | 非   | 非 | 非
wait_run | 待 | 错待 | 空 | 错注 | 注 | 非 | 非 | 终   | 非 | 非
run_wait | 注 | 非   | 非 | 错注 | 非 | 非 | 非 | 终   | 运 | 非
run      | 运 | 非   | 非 | 错注 | 运 | 停 | 运 | 注终 | 运 | 注终
suspend  | 停 | 非   | 非 | 错注 | 非 | 停 | 运 | 注终 | 非 | 注终
shutdown | 终 | 错待 | 空 | 错注 | 注 | 非 | 非 | 终   | 非 | 非
"""
CELLS = [
    (state.strip(), operation, cell.strip())
    for state, *cells in (line.split("|") for line in MANUAL.strip().splitlines())
    for operation, cell in zip(COLUMNS, cells, strict=True)
]


@pytest.mark.parametrize(("state", "operation", "cell"), CELLS, ids=lambda value: value)
def test_every_cell_of_the_task_table(state: str, operation: str, cell: str) -> None:
    expected = None if cell == "非" else tuple(WORDS[word] for word in cell)
    at = (TaskState(state), TaskOperation(operation))
    if operation in ("save", "debug"):
        results = (next_state(*at, correct=False), next_state(*at, correct=True))
    else:
        results = (next_state(*at, mode="cycle"), next_state(*at, mode="single"))
    match expected:
        case None:
            assert results == (None, None)
        case (only,):
            assert results == (only, only)
        case _:
            assert results == expected


def test_table_has_no_more_cells_than_the_manual() -> None:
    assert len(CELLS) == len(TaskState) * len(TaskOperation) == 70


class ChargedTo(Battery):
    def __init__(self, charge: float) -> None:
        self.charge = charge

    @property
    def state(self) -> BatteryState:
        return BatteryState(self.charge, 24.0, -1.0, 25.0, False, 1)


MODES = """
Uninitialized | - - - - - - - - - -
SetUp         | - - - - - - - - - -
TearDown      | - - - - - - - - - -
SelfCheck     | + - - - - + - + - +
Active        | + + + + + + + + + +
DeActive      | + + + - - + - + - +
Protected     | + + + + + + + + + +
LowPower      | + + + - - + - + - +
OTA           | + - - - - + - + - +
Error         | + - - - - + - + - +
"""


def test_every_cell_of_the_robot_mode_table() -> None:
    rows = dict(line.replace(" ", "").split("|") for line in MODES.strip().splitlines())
    assert {mode: "".join("-+"[TaskOperation(c) in ALLOWED[RobotMode(mode)]] for c in COLUMNS) for mode in rows} == rows
    assert len(rows) == len(RobotMode) == len(ALLOWED)


@pytest.mark.parametrize(
    ("charge", "mode"), [(1.0, "Active"), (0.2, "Active"), (0.19, "Protected"), (0.05, "Protected"), (0.04, "LowPower")]
)
def test_the_charge_decides_the_mode(charge: float, mode: str) -> None:
    robot = Robot("a", cast(Description, None), LockstepClock())
    assert mode_of(robot) == "Active"
    robot.add(Battery, ChargedTo(charge))
    assert mode_of(robot) == mode


@pytest.mark.parametrize(
    ("power", "firmware", "restarting", "mode"),
    [
        (PowerMode.AWAKE, FirmwareState.IDLE, None, "Active"),
        (PowerMode.AWAKE, FirmwareState.DOWNLOADING, None, "Active"),
        (PowerMode.LOW_POWER, FirmwareState.IDLE, None, "LowPower"),
        (PowerMode.WAKING_UP, FirmwareState.IDLE, None, "LowPower"),
        (PowerMode.ASLEEP, FirmwareState.IDLE, None, "DeActive"),
        (PowerMode.OFF, FirmwareState.IDLE, None, "TearDown"),
        (PowerMode.AWAKE, FirmwareState.REBOOTING, None, "TearDown"),
        (PowerMode.AWAKE, FirmwareState.INSTALLING, None, "OTA"),
        (PowerMode.AWAKE, FirmwareState.INSTALLED, Module.BASE, "SetUp"),
    ],
)
def test_power_and_firmware_decide_the_mode(
    power: PowerMode, firmware: FirmwareState, restarting: Module | None, mode: str
) -> None:
    robot = Robot("a", cast(Description, None), LockstepClock())
    robot.add(Power, cast(Power, SimpleNamespace(mode=power)))
    progress = FirmwareProgress(firmware)
    robot.add(Firmware, cast(Firmware, SimpleNamespace(progress=progress, restarting=restarting)))
    assert mode_of(robot) == mode


def test_run_keeps_its_first_refused_calls_once() -> None:
    run = NewestRun(0.0)
    run.note(Reading("t", 1, "", "block", "cyberdog.motion.turn", "(State)"))
    for n in range(3 * REFUSED_MAX):
        run.note(Reading("t", 2, "", "block", "cyberdog.motion.turn", "(State)", f"reason {n // 2}"))
    assert [call.refused for call in run.refused] == [f"reason {n}" for n in range(REFUSED_MAX)]
