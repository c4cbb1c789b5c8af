"""Keeps what was computed from a world's description, for worlds that are reset, opened again or shared."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import ParamSpec, TypeVar, cast

P = ParamSpec("P")
T = TypeVar("T")
WORLDS_MAX = 8  # whose results are kept


def kept(most: int) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Return a decorator that keeps the latest ``most`` results, but not those of unhashable descriptions.

    Such are made by hand, with lists.
    """

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        keeping = cast(Callable[P, T], lru_cache(most)(function))

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> T:
            try:
                hash((*args, *kwargs.values()))
            except TypeError:
                return function(*args, **kwargs)
            return keeping(*args, **kwargs)

        return call

    return decorate
