"""``roboglot connect`` as people call it: a process beside the vendor's client, another with the robots."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import urllib.request
from ipaddress import IPv4Network, ip_address
from pathlib import Path

import pytest
from typer.testing import CliRunner

from roboglot.access.store import Grant, open_store
from roboglot.cli import loaded
from roboglot.cli.connect import addresses
from roboglot.operations import Right
from roboglot.testing.addresses import free_addresses, free_port
from roboglot.testing.process import served

ROBOTS, GATEWAY = free_addresses(2), f"{free_addresses(1)}:{free_port()}"
RANGE = IPv4Network((int(ip_address(free_addresses(7))) + 3 & ~3, 30))  # begins at a multiple of 4
HERE, SECOND = map(str, RANGE.hosts())
POSE = "api/core/slam/v1/localization/pose"


@pytest.mark.slow
def test_robots_of_gateway_are_on_addresses_of_range(tmp_path: Path) -> None:
    data, config, known = tmp_path / "data", tmp_path / "robots.toml", tmp_path / "settings"
    store = open_store(data)
    token = store.add_machine("cell", [Grant("*", frozenset({Right.SEE}))])
    store.close()
    config.write_text(f'[access]\nlocal = false\ngateway = "{GATEWAY}"\n')
    options = ("--world", "empty", "--no-console", "--config", str(config), "--robot", "b=robomaster_ep")
    with served(data, *options, address=ROBOTS):
        doctor = [
            sys.executable,
            "-m",
            "roboglot",
            "doctor",
            "--security",
            "--data",
            str(data),
            "--config",
            str(config),
        ]
        seen = subprocess.run(doctor, capture_output=True, text=True, timeout=180, check=False).stdout
        [shown] = [line.split()[-1] for line in seen.splitlines() if "gateway certificate" in line]
        assert "open now, by" in seen
        command = [sys.executable, "-m", "roboglot", "connect", GATEWAY, "--robot", "a", "--robot", "b"]
        environment = {**os.environ, "ROBOGLOT_TOKEN": token, "XDG_CONFIG_HOME": str(known)}
        pipe = subprocess.PIPE
        with subprocess.Popen(
            [*command, "--address-range", str(RANGE), "--once"], env=environment, stdout=pipe, stderr=pipe, text=True
        ) as connect:
            try:
                assert connect.stdout is not None
                assert connect.stderr is not None
                ready = sorted(connect.stdout.readline() for _ in range(2))
                assert all(ready), connect.stderr.read()
                assert ready[0].startswith(f"ready: robot a on {HERE}, ports 1448, ")
                assert ready[1].startswith(f"ready: robot b on {SECOND}, ports ")
                said = [connect.stderr.readline() for _ in range(2)]
                assert all(line.startswith(f"gateway {shown}") for line in said)
                assert sum("seen for the first time" in line for line in said) == 1
                with urllib.request.urlopen(f"http://{HERE}:1448/{POSE}", timeout=60) as reply:
                    assert reply.status == 200
                with socket.create_connection((SECOND, 40923), 60) as line:
                    line.sendall(b"command;chassis speed x 0.1;")
                    got = b""
                    while got.count(b";") < 2:
                        got += line.recv(64)
                    assert got == b"ok;fail;"  # it may see but not drive
            finally:
                connect.terminate()
        assert (known / "roboglot" / "gateways.json").exists()
        wrong = {**environment, "ROBOGLOT_TOKEN": "wrong"}
        ended = subprocess.run(
            [*command, "--once"], env=wrong, capture_output=True, text=True, timeout=180, check=False
        )
        assert (ended.returncode, ended.stderr.count("Traceback")) == (1, 0)
        assert "is not valid" in ended.stderr


def test_addresses_follow_one_another() -> None:
    assert addresses(2, "", "") == ["127.0.0.1", "127.0.0.2"]
    assert addresses(2, "127.0.0.9", "") == ["127.0.0.9", "127.0.0.10"]
    assert addresses(2, "", "10.99.0.0/24") == ["10.99.0.1", "10.99.0.2"]
    with pytest.raises(ValueError, match="2 addresses"):
        addresses(3, "", "10.99.0.0/30")
    with pytest.raises(ValueError, match="either"):
        addresses(1, "127.0.0.9", "10.99.0.0/24")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["127.0.0.1:9", "--once"], "robot a: 127.0.0.1:9: Connection refused"),
        (["127.0.0.1:99999"], "'127.0.0.1:99999' is not HOST or HOST:PORT"),
        (["https://127.0.0.1"], "is not HOST or HOST:PORT"),
        (["127.0.0.1", "--robot", "a", "--robot", "a"], "a robot is named twice"),
    ],
)
def test_failed_connections_end_with_their_reasons(
    arguments: list[str], reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROBOGLOT_TOKEN", "token")
    ended = CliRunner().invoke(loaded("connect"), arguments)
    assert ended.exit_code == 1
    assert reason in f"{ended.output}{ended.exception}"


def test_another_robots_address_is_explained(tmp_path: Path) -> None:
    data = tmp_path / "data"
    store = open_store(data)
    token = store.add_machine("cell", [Grant("*", frozenset({Right.SEE}))])
    store.close()
    config = tmp_path / "robots.toml"
    config.write_text(f'[access]\ngateway = "{GATEWAY}"\n')
    with served(data, "--world", "empty", "--no-console", "--config", str(config), address=ROBOTS):
        command = [sys.executable, "-m", "roboglot", "connect", GATEWAY, "--address-range", "192.0.2.0/24"]
        environment = {**os.environ, "ROBOGLOT_TOKEN": token, "XDG_CONFIG_HOME": str(tmp_path)}
        ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=180, check=False)
    assert ended.returncode == 1
    assert "ip route add local 192.0.2.0/24 dev lo" in ended.stderr
