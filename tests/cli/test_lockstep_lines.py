"""Lines that advance a lockstep clock: they come by a pipe, or from a file."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from roboglot.cli.up import LINE_MAX, lines_of

TEXT = b"1\n" + b"9" * (LINE_MAX + 1) + b"\n 0.5\n"
LINES = ["1", "(a line that is too long)", "0.5"]


@pytest.mark.asyncio
async def test_lines_of_a_file_are_read(tmp_path: Path) -> None:
    file = tmp_path / "steps"
    file.write_bytes(TEXT)
    assert [line async for line in lines_of(os.open(file, os.O_RDONLY))] == LINES


@pytest.mark.asyncio
async def test_lines_of_a_pipe_are_read() -> None:
    reading, writing = os.pipe()
    os.write(writing, TEXT)
    os.close(writing)
    assert [line async for line in lines_of(reading)] == LINES


@pytest.mark.asyncio
async def test_nothing_is_read_without_input() -> None:
    assert [line async for line in lines_of(os.open(os.devnull, os.O_RDONLY))] == []
    closed, other = os.pipe()
    os.close(closed)
    os.close(other)
    assert [line async for line in lines_of(closed)] == []
