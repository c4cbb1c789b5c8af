"""Every door during soft, base and hard restarts, sleep, hibernation and a shutdown.

Meanwhile no command succeeds and nothing moves; afterwards each door's command is done again.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Awaitable, Callable

import grpc
import httpx
import pytest

from roboglot.agents.console import Refused
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.events import ActionChanged
from tests.protocols.commands import COMMANDS
from tests.protocols.every_door import SYSTEM, Doors
from tests.protocols.life import LIMIT
from tests.protocols.vda5050.orders import action, instant

GONE = OSError, EOFError, httpx.TransportError, grpc.aio.AioRpcError, Refused  # of a door without an answer
AT_ONCE, PATIENCE = 0.3, 60.0  # real s
STIRS = 0.03  # m and rad
SETTLED = 3.0  # s
Command = Callable[[Doors], Awaitable[bool]]


class Sweep:
    """Gives the commands of all doors, one after the other."""

    def __init__(self, doors: Doors) -> None:
        self._doors, self._ended = doors, list[ActionChanged]()
        doors.robot.events.listen(ActionChanged, self._ended.append)

    async def refused(self, down: Callable[[], bool]) -> None:
        """Give each command while ``down``: none may be done, and the robot stands as long as that lasts."""
        await self.wait(0.5)  # a robot that lies down stirs
        asked = 0
        for command in COMMANDS:
            if down():
                done = await self.give(command, down)
                assert not (done and down()), command
                asked += 1
        assert asked

    async def done(self) -> None:
        """Give each command; all are done, and by an action that succeeded."""
        for command in COMMANDS:
            self._ended.clear()
            assert await self.give(command), command
            assert any(event.action.status.name == "SUCCEEDED" for event in self._ended), command
            await self.wait(SETTLED)

    async def until(self, true: Callable[[], bool]) -> None:
        """Let robot time pass until the condition holds; sockets take real time."""
        deadline = time.monotonic() + PATIENCE
        while not true():
            assert time.monotonic() < deadline
            await self.wait(0.2)

    async def wait(self, seconds: float) -> None:
        """Let robot time pass, and sockets take a little."""
        for _ in range(math.ceil(seconds / 0.1)):
            await asyncio.sleep(0.005)
            await self._doors.life.forward(0.1)

    async def give(self, command: Command, down: Callable[[], bool] = lambda: False) -> bool:
        """Return whether the command was done. Nothing may move while ``down``."""
        truth = self._doors.world.truth
        task, passed = asyncio.ensure_future(_answer(command, self._doors)), 0.0
        await asyncio.wait((task,), timeout=AT_ONCE if down() else 0.01)  # a refusal takes no robot time
        deadline = time.monotonic() + PATIENCE
        while not task.done():
            assert time.monotonic() < deadline, command
            before, was_down = truth.pose_of("a"), down()
            if passed < LIMIT:
                await self._doors.life.forward(0.1)
                passed += 0.1
            await asyncio.sleep(0.01)
            now = truth.pose_of("a")
            if was_down and down():
                assert now.distance_to(before) + abs(now.relative_to(before).yaw) < STIRS, command
        return task.result()


async def _answer(command: Command, doors: Doors) -> bool:
    try:
        return await command(doors)
    except GONE:
        await doors.hang_up()
        return False


async def _module(doors: Doors, sweep: Sweep, mode: str) -> None:
    assert await doors.rest("POST", f"{SYSTEM}/power/:restartmodule", json={"mode": f"RestartMode{mode}"}) is True
    firmware = doors.robot[Firmware]
    await sweep.refused(lambda: firmware.restarting is not None)
    await sweep.until(lambda: firmware.restarting is None)


async def soft(doors: Doors, sweep: Sweep) -> None:
    await _module(doors, sweep, "Soft")


async def base(doors: Doors, sweep: Sweep) -> None:
    await _module(doors, sweep, "Base")


async def hard(doors: Doors, sweep: Sweep) -> None:
    """Its doors answer for 0.2 s, and are closed then."""
    assert await doors.rest("POST", f"{SYSTEM}/power/:restartmodule", json={"mode": "RestartModeHard"}) is True
    await sweep.refused(lambda: bool(doors.robot.starts.down))
    await _up(doors, sweep)


async def shutdown(doors: Doors, sweep: Sweep) -> None:
    times = {"shutdown_time_interval": 0, "restart_time_interval": 1}
    assert await doors.rest("POST", f"{SYSTEM}/power/:shutdown", json=times) is True
    await sweep.until(lambda: doors.robot[Power].mode is PowerMode.OFF)
    await sweep.refused(lambda: doors.robot[Power].mode is PowerMode.OFF)
    await _up(doors, sweep)


async def sleep(doors: Doors, sweep: Sweep) -> None:
    power = doors.robot[Power]
    assert await doors.rest("POST", f"{SYSTEM}/power/:hibernate") == 200
    await sweep.until(lambda: power.mode is PowerMode.ASLEEP)
    await sweep.refused(lambda: power.mode is PowerMode.ASLEEP)
    assert await doors.rest("POST", f"{SYSTEM}/power/:wakeup") == 200
    await sweep.until(lambda: power.mode is PowerMode.AWAKE)


async def hibernation(doors: Doors, sweep: Sweep) -> None:
    power, control = doors.robot[Power], doors.control

    def connection() -> str:
        control.hear()
        return str(control.heard["connection"][-1]["connectionState"])

    control.send("instantActions", instant(action("startHibernation", "hibernate")))
    await sweep.until(lambda: connection() == "HIBERNATING")
    await sweep.refused(lambda: power.mode is PowerMode.LOW_POWER)
    control.send("instantActions", instant(action("stopHibernation", "wake")))
    await sweep.until(lambda: power.mode is PowerMode.AWAKE and connection() == "ONLINE")


async def _up(doors: Doors, sweep: Sweep) -> None:
    """Wait until all doors of a robot that starts answer."""
    await sweep.until(lambda: not doors.robot.starts.down)
    heard = len(doors.control.heard["state"])
    deadline = time.monotonic() + PATIENCE
    while not await _answers(doors) or len(doors.control.heard["state"]) == heard:
        assert time.monotonic() < deadline
        await doors.life.forward(0.2)
        await asyncio.sleep(0.05)
        doors.control.hear()


async def _answers(doors: Doors) -> bool:
    try:
        await doors.say("robot battery ?")
        await doors.life.phone.raw(1001, {})
        return await doors.rest("GET", f"{SYSTEM}/power/status") != 503
    except GONE:
        await doors.hang_up()
        return False


@pytest.mark.slow  # in short: test_last_moments_of_the_door_refuse_changes and its like at each door
@pytest.mark.timeout(900)
@pytest.mark.parametrize("while_down", [soft, base, hard, shutdown, sleep, hibernation])
async def test_no_command_is_done_while_down(
    doors: Doors, while_down: Callable[[Doors, Sweep], Awaitable[None]]
) -> None:
    sweep = Sweep(doors)
    await doors.life.forward(2.0)
    await while_down(doors, sweep)
    await sweep.done()
