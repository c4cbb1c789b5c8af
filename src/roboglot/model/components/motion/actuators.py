"""Actuators beside wheels and legs: arm, gripper, gimbal, jack, servos, doors of boxes, blaster.

An emergency stop, sleep, an empty battery or a restart holds them all still. Wheels and legs have locks of their own.
"""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.actions import Action, Actions
from roboglot.model.components.logistics.cargo import BOX
from roboglot.model.components.logistics.jack import JACK
from roboglot.model.components.motion.arm import ARM
from roboglot.model.components.motion.gimbal import GIMBAL
from roboglot.model.components.motion.gripper import GRIPPER
from roboglot.model.components.motion.servo import SERVO
from roboglot.model.errors import Refused

SINGLE, NUMBERED = frozenset({ARM, GIMBAL, GRIPPER, JACK}), (BOX, SERVO)  # resources, and prefixes of resources


class Actuators:
    """Holds by holder: while there is any, no action moves an actuator; refusals give the reason of the first."""

    def __init__(self, actions: Actions) -> None:
        self._actions = actions
        self._holds: dict[str, Refused] = {}
        self.on_held: list[Callable[[], None]] = []  # called when the first hold begins and when the last one ends
        actions.guard(self._admit)

    def hold(self, who: str, reason: str | Refused) -> None:
        """Cancel all that moves an actuator, and refuse it until ``who`` releases; ``reason``: a text, or the error."""
        before = self.held
        self._holds[who] = reason if isinstance(reason, Refused) else Refused(reason)
        for action in self._actions.running():
            if moves_actuator(action):
                action.cancel(str(reason))
        self._report(before)

    def release(self, who: str) -> None:
        """Remove the hold of ``who``, if there is one. No action goes on by itself."""
        before = self.held
        self._holds.pop(who, None)
        self._report(before)

    def _report(self, before: bool) -> None:
        if self.held != before:
            for listener in self.on_held:
                listener()

    @property
    def held(self) -> bool:
        """True if there is any hold."""
        return bool(self._holds)

    def check(self) -> None:
        """Raise the error of the first hold, if there is one."""
        for reason in self._holds.values():
            raise reason.again()

    def _admit(self, action: Action) -> None:
        if self._holds and moves_actuator(action):
            self.check()


def moves_actuator(action: Action) -> bool:
    """Return whether an action moves an actuator beside wheels and legs."""
    return any(resource in SINGLE or resource.startswith(NUMBERED) for resource in action.resources)
