"""Figures of benchmarks compared with their limits, as a ratio: 1 just meets the limit, more is better."""

from __future__ import annotations

import sys


class Claims:
    """Collect figures; ``finish`` ends the program with status 1 if a claim was missed."""

    def __init__(self) -> None:
        self._missed: list[str] = []

    def at_most(self, name: str, value: float, limit: float, unit: str) -> None:
        """A figure that should be small."""
        self._print(name, value, limit, unit, float("inf") if value <= 0 else limit / value, "<=")

    def at_least(self, name: str, value: float, limit: float, unit: str) -> None:
        """A figure that should be large."""
        self._print(name, value, limit, unit, value / limit if limit > 0 else float("inf"), ">=")

    def _print(self, name: str, value: float, limit: float, unit: str, ratio: float, sign: str) -> None:
        holds = ratio >= 1  # not so if a figure is not a number
        verdict = "holds" if holds else "MISSED"
        print(f"{name:36} {value:9.2f} {unit:12} claim {sign} {limit:<8g} ratio {ratio:5.2f}  {verdict}", flush=True)
        if not holds:
            self._missed.append(name)

    def finish(self) -> None:
        """Print whether all claims held."""
        sys.exit(f"missed: {', '.join(self._missed)}" if self._missed else 0)
