"""Exposure to other machines: none, unless it is asked for by name and said in red."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from dataclasses import replace
from ipaddress import IPv4Address
from pathlib import Path

import pytest

from roboglot.cli.screen import warn_if_open
from roboglot.config import Config, RobotConfig, load_config
from roboglot.protocols.foxglove.config import FoxgloveConfig
from roboglot.protocols.ros2.config import Ros2Config
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses

ADDRESS = free_addresses(1)

LISTENS = "0A"  # TCP's state in /proc/net/tcp
MAPPED = "0000000000000000FFFF0000"  # before an IPv4 address of an IPv6 socket there


def own_sockets() -> list[tuple[str, str, str]]:
    """Protocol, local address and state of this process's sockets."""
    inodes = {link.readlink().name for link in Path("/proc/self/fd").iterdir() if link.is_symlink()}
    found = []
    for kind in ("tcp", "udp", "tcp6", "udp6"):
        for row in Path(f"/proc/self/net/{kind}").read_text().splitlines()[1:]:
            _, local, _, state, *_, inode = row.split()[:10]
            if f"socket:[{inode}]" in inodes:
                host = local.partition(":")[0].removeprefix(MAPPED)
                address = str(IPv4Address(bytes.fromhex(host)[::-1])) if len(host) == 8 else host
                found.append((kind[:3], address, state))
    return found


async def test_a_default_start_is_reached_by_loopback_alone(tmp_path: Path) -> None:
    base = load_config(None, {"data": str(tmp_path / "data"), "world": "empty", "lockstep": True})
    before = own_sockets()
    runtime = Runtime(replace(base, robots=(RobotConfig("a", "universal", ADDRESS),)))
    await runtime.start()
    opened = list((Counter(own_sockets()) - Counter(before)).elements())  # another test's console may be open, too
    await runtime.close()
    assert len([entry for entry in opened if entry[0] == "tcp" and entry[2] == LISTENS]) >= 7
    robots = {("tcp", ADDRESS), ("udp", ADDRESS)}
    assert {(kind, address) for kind, address, _ in opened} == robots | {("tcp", "127.0.0.1")}  # and the console


def test_a_network_is_not_opened_without_a_word(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "roboglot", "up", "--data", str(tmp_path / "data"), "--address", "0.0.0.0"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
    assert ended.returncode == 1
    assert "--insecure" in ended.stderr
    assert "Traceback" not in ended.stderr
    assert not (tmp_path / "data").exists()


def test_open_doors_are_reported_in_red(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    warn_if_open(Config(robots=(RobotConfig("a", "universal", "0.0.0.0"), RobotConfig("b", "cyberdog2", "127.0.0.1"))))
    said = capsys.readouterr().err
    assert "\x1b[31m" in said
    assert "robot a is open to everyone on every network" in said
    assert "robot b" not in said
    assert "block programs, Foxglove; CyberDog 2 gRPC asks for a certificate" in said
    monkeypatch.setenv("NO_COLOR", "1")
    robots = (RobotConfig("a", "universal", "0.0.0.0"),)
    warn_if_open(Config(robots=robots, doors={"ros2": Ros2Config(enabled=True), "foxglove": FoxgloveConfig(False)}))
    said = capsys.readouterr().err
    assert "block programs, ROS 2; CyberDog" in said
    assert "\x1b[" not in said
