"""A pilot's keyboard and mouse, as far as they concern the robot. A script or a test feeds it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum

from roboglot.model.components.component import Component
from roboglot.model.errors import InvalidGoal
from roboglot.model.events.listeners import Failures, call_all
from roboglot.values import dataclass

NAMED_KEYS = ("space", "tab", "shift", "ctrl", "alt", "caps")


class MouseButton(StrEnum):
    """A button of the mouse."""

    LEFT = "left"
    RIGHT = "right"
    MIDDLE = "middle"


@dataclass(frozen=True, slots=True)
class Input:
    """Keys and buttons held at one moment; keys (lower case, or NAMED_KEYS) in the order of pressing.

    ``x`` and ``y``: speed of the mouse to the right and up, -1..1 of its range.
    """

    keys: tuple[str, ...] = ()
    buttons: frozenset[MouseButton] = frozenset()
    x: float = 0.0
    y: float = 0.0


class InputDevice(Component):
    """Holds keys and buttons until they are released; notifies its listeners of every change."""

    def __init__(self) -> None:
        self._state = Input()
        self._listeners: list[Callable[[Input], None]] = []
        self._failures = Failures()

    @property
    def state(self) -> Input:
        """Current state."""
        return self._state

    def press(self, key: str) -> None:
        """Hold a key down. Raises InvalidGoal for an unknown key."""
        if key not in NAMED_KEYS and not (len(key) == 1 and key.isascii() and (key.islower() or key.isdigit())):
            raise InvalidGoal(f"a key is a lower-case letter, a digit or one of {', '.join(NAMED_KEYS)}, not {key!r}")
        if key not in self._state.keys:
            self._change(replace(self._state, keys=(*self._state.keys, key)))

    def release(self, key: str) -> None:
        """Release a key; no effect if it is not held."""
        self._change(replace(self._state, keys=tuple(each for each in self._state.keys if each != key)))

    def click(self, *buttons: MouseButton) -> None:
        """Hold these buttons of the mouse, and no others."""
        self._change(replace(self._state, buttons=frozenset(buttons)))

    def move_mouse(self, x: float, y: float) -> None:
        """Move the mouse at this speed until the next command. Raises InvalidGoal beyond -1 to 1."""
        if not (-1.0 <= x <= 1.0 and -1.0 <= y <= 1.0):
            raise InvalidGoal(f"the mouse moves at -1 to 1 of its range, not ({x}, {y})")
        self._change(replace(self._state, x=x, y=y))

    def listen(self, listener: Callable[[Input], None]) -> Callable[[], None]:
        """Call ``listener`` on every change; return a function that unsubscribes it."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def _change(self, state: Input) -> None:
        if state != self._state:
            self._state = state
            call_all(self._listeners, state, self._failures)
