"""Passwords, tokens and Wi-Fi keys are nowhere but where they were sent: a program is asked, then all is searched."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import httpx

from roboglot.access.store import Grant, open_store
from roboglot.operations import Right
from tests.access.matrix import ADDRESS

PASSWORD, GUESS, WIFI = "correct-horse-7731", "a-wrong-guess-4410", "the-wifi-key-9902"
NETWORK, SCREEN = "/api/core/system/v1/network/status", "/api/delivery/v1/admin/password"


def test_secrets_are_nowhere(tmp_path: Path) -> None:
    data = tmp_path / "data"
    store = open_store(data)
    token = store.add_machine("cell", [Grant("a", frozenset({Right.ADMIN}))])
    store.add_person("anna", PASSWORD, [Grant("a", frozenset({Right.SEE}))])
    store.close()
    config = tmp_path / "robots.toml"
    config.write_text("[access]\nlocal = false\n")
    command = [sys.executable, "-m", "roboglot", "up", "--verbose", "--no-console", "--world", "empty"]
    command += ["--address", ADDRESS, "--data", str(data), "--config", str(config)]
    with (tmp_path / "log").open("wb") as log:
        server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, stdin=subprocess.DEVNULL)
    connecting = None
    try:
        assert server.stdout is not None
        while server.stdout.readline() != b"ready\n":
            assert server.poll() is None, (tmp_path / "log").read_text()
        replies = ask(token)
        environment = {**os.environ, "ROBOGLOT_TOKEN": token, "XDG_CONFIG_HOME": str(tmp_path / "settings")}
        connect = [sys.executable, "-m", "roboglot", "connect", "127.0.0.1:9", "--once", "--robot", "a"]
        connecting = subprocess.Popen(connect, env=environment, stderr=subprocess.PIPE)
        listed = [path.read_bytes() for path in Path("/proc").glob("[0-9]*/cmdline") if readable(path)]
        said = connecting.communicate(timeout=180)[1]
    finally:
        server.terminate()
        server.communicate(timeout=180)
    kept = [
        path.read_bytes() for folder in (data, tmp_path / "settings") for path in folder.rglob("*") if path.is_file()
    ]
    log_text = (tmp_path / "log").read_bytes()
    assert b"PUT" in log_text, "the log is one of requests"
    for secret in (token, PASSWORD, GUESS):
        for place in (log_text, said, *replies, *listed, *kept):
            assert secret.encode() not in place
    for place in (log_text, *replies, *(each for each in kept if not each.startswith(b"SQLite format 3"))):
        assert WIFI.encode() not in place
    for path in data.glob("audit.db*"):
        assert WIFI.encode() not in path.read_bytes()


def readable(path: Path) -> bool:
    try:
        return bool(path.read_bytes())
    except OSError:  # it has ended
        return False


def ask(token: str) -> list[bytes]:
    """Everything that is answered to clients who are right and wrong about all that can be wrong."""
    bearer = {"authorization": f"Bearer {token}"}
    join = {"mode": "STA", "options": {"ssid": "plant", "password": WIFI}}
    with httpx.Client(base_url=f"http://{ADDRESS}:1448", verify=False) as client:
        replies = [
            client.get("/nothing", headers=bearer),
            client.get(SCREEN, auth=("anna", PASSWORD)),
            client.get(SCREEN, auth=("anna", GUESS)),
            client.get(SCREEN, auth=("cell", GUESS)),
            client.get(SCREEN, headers={"authorization": f"Bearer {GUESS}"}),
            client.get(SCREEN, headers={"authorization": GUESS}),
            client.put("/api/core/system/v1/network/status", json=join, headers=bearer),
            client.put("/api/core/system/v1/network/status", json={**join, "mode": 7}, headers=bearer),
            client.put("/api/core/system/v1/network/status", content=json.dumps(join)[:-3], headers=bearer),
            client.put(SCREEN, json={"enable": True, "password": WIFI}, headers=bearer),
            client.put(SCREEN, json={"enable": "x", "password": WIFI}, headers=bearer),
        ]
    assert {reply.status_code for reply in replies} >= {401, 403, 404, 400}
    return [reply.content for reply in replies]
