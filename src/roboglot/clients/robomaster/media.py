"""The video and audio ports at the client's end: pictures as H.264 access units, sound as Opus packets, undecoded."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

from roboglot.clients.errors import BadAnswer, LinkLost, TimedOut
from roboglot.clients.robomaster.control import CONNECT_SECONDS_MAX, keep_asking
from roboglot.model.clock import Clock
from roboglot.wire.robomaster.annexb import AccessUnit, AccessUnitSplitter

READ_MAX = 65536  # bytes at a time


async def access_units(clock: Clock, host: str, port: int) -> AsyncIterator[AccessUnit]:
    """Pictures from the first keyframe on, until the robot hangs up (LinkLost)."""
    splitter, begun = AccessUnitSplitter(), False
    async for data in _chunks(clock, host, port):
        try:
            for unit in splitter.feed(data):
                begun = begun or unit.keyframe
                if begun:
                    yield unit
        except ValueError as error:
            raise BadAnswer(str(error)) from None


async def opus_packets(clock: Clock, host: str, port: int) -> AsyncIterator[bytes]:
    """20 ms of mono sound at 48 kHz each, until the robot hangs up (LinkLost).

    Packets have no delimiters, but the robot writes each at once. Data that arrived together is cut where the
    pieces have the size of the smallest packet so far and its first byte.
    """
    size = READ_MAX
    async for data in _chunks(clock, host, port):
        size = min(size, len(data))
        pieces = [data[at : at + size] for at in range(0, len(data), size)]
        if len(pieces[-1]) == size and all(piece[0] == data[0] for piece in pieces):
            for piece in pieces:
                yield piece
        else:
            yield data


async def _chunks(clock: Clock, host: str, port: int) -> AsyncIterator[bytes]:
    try:
        reader, writer = await clock.wait_for(asyncio.open_connection(host, port), CONNECT_SECONDS_MAX)
    except TimeoutError:
        raise TimedOut(f"{host}:{port} does not answer") from None
    except OSError as error:
        raise LinkLost(f"{host}:{port} cannot be reached: {error.strerror or error}") from None
    keep_asking(writer.get_extra_info("socket"))
    try:
        while data := await reader.read(READ_MAX):
            yield data
        raise LinkLost(f"{host}:{port} ended the stream")
    except OSError as error:
        raise LinkLost(f"{host}:{port}: {error.strerror or error}") from None
    finally:
        writer.transport.abort()
