"""The pilot's keyboard and mouse, as the competition system passes them on (manual 3.2.20)."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from roboglot.model.components.interaction.input_device import Input, InputDevice, MouseButton
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.limits import KEYS_MAX
from roboglot.protocols.robomaster.switching import switch_or_undo
from roboglot.protocols.robomaster.table import TABLE
from roboglot.wire.robomaster.telemetry import KEYS_AND_MOUSE

PERIOD = 0.1  # s between two datagrams without changes; a change is sent at once
BUTTONS = {MouseButton.RIGHT: 1, MouseButton.LEFT: 2, MouseButton.MIDDLE: 4}
# Codes as clients of 2024 read them from robots; the manual prints only 199 for w, which none of them accepts.
KEYS = {"space": 8, "tab": 9, "shift": 16, "ctrl": 17, "alt": 18, "caps": 20}


def numbers(state: Input, seq: int) -> list[int]:
    """Return cmd_id, number of values that follow, buttons, mouse x and y in [-100, 100], seq, number of keys, keys."""
    keys = [KEYS.get(key) or ord(key.upper()) for key in state.keys[:KEYS_MAX]]
    x, y = round(state.x * 100), round(state.y * 100)
    data = [sum(BUTTONS[button] for button in state.buttons), x, y, seq, len(keys), *keys]
    return [KEYS_AND_MOUSE, len(data), *data]


class GamePushes:
    """Pushes of the pilot's input while switched on."""

    def __init__(self, context: Context) -> None:
        self._context, self._robot = context, context.robot
        self._seq = 0
        self._task: asyncio.Task[None] | None = None
        self._deafen: Callable[[], None] | None = None

    def switch(self, on: bool) -> None:
        """Switch the pushes; idempotent. Raises ComponentMissing for a robot without a pilot's keyboard."""
        if on and self._task is None:
            self._deafen = self._robot[InputDevice].listen(self._send)
            self._task = asyncio.get_running_loop().create_task(self._beat(), name="push game msg")
        elif not on and self._task:
            self._task.cancel()
            self._task = None
            if self._deafen:
                self._deafen()

    def reset(self) -> None:
        """Switch off."""
        self.switch(False)

    def _send(self, state: Input) -> None:
        self._context.send(self._context.profile.game(numbers(state, self._seq)))
        self._seq = (self._seq + 1) % 256

    async def _beat(self) -> None:
        async for _ in self._robot.clock.every(PERIOD):
            self._send(self._robot[InputDevice].state)


@TABLE.on("game_msg on", right=Right.SEE, needs=(InputDevice,))
async def game_on(context: Context) -> None:
    """Push keys and mouse (3.2.20.1)."""
    context.robot.require(InputDevice)
    pushes = context.part(GamePushes)
    await switch_or_undo(lambda: pushes.switch(True), lambda: pushes.switch(False))


@TABLE.on("game_msg off", right=Right.SEE)
def game_off(context: Context) -> None:
    """Stop pushing keys and mouse (3.2.20.2)."""
    context.part(GamePushes).switch(False)
