"""Translates errors of clients into errors of the model; each driver maps its own refusals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from roboglot.clients.errors import ClientError, LinkLost
from roboglot.model.errors import RobotError, Unconnected


@contextmanager
def model_errors(translated: Callable[[ClientError], RobotError | None]) -> Iterator[None]:
    """Raise client errors as model errors. ``translated`` returns None for errors without a special meaning."""
    try:
        yield
    except LinkLost as error:
        raise Unconnected(str(error)) from None
    except ClientError as error:
        raise translated(error) or RobotError(str(error)) from None


def plain_errors() -> AbstractContextManager[None]:
    """Raise client errors as model errors, for drivers of robots whose refusals have no special meanings."""
    return model_errors(lambda _: None)
