"""A program that hangs or dies while it drives loses its EP's connection; one that rests, or parts, keeps its own."""

import asyncio
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator

import pytest

from roboglot.drivers.robomaster.watchdog import Watchdog

PROGRAM = """
import asyncio, socket, sys
from roboglot.drivers.robomaster.watchdog import Watchdog

async def main():
    robot = socket.create_connection(("127.0.0.1", int(sys.argv[1])))
    Watchdog().watch(robot.fileno(), lambda: sys.argv[2] == "drives")
    await asyncio.sleep(0.3)
    robot.sendall(b"!")
    await asyncio.sleep(60)

asyncio.run(main())
"""
PATIENCE = 60  # s, on a busy machine


@pytest.fixture
def robot() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(PATIENCE)
        yield server


def started(robot: socket.socket, doing: str) -> tuple[subprocess.Popen[bytes], socket.socket]:
    program = subprocess.Popen([sys.executable, "-c", PROGRAM, str(robot.getsockname()[1]), doing])
    connection, _ = robot.accept()
    connection.settimeout(PATIENCE)
    assert connection.recv(1) == b"!"
    return program, connection


@pytest.mark.parametrize("blow", [signal.SIGSTOP, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)])
def test_program_that_hangs_or_dies_loses_its_connection(robot: socket.socket, blow: int) -> None:
    program, connection = started(robot, "drives")
    try:
        os.kill(program.pid, blow)
        assert connection.recv(1) == b""
    finally:
        program.kill()
        program.wait()
        connection.close()


def test_a_program_at_rest_may_be_stopped(robot: socket.socket) -> None:
    program, connection = started(robot, "rests")
    try:
        os.kill(program.pid, signal.SIGSTOP)
        connection.settimeout(1.0)
        with pytest.raises(TimeoutError):
            connection.recv(1)
        program.kill()  # its death is noticed all the same
        connection.settimeout(PATIENCE)
        assert connection.recv(1) == b""
    finally:
        program.kill()
        program.wait()
        connection.close()


async def test_unwatched_connection_ends_as_any_other(robot: socket.socket) -> None:
    watchdog = Watchdog()
    with socket.create_connection(robot.getsockname()) as near:
        far, _ = robot.accept()
        forget = watchdog.watch(near.fileno(), lambda: True)
        await asyncio.sleep(0.6)
        near.sendall(b"alive")
        far.settimeout(PATIENCE)
        assert far.recv(5) == b"alive"
        forget()
    with far:
        assert await asyncio.to_thread(far.recv, 1) == b""
