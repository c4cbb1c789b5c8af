"""The people of a world by name, directed by tests and consoles."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import msgspec

from roboglot.model.geometry import Pose
from roboglot.model.perception import Emotion, Gesture, Sport
from roboglot.model.stage import StagePerson
from roboglot.simulation.building.blueprint import Solid, person_solid
from roboglot.simulation.people.people import Walker
from roboglot.simulation.people.routine import Clap, Exercise, Feel, Look, Say, Show, Step, Wait, Walk

S = TypeVar("S", bound=msgspec.Struct)


class Actor(StagePerson):
    """One person. Orders are carried out one after the other; then the person stands, until ``resume``.

    All methods raise ValueError for values that a world's file may not have. ``check_clear`` raises Refused if a robot
    stands where a solid is put on a floor.
    """

    def __init__(self, walker: Walker, check_clear: Callable[[Solid, int], None]) -> None:
        self._walker, self._check_clear = walker, check_clear

    @property
    def pose(self) -> Pose:
        return self._walker.pose

    @property
    def floor(self) -> int:
        return self._walker.floor

    @property
    def doing(self) -> Step | None:
        """Current step of the script; None while they stand."""
        return self._walker.doing

    @property
    def face(self) -> bytes:
        """Faceprint, for ``Members.set_face``."""
        return self._walker.face

    @property
    def voice(self) -> bytes:
        """Voiceprint, for ``Members.set_voice``."""
        return self._walker.voice

    def walk_to(self, x: float, y: float, *, speed: float | None = None) -> None:
        self._order(Walk((x, y), speed))

    def look_at(self, x: float, y: float) -> None:
        self._order(Look((x, y)))

    def gesture(self, gesture: Gesture, seconds: float = 3.0) -> None:
        self._order(Show(gesture, seconds))

    def say(self, text: str) -> None:
        self._order(Say(text))

    def clap(self, count: int = 2) -> None:
        self._order(Clap(count))

    def do_sport(self, sport: Sport, count: int = 10, period: float = 2.0) -> None:
        self._order(Exercise(sport, count, period))

    def feel(self, emotion: Emotion) -> None:
        self._order(Feel(emotion))

    def wait(self, seconds: float) -> None:
        self._order(Wait(seconds))

    def stand(self) -> None:
        self._walker.drop()

    def resume(self) -> None:
        self._walker.resume()

    def place(self, x: float, y: float, facing: float = 0.0) -> None:
        if not all(map(math.isfinite, (x, y, facing))):
            raise ValueError("a place must have finite coordinates")
        pose = Pose(x, y, math.radians(facing))
        self._check_clear(person_solid(self._walker.person, pose), self._walker.floor)
        self._walker.drop()
        self._walker.place(pose)

    def _order(self, step: Step) -> None:
        self._walker.order(_checked(step))


def _checked(step: S) -> S:
    """Return the step, validated by its type. Raises ValueError."""
    return msgspec.convert(msgspec.to_builtins(step), type(step))
