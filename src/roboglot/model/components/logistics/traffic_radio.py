"""A radio by which robots announce which places they occupy."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection

from roboglot.model.components.component import Component

CLAIMS_MAX = 200
CLAIM_MAX = 100  # characters


class TrafficRadio(Component):
    """What a robot claims is heard by all others in range until it claims something else."""

    @property
    @abstractmethod
    def claims(self) -> frozenset[str]:
        """What this robot claims."""

    @abstractmethod
    def claim(self, names: Collection[str]) -> None:
        """Claim these and nothing else. Raises InvalidGoal for more or longer ones than the radio carries."""

    @abstractmethod
    def others(self, name: str) -> int:
        """How many robots in range claim this, but for this one."""
