"""Reads text that anyone may have written: values too deep or too long for Python are ValueErrors in plain words."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeVar

import msgspec

T = TypeVar("T")


@contextmanager
def in_bounds() -> Iterator[None]:
    """Raise ValueError in plain words for text nested too deeply, or with a number of too many digits."""
    try:
        yield
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except ValueError as error:
        if "integer string conversion" in str(error):
            raise ValueError("a number has too many digits") from None
        raise


def parse_toml(text: str) -> dict[str, object]:
    """Return the values of a TOML document. Raises ValueError."""
    with in_bounds():
        return tomllib.loads(text)


def convert_toml(text: str, kind: type[T], *, strict: bool = True) -> T:
    """Return a TOML document as a value of a type. Raises ValueError, msgspec.ValidationError (which is one)."""
    return msgspec.convert(parse_toml(text), kind, strict=strict, str_keys=True)
