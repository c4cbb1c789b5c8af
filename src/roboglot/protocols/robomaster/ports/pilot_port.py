"""A port for a simulated pilot: keyboard and mouse as text lines, for ``game_msg`` (manual 3.2.20).

``press w``, ``release w``, ``click left right`` (the buttons held from now on), ``mouse 0.5 -0.2``; each is answered
with ``ok`` or an error. Keys and buttons that a connection holds are released when it ends. Not the vendor's, and
closed unless configured.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import cast

from roboglot.model.components.interaction.input_device import InputDevice, MouseButton
from roboglot.model.errors import InvalidGoal, RobotError
from roboglot.model.inputs.external import Input
from roboglot.model.robot import Robot
from roboglot.protocols.robomaster.foreign_protocols import Greeting, turn_away_strangers
from roboglot.protocols.robomaster.limits import PILOT_LINE_MAX, PILOTS_MAX

Act = Callable[[InputDevice, Sequence[str]], None]
PILOT = "pilot"  # the kind of these inputs in a recording
LINE, LET_GO = "line", "let go"


def _press(device: InputDevice, words: Sequence[str]) -> None:
    for key in words:
        device.press(key)


def _release(device: InputDevice, words: Sequence[str]) -> None:
    for key in words:
        device.release(key)


def _click(device: InputDevice, words: Sequence[str]) -> None:
    device.click(*(MouseButton(word) for word in words))


def _mouse(device: InputDevice, words: Sequence[str]) -> None:
    x, y = (float(word) for word in words)
    device.move_mouse(x, y)


ACTS: dict[str, Act] = {"press": _press, "release": _release, "click": _click, "mouse": _mouse}


class Pilots:
    """Connected pilots, at most PILOTS_MAX."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.transports: set[asyncio.Transport] = set()

    def connect(self) -> asyncio.Protocol:
        """Return the protocol of a new connection."""
        return _Pilot(self)

    def close(self) -> None:
        """Disconnect all pilots."""
        for transport in tuple(self.transports):
            transport.abort()


class _Pilot(asyncio.Protocol):
    transport: asyncio.Transport

    def __init__(self, pilots: Pilots) -> None:
        self._pilots = pilots
        self._greeting = Greeting()
        self._tail = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport = cast(asyncio.Transport, transport)  # uvloop's transport does not inherit from it
        if len(self._pilots.transports) >= PILOTS_MAX:
            transport.abort()
            return
        self._pilots.transports.add(transport)

    def data_received(self, data: bytes) -> None:
        if self.transport.is_closing():
            return
        *lines, self._tail = (self._tail + turn_away_strangers(self._greeting, self.transport, data)).split(b"\n")
        for line in lines:
            self.transport.write(f"{self._do(line.decode(errors='replace'))}\n".encode())
        if len(self._tail) > PILOT_LINE_MAX or self.transport.get_write_buffer_size() > PILOT_LINE_MAX:
            self.transport.abort()

    def connection_lost(self, _exc: Exception | None) -> None:
        if self.transport in self._pilots.transports:
            self._pilots.transports.discard(self.transport)
            _let_go(self._pilots.robot)

    def _do(self, text: str) -> str:
        try:
            _act(self._pilots.robot, text)
        except (RobotError, ValueError) as error:
            return f"error: {error}"
        return "ok"


def do_again(robot: Robot, noted: Input) -> None:
    """Repeat a pilot's recorded input. Raises the errors of the original."""
    if noted.name == LET_GO:
        _let_go(robot)
    else:
        _act(robot, str(noted.values["text"]))


def _act(robot: Robot, text: str) -> None:
    words = text.split()
    act = ACTS[words[0]] if words and words[0] in ACTS else None
    if act is None:
        raise InvalidGoal(f"it is one of {', '.join(ACTS)}")
    with robot.inputs.noting(PILOT, LINE, {"text": text}):
        act(robot[InputDevice], words[1:])


def _let_go(robot: Robot) -> None:
    """Release all keys and buttons."""
    if InputDevice in robot:
        device = robot[InputDevice]
        with robot.inputs.noting(PILOT, LET_GO, {}):
            _release(device, device.state.keys)
            device.click()
            device.move_mouse(0.0, 0.0)
