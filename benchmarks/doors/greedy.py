"""Claim: one client that asks as fast as it can costs the others <= 20 ms at the 99th percentile.

Ten robots in one program, each asked for its pose over REST and its mode over text ten times a second; then clients in
separate processes send requests without a pause, each over another door: REST, text (a thousand at a time), block
programs, Foxglove, VDA 5050, and the console's interface.

    scripts/bench greedy [--robots 10] [--seconds 8]
"""

from __future__ import annotations

import argparse
import http.client
import itertools
import json
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import paho.mqtt.client as mqtt
from _claim import Claims
from paho.mqtt.enums import CallbackAPIVersion
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from roboglot.testing.process import served

ADDRESS = "127.0.97.1"
POSE = "/api/core/slam/v1/localization/pose"
MODE = b"robot mode ?;"
AT_ONCE = 1000
CONSOLE, BROKER = 50080, 1883
PARAMETERS = '{"op": "getParameters", "parameterNames": ["robot.name"], "id": "1"}'
PERIOD = 0.1  # s


def ask(address: str, end: float, spent: list[float]) -> None:
    """Ask one robot ten times a second; append ms of each answer."""
    text = socket.create_connection((address, 40923), 20)
    text.sendall(b"command;")
    text.recv(64)
    rest = http.client.HTTPConnection(address, 1448, timeout=20)
    while (now := time.perf_counter()) < end:
        text.sendall(MODE)
        text.recv(64)
        between = time.perf_counter()
        rest.request("GET", POSE)
        rest.getresponse().read()
        spent += [1000 * (between - now), 1000 * (time.perf_counter() - between)]
        time.sleep(max(0.0, now + PERIOD - time.perf_counter()))


def others(count: int, seconds: float) -> float:
    """Return the 99th percentile of all robots' answers, in ms."""
    spent: list[float] = []
    base, end = ADDRESS.rpartition(".")[0], time.perf_counter() + seconds
    threads = [threading.Thread(target=ask, args=(f"{base}.{n + 1}", end, spent)) for n in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    spent.sort()
    print(f"  {len(spent)} answers, median {spent[len(spent) // 2]:.2f} ms, p99 {spent[int(0.99 * len(spent))]:.2f} ms")
    return spent[int(0.99 * len(spent))]


def greed_rest(port: int = 1448, path: str = POSE) -> None:
    """Ask over HTTP."""
    rest = http.client.HTTPConnection(ADDRESS, port, timeout=20)
    while True:
        rest.request("GET", path)
        rest.getresponse().read()


def greed_text() -> None:
    """Ask over text."""
    text = socket.create_connection((ADDRESS, 40923), 20)
    text.sendall(b"command;")
    text.recv(64)
    while True:
        text.sendall(MODE * AT_ONCE)
        left = AT_ONCE
        while left > 0:
            left -= text.recv(1 << 16).count(b";")


def greed_websocket(url: str, message: str, *subprotocols: str) -> None:
    """Ask over a WebSocket, sixteen at a time, as many as the server has in progress."""
    with connect(url, subprotocols=[Subprotocol(name) for name in subprotocols] or None, max_size=None) as link:
        while True:
            for _ in range(16):
                link.send(message)
            for _ in range(16):
                while "parameterValues" not in (text := str(link.recv())) and '"runs"' not in text:
                    pass


def greed_orders(broker: int) -> None:
    """Ask for the state over MQTT."""
    client = mqtt.Client(CallbackAPIVersion.VERSION2)
    client.connect(ADDRESS, broker)
    client.loop_start()
    for number in itertools.count():
        action = {"actionType": "stateRequest", "actionId": str(number), "blockingType": "NONE"}
        head = {"headerId": number, "timestamp": "2026-01-01T00:00:00.000Z", "version": "3.0.0"}
        sent = {**head, "manufacturer": "roboglot", "serialNumber": "a", "actions": [action]}
        client.publish("uagv/v3/roboglot/a/instantActions", json.dumps(sent), qos=1).wait_for_publish(20)


GREED: dict[str, Callable[[], None]] = {
    "rest": greed_rest,
    "text": greed_text,
    "console": lambda: greed_rest(CONSOLE, "/api/robots"),
    "programs": lambda: greed_websocket(f"ws://{ADDRESS}:50053/runs", "?"),
    "foxglove": lambda: greed_websocket(f"ws://{ADDRESS}:8765", PARAMETERS, "foxglove.sdk.v1"),
    "vda5050": lambda: greed_orders(BROKER),
}


@contextmanager
def broker(folder: Path) -> Iterator[list[str]]:
    """Run mosquitto, if it is there; the options of the robot."""
    program = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin")
    if program is None:
        print("  without VDA 5050: mosquitto is not there")
        yield []
        return
    (folder / "conf").write_text(f"listener {BROKER} {ADDRESS}\nallow_anonymous true\n")
    with subprocess.Popen([program, "-c", str(folder / "conf")], stderr=subprocess.DEVNULL) as process:
        yield ["--vda5050", f"{ADDRESS}:{BROKER}"]
        process.terminate()


def main(count: int, seconds: float) -> None:
    claims = Claims()
    robots = [option for n in range(1, count) for option in ("--robot", f"r{n}=universal")]
    with tempfile.TemporaryDirectory() as name, broker(Path(name)) as options:
        settings = Path(name) / "settings.toml"
        settings.write_text(f'[console]\naddress = "{ADDRESS}"\nport = {CONSOLE}\n[vda5050]\nserials = {{a = "a"}}\n')
        started = ("--config", str(settings), *options, *robots)
        with served(Path(name) / "data", *started, address=ADDRESS) as robot:
            time.sleep(8)  # kernels are loaded
            usual = others(count, seconds)
            for doors in (["rest", "text"], ["console"], ["programs"], ["foxglove"], ["vda5050"][: len(options)]):
                greedy = [subprocess.Popen([sys.executable, __file__, "--greed", door]) for door in doors]
                slowed = others(count, seconds)
                for process in greedy:
                    assert process.poll() is None, f"{doors} stopped asking"
                    process.kill()
                    process.wait()
                if doors:
                    claims.at_most(f"p99 of others, more: {' and '.join(doors)}", max(slowed - usual, 0.01), 20.0, "ms")
            named = robot.data.with_name("data.log").read_text().count("waits for others")
    print(f"{named} log lines on clients that waited")
    claims.finish()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--greed", choices=tuple(GREED))
    chosen = parser.parse_args()
    if chosen.greed:
        GREED[chosen.greed]()
    else:
        main(chosen.robots, chosen.seconds)
