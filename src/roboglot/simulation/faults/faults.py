"""Fault injection: faults on purpose, through the same physics as real ones.

``world.faults.inject("low_battery", robot="a", charge=0.08)`` by hand, ``[[faults]]`` in the world's file by time.
docs/worlds/faults.md lists the kinds, their options and how each shows.
"""

from __future__ import annotations

import heapq
import inspect
import itertools
import logging
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar, get_type_hints

import msgspec

from roboglot.model.client_context import concerning
from roboglot.model.errors import ComponentMissing, NotFound, RobotError
from roboglot.model.stage import ActiveFault, FaultKind
from roboglot.simulation.faults.fault_kinds import KINDS, FaultRecipe, FragileWorld, Target, Undo
from roboglot.spelling import meant
from roboglot.validation import why_invalid

if TYPE_CHECKING:
    from roboglot.simulation.world.description import PlannedFault

T = TypeVar("T")
log = logging.getLogger(__name__)
FAULTS_MAX = 100


class Faults:
    """All faults of one world. A kind acts once per robot at a time, except obstacles."""

    def __init__(self, world: FragileWorld, planned: Sequence[PlannedFault]) -> None:
        self._world = world
        self._numbers, self._order = itertools.count(1), itertools.count()
        self._active: dict[int, tuple[ActiveFault, Undo]] = {}
        self._agenda: list[tuple[float, int, Callable[[], None]]] = []
        for plan in planned:
            self._at(plan.at, self._planned(plan))

    @property
    def kinds(self) -> list[FaultKind]:
        """Return the kinds of faults with their options and defaults."""
        return [FaultKind(name, kind.of_robot, _options_of(kind)) for name, kind in sorted(KINDS.items())]

    @property
    def active(self) -> list[ActiveFault]:
        """Active faults, oldest first."""
        return [fault for fault, _ in self._active.values()]

    def inject(
        self, kind: str, robot: str | None = None, *, duration: float | None = None, **options: object
    ) -> list[ActiveFault]:
        """Begin a fault of ``kind``: on one robot, on all that have the part (None), or in the building.

        It ends after ``duration`` s of robot time, or with ``clear``. Raises NotFound for an unknown robot, ValueError
        in plain words otherwise.
        """
        if kind not in KINDS:
            raise ValueError(f"no fault is called {kind!r}{meant(kind, KINDS)}")
        options = _checked_options(kind, options)
        if duration is not None and not _checked("duration", duration, float) > 0.0:
            raise ValueError("a fault lasts for more than 0 s")
        begun = []
        for target in self._targets(kind, robot):
            try:
                begun.append(self._begin(kind, target, options))
            except ComponentMissing as error:
                if robot is not None:
                    raise ValueError(f"{robot} cannot have {kind}: {error}") from None
        if not begun:
            raise ValueError(f"no robot here can have {kind}")
        if duration is not None:
            numbers = [fault.number for fault in begun]
            self._at(self._world.time + duration, lambda: self._end(numbers))
        return begun

    def clear(self, number: int | None = None) -> None:
        """End one fault, or all. Irreversible effects (a robot that was carried off) stay. Raises NotFound."""
        if number is not None and number not in self._active:
            raise NotFound(f"no fault {number} is active")
        self._end(list(self._active) if number is None else [number])

    def step(self, stamp: float) -> None:
        """Begin and end the faults that are due until ``stamp`` (robot time, s)."""
        while self._agenda and self._agenda[0][0] <= stamp + 1e-9:
            heapq.heappop(self._agenda)[2]()

    @property
    def next(self) -> float:
        """Robot time before which no fault begins or ends by itself, s."""
        return self._agenda[0][0] - 1e-6 if self._agenda else math.inf

    # ------------------------------------------------------------------------------------------------------------------

    def _targets(self, kind: str, robot: str | None) -> list[Target]:
        world = self._world
        if not KINDS[kind].of_robot:
            if robot is not None:
                raise ValueError(f"{kind} affects the building, not a robot")
            return [Target(world, None)]
        return [Target(world, name) for name in ([robot] if robot is not None else world.robots)]

    def _begin(self, kind: str, target: Target, options: Mapping[str, object]) -> ActiveFault:
        name = target.name
        same = any(fault.kind == kind and fault.robot == name for fault in self.active)
        if same and not KINDS[kind].many:
            raise ValueError(f"{kind} acts already" + (f" on {name}" if name else ""))
        if len(self._active) >= FAULTS_MAX:
            raise ValueError(f"no more than {FAULTS_MAX} faults at a time")
        undo = KINDS[kind].begin(target, **options)
        fault = ActiveFault(next(self._numbers), kind, name, dict(options))
        self._active[fault.number] = fault, undo
        return fault

    def _end(self, numbers: Sequence[int]) -> None:
        for number in numbers:
            if number in self._active:
                _, undo = self._active.pop(number)
                undo()

    def _planned(self, plan: PlannedFault) -> Callable[[], None]:
        def begin() -> None:
            with concerning(plan.robot or ""):
                try:
                    self.inject(plan.kind, plan.robot, duration=plan.duration, **plan.options)
                except (ValueError, RobotError) as error:
                    log.warning("cannot schedule fault %s: %s", plan.kind, error)

        return begin

    def _at(self, time: float, act: Callable[[], None]) -> None:
        heapq.heappush(self._agenda, (time, next(self._order), act))


def _options_of(kind: FaultRecipe) -> dict[str, float | int | str | None]:
    """Return names and defaults of a kind's options."""
    parameters = inspect.signature(kind.begin).parameters.items()
    return {name: parameter.default for name, parameter in parameters if name != "target"}


def _checked_options(kind: str, options: Mapping[str, object]) -> dict[str, object]:
    """Return a kind's options in the types of its function. Raises ValueError for one that it does not have, too."""
    types = get_type_hints(KINDS[kind].begin)
    known = [name for name in inspect.signature(KINDS[kind].begin).parameters if name != "target"]
    for name in options:
        if name not in known:
            has = ", ".join(known) or "none"
            raise ValueError(f"{kind} has no option {name!r}{meant(name, known)}; options: {has}")
    return {name: _checked(f"{kind}.{name}", value, types[name]) for name, value in options.items()}


def _checked(name: str, value: object, kind: type[T]) -> T:
    """Return a value as ``kind``. Raises ValueError if it is of another type, or not finite."""
    try:
        converted = msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise ValueError(why_invalid(error, field=name)) from None
    if isinstance(converted, float) and not math.isfinite(converted):
        raise ValueError(f"{name} must be finite, not {converted}")
    return converted


def problem_of(plan: PlannedFault) -> str | None:
    """Return the error in a planned fault in plain words; None: there is none."""
    if plan.kind not in KINDS:
        return f"no fault is called {plan.kind!r}{meant(plan.kind, KINDS)}"
    try:
        _checked_options(plan.kind, plan.options)
    except ValueError as error:
        return str(error)
    return None
