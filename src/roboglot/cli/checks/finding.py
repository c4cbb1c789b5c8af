"""Findings of a check of this machine."""

from __future__ import annotations

from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Finding:
    """One check: its name, True if all is well, the observation, and a remedy."""

    name: str
    well: bool
    seen: str
    remedy: str = ""
