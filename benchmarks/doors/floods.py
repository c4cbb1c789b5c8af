"""Claim: while one address floods the doors, others' requests take <= 20 ms longer at the 99th percentile.

Longer than while a process beside keeps a core as busy as the flood does. And memory is bounded.

Slow loris, half-open connections, TLS handshakes, 10,000 log-in tries, HTTP/2 rapid reset and, with OpenSSL's client,
TLS renegotiations and new keys, one after the other, from a separate process; another asks for the battery over the
text protocol and for the pose over REST all the while.

    scripts/bench floods [--count 10000]
"""

from __future__ import annotations

import argparse
import http.client
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from _claim import Claims

from roboglot.access.store import Grant, open_store
from roboglot.operations import Right
from roboglot.protocols.cyberdog.certificates import export_app
from roboglot.testing.process import served

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))
from tests.access.floods import BY_TOOLS, FLOODS, FRIEND, GATEWAY  # noqa: E402

ADDRESS = "127.0.98.1"
POSE = "/api/core/slam/v1/localization/pose"
QUIET_SECONDS = 5.0
FLOODED_SECONDS = 8.0  # s of each flood, restarted until then: enough requests for a percentile


def latencies(attack: subprocess.Popen[bytes] | None) -> list[float]:
    """ms of each request of a well-behaved client, until the attack is over (None: for a while)."""
    text = socket.create_connection((ADDRESS, 40923), 20, source_address=(FRIEND, 0))
    text.sendall(b"command;")
    text.recv(64)
    rest = http.client.HTTPConnection(ADDRESS, 1448, 20, source_address=(FRIEND, 0))
    spent: list[float] = []
    end = time.monotonic() + QUIET_SECONDS
    while attack.poll() is None if attack else time.monotonic() < end:
        began = time.perf_counter()
        text.sendall(b"robot battery ?;")
        text.recv(64)
        between = time.perf_counter()
        rest.request("GET", POSE)
        rest.getresponse().read()
        spent += [1000 * (between - began), 1000 * (time.perf_counter() - between)]
        time.sleep(0.002)
    text.close()
    rest.close()
    return sorted(spent)


def main(count: int) -> None:
    claims = Claims()
    with tempfile.TemporaryDirectory() as name:
        data, phone, config = Path(name) / "data", Path(name) / "phone", Path(name) / "robots.toml"
        store = open_store(data)
        store.allow(FRIEND, [Grant("a", frozenset({Right.DRIVE}))])
        store.add_app("phone", [Grant("a", frozenset({Right.SEE}))])
        store.close()
        export_app(data / "cyberdog", "phone", phone)
        config.write_text(f'[access]\nlocal = false\ngateway = "{ADDRESS}:{GATEWAY}"\n[access.tls]\n')
        options = ("--world", "empty", "--no-console", "--config", str(config))
        with served(data, *options, address=ADDRESS) as robot:
            time.sleep(QUIET_SECONDS)  # kernels are loaded
            with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as busy:
                quiet = latencies(None)
                busy.kill()
            usual = quiet[int(0.99 * len(quiet))]
            print(f"no flood, a core is busy: p99 {usual:.2f} ms of {len(quiet)} requests")
            for flood in (*FLOODS, *(BY_TOOLS if shutil.which("openssl") else ())):
                before = robot.resident_megabytes
                command = [sys.executable, "-m", "tests.access.floods", flood, ADDRESS, str(count), str(phone)]
                spent: list[float] = []
                until = time.monotonic() + FLOODED_SECONDS
                while not spent or time.monotonic() < until:
                    with subprocess.Popen(command, cwd=ROOT) as attack:
                        spent += latencies(attack)
                spent.sort()
                print(f"{flood}: {len(spent)} requests of others, median {spent[len(spent) // 2]:.2f} ms")
                longer = max(spent[int(0.99 * len(spent))] - usual, 0.01)
                claims.at_most(f"{flood}: p99 of others, more", longer, 20.0, "ms")
                claims.at_most(f"{flood}: memory", max(robot.resident_megabytes - before, 0.1), 60.0, "MB")
    claims.finish()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=10_000)
    main(parser.parse_args().count)
