"""Asks every door of a roboglot on this machine for something real; scripts/image runs it in the image."""

from __future__ import annotations

import json
import socket
import ssl
import time
import urllib.request
from typing import Any

CONSOLE = "http://127.0.0.1:50080/api/robots/a/"


def ask(url: str, body: object = None) -> Any:
    """Return the JSON below ``url``; posts ``body`` where there is one."""
    data = None if body is None else json.dumps(body).encode()
    with urllib.request.urlopen(
        urllib.request.Request(url, data, {"content-type": "application/json"}), timeout=20
    ) as reply:
        return json.load(reply)


def slamware() -> str:
    """Ask the REST door where the robot is."""
    return str(ask("http://127.0.0.1:1448/api/core/slam/v1/localization/pose"))


def robomaster() -> str:
    """Enter the text door's SDK mode."""
    with socket.create_connection(("127.0.0.1", 40923), 5) as link:
        link.sendall(b"command;")
        reply = link.recv(64).decode()
    assert reply.startswith("ok"), reply
    return reply


def cyberdog() -> str:
    """Shake hands by TLS; without a client's certificate that is as far as it goes."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    with socket.create_connection(("127.0.0.1", 50052), 5) as link, context.wrap_socket(link) as secured:
        return str(secured.version())


def visual() -> str:
    """Open the WebSocket of block programs."""
    upgrade = "GET /programs HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    with socket.create_connection(("127.0.0.1", 50053), 5) as link:
        link.sendall(
            f"{upgrade}Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        reply = link.recv(256).decode().partition("\r\n")[0]
    assert " 101 " in reply, reply
    return reply


def program() -> str:
    """Run a block program in its jail."""
    run = ask(f"{CONSOLE}program", {"source": "print(6 * 7)\n"})
    for _ in range(100):
        run = ask(f"{CONSOLE}program")
        if run["state"] not in ("run", "run_wait"):
            break
        time.sleep(0.2)  # noqa: TID251 - outside of the robot
    assert "42" in json.dumps(run), run
    return str(run["state"])


for asked in (slamware, robomaster, cyberdog, visual, program):
    print(f"    {asked.__name__:12}{asked()}")  # noqa: T201 - its purpose
