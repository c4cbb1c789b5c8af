"""The robot's radio."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component


class Network(Component):
    """What the robot's Wi-Fi card says."""

    @property
    @abstractmethod
    def signal(self) -> float:
        """Received strength in dBm (about -30 near the access point, -90 at the edge)."""
