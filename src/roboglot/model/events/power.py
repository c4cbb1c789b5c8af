"""Events of power: charge, charging, sleep, restarts."""

from __future__ import annotations

from roboglot.model.events.stream import Event
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class BatteryChanged(Event):
    """The charge changed by a whole percent, or charging began or ended."""

    percentage: float
    charging: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class DockContactChanged(Event):
    """The robot touched its charging dock, or left it."""

    docked: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PowerModeChanged(Event):
    """The robot fell asleep, woke up or saves power (a ``PowerMode`` value)."""

    mode: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Rebooting(Event):
    """The robot restarts: all actions are cancelled, and its doors stay closed for ``seconds``."""

    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Rebooted(Event):
    """The robot is up again; its doors open."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModuleRestarting(Event):
    """A module (a ``Module`` value) restarts, and the rest stays up; requests from now on outlast the restart."""

    module: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ModuleRestarted(Event):
    """A module (a ``Module`` value) has restarted; the rest stayed up."""

    module: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ShuttingDown(Event):
    """The robot switches off now: its doors close; ``restart_after``: s until it starts again, None: it stays off."""

    restart_after: float | None = None
