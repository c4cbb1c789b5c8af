"""A robot: description, components, actions, events. All that a door sees."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field
from typing import TypeVar

from roboglot.model.actions import Actions
from roboglot.model.admission import Admission
from roboglot.model.clock import Clock
from roboglot.model.components.component import Component
from roboglot.model.components.motion.actuators import Actuators
from roboglot.model.components.system.starts import Starts
from roboglot.model.errors import ComponentMissing
from roboglot.model.events import EventStream
from roboglot.model.inputs.external import ExternalInputs
from roboglot.model.inputs.fairness import Fairness
from roboglot.model.responder import Responder
from roboglot.model.tap import Tap
from roboglot.values import dataclass

C = TypeVar("C", bound=Component)


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """Description on the name plate."""

    maker: str
    model: str
    serial: str
    hardware_version: str
    software_version: str
    radius: float  # m: radius of the circle around base_link that contains the hull
    height: float  # m


@dataclass(slots=True)
class Robot:
    """``robot[Base]`` returns the component or raises ``ComponentMissing``; ``Base in robot`` checks for it."""

    id: str
    description: Description
    clock: Clock
    events: EventStream = field(default_factory=EventStream)
    actions: Actions = field(init=False)
    actuators: Actuators = field(init=False)
    starts: Starts = field(init=False)
    tap: Tap = field(init=False)
    inputs: ExternalInputs = field(init=False)
    admission: Admission = field(default_factory=Admission)
    fairness: Fairness | None = None  # shared by all robots of a program; None: clients never wait
    responder: Responder | None = None  # answers requests in the robot's place
    _components: dict[type[Component], Component] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.actions = Actions(self.clock, self.events)
        self.actuators = Actuators(self.actions)
        self.starts = Starts(self.events)
        self.tap = Tap(self.id, self.clock)
        self.inputs = ExternalInputs(self.id, self.clock)

    def add(self, interface: type[C], component: C) -> C:
        """Add a component; at most one per interface."""
        if interface in self._components:
            raise ValueError(f"{self.id} has a {interface.__name__} already")
        self._components[interface] = component
        return component

    def withdraw(self, interface: type[Component]) -> None:
        """Remove a component that the robot turned out not to have, if present."""
        self._components.pop(interface, None)

    def __getitem__(self, interface: type[C]) -> C:
        try:
            return self._components[interface]  # type: ignore[return-value]
        except KeyError:
            raise ComponentMissing(interface) from None

    def require(self, *interfaces: type[Component]) -> None:
        """Raise ComponentMissing for the first of these that the robot lacks."""
        for interface in interfaces:
            self[interface]

    def __contains__(self, interface: type[Component]) -> bool:
        return interface in self._components

    @property
    def interfaces(self) -> Iterable[type[Component]]:
        """Return the component interfaces that the robot has."""
        return self._components.keys()
