"""Levels of the model's errors in ``/rosout``, as topics have no answers."""

from __future__ import annotations

import logging

from roboglot.model.errors import Busy, Refused, RobotError

LEVELS: dict[type[RobotError], int] = {
    Busy: logging.WARNING,
    Refused: logging.WARNING,
    RobotError: logging.ERROR,
}


def level_of(error: RobotError) -> int:
    """Return the level of ``error``, by its nearest ancestor in the table; rcl's levels are Python's."""
    return next(LEVELS[kind] for kind in type(error).__mro__ if kind in LEVELS)
