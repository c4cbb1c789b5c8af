"""The console's robot in lockstep, for agents."""

from tests.console.conftest import served

__all__ = ["served"]
