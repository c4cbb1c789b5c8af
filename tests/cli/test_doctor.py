"""``roboglot doctor`` and what else looks at ports before it starts: they say who holds one."""

from __future__ import annotations

import dataclasses
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from roboglot.cli.checks.listeners import Holder, holder_of
from roboglot.cli.doctor import examine_ports
from roboglot.config import Config, RobotConfig
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.testing.addresses import free_addresses

ADDRESS = free_addresses(1)


@pytest.fixture
def listener() -> Iterator[int]:
    with socket.socket() as server:
        server.bind((ADDRESS, 0))
        server.listen()
        yield server.getsockname()[1]


def test_a_free_port_has_no_holder(listener: int) -> None:
    assert holder_of("127.0.0.78", listener) is None


def test_the_holder_of_a_port_is_named(listener: int) -> None:
    holder = holder_of(ADDRESS, listener)
    assert holder is not None
    assert holder.pid == os.getpid()
    assert f"process {os.getpid()}" in str(holder)


@pytest.mark.parametrize(
    ("bound", "asked"),
    [(f"::ffff:{ADDRESS}", ADDRESS), ("::1", "::1"), ("::", ADDRESS), ("127.0.0.1", "localhost")],
    ids=["mapped", "IPv6", "all", "name"],
)
def test_holders_of_other_forms_are_found(bound: str, asked: str) -> None:
    """gRPC takes IPv4 on IPv6 sockets: an open CyberDog port was "closed now"."""
    with socket.socket(socket.AF_INET6 if ":" in bound else socket.AF_INET) as server:
        try:
            server.bind((bound, 0))
        except OSError:
            pytest.skip("this machine has no IPv6")
        server.listen()
        port = server.getsockname()[1]
        assert (found := holder_of(asked, port)) is not None
        assert found.pid == os.getpid()
        assert holder_of("127.0.0.78", port) is None or bound == "::"


def test_a_name_without_address_has_no_holder() -> None:
    assert holder_of("no..name", 1448) is None


def test_long_command_lines_are_cut_between_words() -> None:
    command = "/opt/robots/bin/python /opt/robots/bin/roboglot up --config /etc/roboglot/robots.toml --speed 2"
    shown = str(Holder(7, command))
    assert shown == "/opt/robots/bin/python /opt/robots/bin/roboglot up --config … (process 7)"
    path = "/" + "x" * 200
    assert str(Holder(7, path)) == f"{path[:78]} … (process 7)"
    assert str(Holder(7, command[:80])) == f"{command[:80]} (process 7)"


def test_every_tcp_port_is_examined(listener: int) -> None:
    config = Config(robots=(RobotConfig(address=ADDRESS),))
    config = dataclasses.replace(config, doors={"slamware": SlamwareConfig(port=listener)})
    findings = {finding.name: finding for finding in examine_ports(config)}
    assert findings.keys() >= {"Slamware port", "RoboMaster control port", "CyberDog port", "block programs port"}
    assert f"process {os.getpid()}" in findings["Slamware port"].seen
    assert findings["block programs port"].well
    assert findings["block programs port"].seen == f"{ADDRESS}:50053 is free"


def demo(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "roboglot", "demo", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=180, env=os.environ | environment)


def test_a_demo_that_cannot_write_says_so_first() -> None:
    ended = demo("--address", ADDRESS, "--out", "/proc/tour.png")
    assert ended.returncode == 1
    assert ended.stdout == ""
    assert "/proc/tour.png cannot be written" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


def test_demo_beside_a_running_robot_says_so_first(tmp_path: Path) -> None:
    with socket.socket() as server:
        server.bind((ADDRESS, 1448))
        server.listen()
        ended = demo("--address", ADDRESS, "--out", str(tmp_path / "tour.png"))
    assert ended.returncode == 1
    assert f"{ADDRESS}:1448 is taken by" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1
    assert not (tmp_path / "tour.png").exists()


def test_a_terminal_without_utf8_gets_its_text() -> None:
    command = [sys.executable, "-m", "roboglot", "up", "--help"]
    ended = subprocess.run(
        command, capture_output=True, timeout=180, env=os.environ | {"PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    )
    assert ended.returncode == 0, ended.stderr


def test_exported_certificates_are_ignored_by_git(tmp_path: Path) -> None:
    folder = tmp_path / "certs"
    command = [sys.executable, "-m", "roboglot", "certs", "--export", str(folder), "--data", str(tmp_path / "data")]
    subprocess.run(command, check=True, capture_output=True, timeout=180)
    assert (folder / "client-key.pem").exists()
    subprocess.run(["git", "init", "-q", str(tmp_path)], check=True)
    status = ["git", "-C", str(tmp_path), "status", "--porcelain", "--untracked-files=all"]
    listed = subprocess.run(status, check=True, capture_output=True, text=True).stdout
    assert "certs/client-key.pem" not in listed
