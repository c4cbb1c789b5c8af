"""The console's robot in lockstep, for agents."""

from tests.console.conftest import shown

__all__ = ["shown"]
