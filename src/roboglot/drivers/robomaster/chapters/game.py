"""Keyboard and mouse of the pilot, as the match system passes them to the robot; reported while a client listens."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.components.interaction.input_device import Input, InputDevice, MouseButton
from roboglot.model.errors import Refused, RobotError
from roboglot.wire.robomaster.telemetry import KEYS_AND_MOUSE, GameInput

BUTTONS = {1: MouseButton.RIGHT, 2: MouseButton.LEFT, 4: MouseButton.MIDDLE}
KEYS = {8: "space", 9: "tab", 16: "shift", 17: "ctrl", 18: "alt", 20: "caps"}
RANGE = 100  # of the mouse
PRINTABLE = range(48, 91)  # codes of digits and letters


class RoboMasterInput(InputDevice):
    """Read-only: only the pilot presses keys."""

    def __init__(self, client: RoboMasterClient, supervisor: Supervisor) -> None:
        super().__init__()
        self._client, self._supervisor = client, supervisor
        self._forget: Callable[[], None] = lambda: None

    async def probe(self) -> None:
        """Switch the reports. Raises RefusedByRobot if the robot has none."""
        await (self._client.game_msg.on() if self._listeners else self._client.game_msg.off())
        self._forget()
        self._forget = self._client.listen(self._on_push, GameInput)

    def listen(self, listener: Callable[[Input], None]) -> Callable[[], None]:
        if not self._listeners:
            self._switch(True)
        end = super().listen(listener)

        def leave() -> None:
            end()
            if not self._listeners:
                self._switch(False)

        return leave

    def press(self, key: str) -> None:
        raise Refused("only the pilot presses keys")

    def click(self, *buttons: MouseButton) -> None:
        raise Refused("only the pilot clicks")

    def move_mouse(self, x: float, y: float) -> None:
        raise Refused("only the pilot moves the mouse")

    def _switch(self, on: bool) -> None:
        game = self._client.game_msg
        with contextlib.suppress(RobotError):  # without a link: at the next connection
            self._supervisor.send("switching the pilot's keys", game.on() if on else game.off())

    def _on_push(self, push: object) -> None:
        assert isinstance(push, GameInput)
        if push.cmd_id != KEYS_AND_MOUSE or len(push.data) < 5:
            return
        buttons, x, y, _, _, *codes = push.data
        self._change(
            Input(
                tuple(key for code in codes if (key := _key(code))),
                frozenset(button for bit, button in BUTTONS.items() if buttons & bit),
                min(max(x / RANGE, -1.0), 1.0),
                min(max(y / RANGE, -1.0), 1.0),
            )
        )


def _key(code: int) -> str:
    return KEYS.get(code) or (chr(code).lower() if code in PRINTABLE and chr(code).isalnum() else "")
