"""Narrowing of types, for tests that know more about a value than its type says."""

from __future__ import annotations

from typing import TypeVar

T = TypeVar("T")


def of_kind(value: object, kind: type[T]) -> T:
    """Return ``value``, which has to be of that kind."""
    assert isinstance(value, kind)
    return value


def known(value: T | None) -> T:
    """Return ``value``, which has to be there."""
    assert value is not None
    return value
