"""The clients' errors as the model's. What a refusal means is each driver's own affair."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from roboglot.clients.errors import ClientError, LinkLost
from roboglot.model.errors import RobotError, Unconnected


@contextmanager
def model_errors(translated: Callable[[ClientError], RobotError | None]) -> Iterator[None]:
    """``translated``: the model's error for one of the client's; None: nothing special about it."""
    try:
        yield
    except LinkLost as error:
        raise Unconnected(str(error)) from None
    except ClientError as error:
        raise translated(error) or RobotError(str(error)) from None
