"""The robot's radio."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component


class Network(Component):
    """What the robot's Wi-Fi card says."""

    signal_min: float = -88.0  # dBm below which no connection holds
    delay: float = 0.0  # s by which everything that the robot sends comes late, now

    @property
    def connected(self) -> bool:
        """Whether the signal is strong enough to reach anybody."""
        return self.signal >= self.signal_min

    @property
    @abstractmethod
    def signal(self) -> float:
        """Received strength in dBm (about -30 near the access point, -90 at the edge)."""
