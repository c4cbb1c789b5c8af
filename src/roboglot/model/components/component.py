"""The root of all component interfaces."""

from abc import ABC


class Component(ABC):  # noqa: B024 - what they share is being a component
    """A part of a robot, real, simulated or made of other parts."""
