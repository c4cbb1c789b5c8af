"""Decoding of messages for gRPC, whose own answer to malformed bytes is an error of Python and its traceback."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from google.protobuf.message import DecodeError

M = TypeVar("M")


def reading(decode: Callable[[bytes], M]) -> Callable[[bytes], M | None]:
    """Return a decoder that returns None for bytes that are not such a message, or whose text is not UTF-8."""

    def read(data: bytes) -> M | None:
        try:
            return decode(data)
        except DecodeError:
            return None

    return read
