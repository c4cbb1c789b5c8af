"""Things with a Bluetooth radio in the world, like bracelets and docks: places and states; no robot's view."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.model.errors import NotFound
from roboglot.model.geometry import STILL, Point, Twist
from roboglot.simulation.people.people import Walker
from roboglot.simulation.radio.radio import Radio
from roboglot.simulation.world.description import Gadget, WorldDescription
from roboglot.values import dataclass


@dataclass(slots=True)
class GadgetInWorld:
    """Present state of a gadget; ``on``: its radio; ``stick``: position of a remote control's stick, axes -1..1."""

    gadget: Gadget
    floor: int
    place: Point
    wearer: Walker | None
    firmware: str
    battery: float
    on: bool = True
    stick: Twist = STILL
    presses: int = 0  # of the gear button so far

    def steer(self, forward: float = 0.0, left: float = 0.0, turn: float = 0.0) -> None:
        """Hold the stick at this position; without values, release it. Raises ValueError beyond -1..1."""
        if not all(-1.0 <= axis <= 1.0 for axis in (forward, left, turn)):
            raise ValueError("a stick's axes go from -1 to 1")
        self.stick = Twist(forward, left, turn)

    def press_gear(self) -> None:
        """Press the gear button: one gear up, from the highest to the lowest."""
        self.presses += 1

    @property
    def at(self) -> Point:
        """Place of the gadget or its wearer (world, m)."""
        return self.wearer.pose.point if self.wearer else self.place

    @property
    def heard(self) -> bool:
        """True if the radio sends."""
        return self.on and self.battery > 0.0


class Gadgets:
    """All gadgets of a world, by address."""

    def __init__(self, world: WorldDescription, walkers: Sequence[Walker], radio: Radio) -> None:
        self.radio = radio
        self._all: dict[str, GadgetInWorld] = {}
        for number, floor in enumerate(world.floors):
            people = [walker for walker in walkers if walker.floor == number]
            for gadget in floor.gadgets:
                wearer = None if gadget.wearer is None else people[gadget.wearer]
                self._all[gadget.address] = GadgetInWorld(
                    gadget, number, Point(*gadget.at), wearer, gadget.firmware, gadget.battery
                )

    def all(self) -> Sequence[GadgetInWorld]:
        """Return all gadgets, on or off."""
        return tuple(self._all.values())

    def get(self, address: str) -> GadgetInWorld:
        """Return a gadget by its address. Raises NotFound."""
        try:
            return self._all[address]
        except KeyError:
            raise NotFound(f"no gadget has the address {address}") from None

    def signal(self, gadget: GadgetInWorld, at: Point, floor: int) -> float:
        """Return a gadget's signal at a place, dBm; -200 if it is off."""
        if not gadget.heard:
            return -200.0
        return self.radio.heard(gadget.at, gadget.gadget.power, gadget.floor, at, floor)
