"""Lines that advance a lockstep clock: they come by a pipe, or from a file."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from roboglot.cli.up import FILE_MAX, LINE_MAX, lines_of

TEXT = b"1\n" + b"9" * (LINE_MAX + 1) + b"\n 0.5\n"
LINES = ["1", "(a line that is too long)", "0.5"]
PROCESS = """
from roboglot.__main__ import hold_standard_files
hold_standard_files()
import os, uvloop
from roboglot.cli import up
async def main():
    print([line async for line in up.lines_of(0)], os.path.exists("/proc/self/fd/0"))
uvloop.run(main())
"""


@pytest.mark.asyncio
async def test_lines_of_a_file_are_read(tmp_path: Path) -> None:
    file = tmp_path / "steps"
    file.write_bytes(TEXT)
    assert [line async for line in lines_of(os.open(file, os.O_RDONLY))] == LINES


@pytest.mark.slow  # in short: test_standard_input_of_any_kind_aborts_no_loop
@pytest.mark.asyncio
async def test_too_long_file_is_refused_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "steps"
    file.write_bytes(b"1\n" * (FILE_MAX // 2))
    assert len([line async for line in lines_of(os.open(file, os.O_RDONLY))]) == FILE_MAX // 2
    file.write_bytes(b"1\n" * (FILE_MAX // 2) + b"1\n")
    assert [line async for line in lines_of(os.open(file, os.O_RDONLY))] == []
    assert "use a pipe" in capsys.readouterr().err


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


@pytest.mark.parametrize(
    ("given", "lines"),
    [
        ("< /dev/null", []),
        pytest.param("< {file}", LINES, marks=pytest.mark.slow),
        ("< <(cat {file})", LINES),
        pytest.param("<&-", [], marks=pytest.mark.slow),
        ("<&- >&2 2>&-", []),
    ],
)
def test_standard_input_of_any_kind_aborts_no_loop(given: str, lines: list[str], tmp_path: Path) -> None:
    """A socket with its number, if it were closed or never open, would abort uvloop or stay open for good."""
    file = tmp_path / "steps"
    file.write_bytes(TEXT)
    command = f"{shlex.quote(sys.executable)} -c {shlex.quote(PROCESS)} {given.format(file=shlex.quote(str(file)))}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert (done.stdout or done.stderr) == f"{lines} True\n"
