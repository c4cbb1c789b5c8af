"""Requests of the wire as lines to copy: what they do is what the client did."""

from __future__ import annotations

import contextlib
import io
import shlex
import socket
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from roboglot.console.as_code import FORMS, copy
from roboglot.console.wire_log import WireLog, readable, rows
from roboglot.model.clock import LockstepClock
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.robot import Description, Robot
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols.door import Endpoint

REST = Endpoint("Slamware REST", "http://127.0.0.1:1448")
TEXT = Endpoint("RoboMaster text SDK", "tcp 127.0.0.1:40923")
DOG = Endpoint("CyberDog 2 gRPC", "127.0.0.1:50052", "grpcurl -cacert /x/ca.pem -proto p -d '{}' 127.0.0.1:50052 m")
PLATE = Description(maker="", model="", serial="", hardware_version="", software_version="", radius=0.2, height=0.3)


def request(door: str, operation: str, payload: bytes) -> Exchange:
    return Exchange(1.0, "a", door, "127.0.0.1:4711", f"{door} 127.0.0.1", Direction.REQUEST, operation, payload)


def printed(program: str) -> str:
    """Run a copied program."""
    with contextlib.redirect_stdout(io.StringIO()) as said:
        exec(compile(program, "copied", "exec"), {})
    return said.getvalue()


def test_rest_becomes_curl_with_its_body() -> None:
    asked = request("slamware", "POST /x", b'POST /api/x?y=1\n\n{"it\'s": "quoted"}')
    words = shlex.split(copy(asked, "curl", REST))
    assert words[:4] == ["curl", "-sS", "-X", "POST"]
    assert words[-2:] == ['{"it\'s": "quoted"}', "http://127.0.0.1:1448/api/x?y=1"]


def test_curl_reads_no_file_and_expands_nothing() -> None:
    """A body ``@FILE`` would send that file, and brackets in a path would become many requests."""
    words = shlex.split(copy(request("slamware", "POST /x", b"POST /x/[1-9999999]\n\n@/etc/passwd"), "curl", REST))
    assert words[words.index("@/etc/passwd") - 1] == "--data-raw"
    assert "--globoff" in words


def test_text_becomes_netcat_in_sdk_mode() -> None:
    line = copy(request("robomaster", "chassis move", b"chassis move x 0.5"), "nc", TEXT)
    assert line == "printf '%s' 'command;chassis move x 0.5;' | nc -w 5 127.0.0.1 40923"


def test_grpc_becomes_grpcurl_with_the_robots_certificates() -> None:
    words = shlex.split(copy(request("cyberdog", "1002", b'{"motion_id": 1}'), "grpcurl", DOG))
    assert words[:3] == ["grpcurl", "-cacert", "/x/ca.pem"]
    assert words[words.index("-d") + 1] == '{"nameCode": 1002, "params": "{\\"motion_id\\": 1}"}'


@pytest.mark.parametrize("door", FORMS)
def test_python_copies_compile_for_hostile_payloads(door: str) -> None:
    operation = "1002" if door == "cyberdog" else "x"
    for payload in (b"GET /\n\n", b"'''\"\"\"\\\n\x00", "前进".encode(), b"\xff\xfe"):
        compile(copy(request(door, operation, payload), "python", DOG), "copied", "exec")


def test_replies_cannot_be_sent_again() -> None:
    reply = request("slamware", "GET /x", b"{}")._replace(direction=Direction.REPLY)
    with pytest.raises(InvalidGoal):
        copy(reply, "curl", REST)


async def test_the_log_is_silent_until_opened_and_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roboglot.console.wire_log.WIRE_BYTES_MAX", 1000)
    robot = Robot("a", PLATE, LockstepClock())
    log = WireLog(robot)
    assert not robot.tap.watched
    log.open()
    for number in range(50):
        robot.tap.request("slamware", "GET /x", b"x" * 100 + b"%d" % number)
    kept = log.after(0, 1000)
    assert [entry.number for entry in kept] == list(range(42, 51))
    assert log.get(50).payload.endswith(b"49")
    with pytest.raises(NotFound):
        log.get(1)
    assert rows(log.after(49, 10))[0][:3] == [50, 0.0, "slamware"]
    log.close()
    log.end()
    assert not robot.tap.watched


def test_binary_bytes_are_shown_as_hexadecimal() -> None:
    assert readable(b"\x00\xff") == "00 ff"
    assert readable("ok;\n好".encode()) == "ok;\n好"


def test_copied_python_prints_answer_of_the_command_itself() -> None:
    with socket.create_server(("127.0.0.1", 0)) as door:

        def serve() -> None:
            line, _ = door.accept()
            with line:
                line.recv(100)
                line.sendall(b"ok;")
                line.sendall(b"90;")

        thread = threading.Thread(target=serve)
        thread.start()
        here = Endpoint("RoboMaster text SDK", f"tcp 127.0.0.1:{door.getsockname()[1]}")
        assert printed(copy(request("robomaster", "robot battery ?", b"robot battery ?"), "python", here)) == "ok;90;\n"
        thread.join()


def test_copied_python_prints_refusals() -> None:
    server = HTTPServer(("127.0.0.1", 0), BaseHTTPRequestHandler)  # without do_GET: 501
    thread = threading.Thread(target=server.handle_request)
    thread.start()
    here = Endpoint("Slamware REST", f"http://127.0.0.1:{server.server_port}")
    assert printed(copy(request("slamware", "", b"GET /nothing\n\n"), "python", here)).startswith("501 ")
    thread.join()
    server.server_close()


def test_copied_python_trusts_robots_certificate_by_its_name() -> None:
    tool = "grpcurl -cacert '/a b/ca' -cert /a/cert -key /a/key -authority cyberdog2.server -proto p -d '{}' h:1 m"
    proven = copy(request("cyberdog", "1002", b"{}"), "python", Endpoint("CyberDog 2 gRPC", "h:1", tool))
    assert "['/a b/ca', '/a/key', '/a/cert']" in proven
    assert "('grpc.ssl_target_name_override', 'cyberdog2.server')" in proven
    plain = Endpoint("CyberDog 2 gRPC", "h:1", "grpcurl -plaintext -d '{}' h:1 m")
    assert "insecure_channel('h:1')" in copy(request("cyberdog", "1002", b"{}"), "python", plain)
