"""``roboglot doctor --security``: what it says of a configuration and of who has rights."""

from __future__ import annotations

import subprocess
import sys
import time
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from roboglot.access.store import Grant, open_store
from roboglot.access.trail import Entry, open_trail
from roboglot.cli.checks.security import DAY, UNUSED_DAYS, examine_security
from roboglot.config import AccessConfig, Config, RobotConfig, TlsConfig
from roboglot.operations import Right
from roboglot.protocols.cyberdog.certificates import ensure_certificates, ensure_site
from roboglot.protocols.foxglove.config import FoxgloveConfig
from roboglot.protocols.ros2.config import Ros2Config
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.runtime import Runtime

DRIVE, ADMIN = frozenset({Right.DRIVE}), frozenset({Right.ADMIN})
OUTSIDE = (RobotConfig("a", "universal", "192.0.2.5"),)


def weak(config: Config) -> dict[str, str]:
    """Return the weaknesses found, with their remedies."""
    return {finding.name: finding.remedy for finding in examine_security(config) if not finding.well}


@pytest.fixture
def data(tmp_path: Path) -> Path:
    folder = tmp_path / "data"
    folder.mkdir(mode=0o700)
    return folder


def test_a_default_start_has_no_weak_spot(data: Path) -> None:
    config = Config(robots=(RobotConfig("a", "universal", "127.0.0.1"),), data=data)
    assert weak(config) == {}
    seen = [finding.seen for finding in examine_security(config)]
    assert any("127.0.0.1:1448 for programs on this machine" in each for each in seen)
    assert not any("127.0.0.1:7447" in each for each in seen)
    opened = replace(config, doors={"ros2": Ros2Config(enabled=True), "foxglove": FoxgloveConfig(enabled=False)})
    seen = [finding.seen for finding in examine_security(opened)]
    assert any("127.0.0.1:7447" in each for each in seen)
    assert not any("127.0.0.1:8765" in each for each in seen)


def test_weak_settings_are_named(data: Path) -> None:
    found = weak(Config(robots=OUTSIDE, data=data, insecure=True))
    assert "--access" in found["open to everyone"]
    access = AccessConfig(on=True, gateway="0.0.0.0:50090")
    doors = {"slamware": SlamwareConfig(origins=("*",))}
    found = weak(Config(robots=OUTSIDE, data=data, access=access, doors=doors))
    assert set(found) == {"encryption", "gateway and local", "[slamware] origins"}
    tls = replace(access, local=False, gateway="", tls=TlsConfig(on=True, plain=False))
    assert set(weak(Config(robots=OUTSIDE, data=data, access=tls))) == {"people and machines"}
    data.chmod(0o755)
    assert "chmod 700" in weak(Config(robots=OUTSIDE, data=data, access=tls))["data folder"]


def test_rights_that_are_weak_or_unused_are_named(data: Path) -> None:
    store = open_store(data)
    now = time.time()
    store.add_machine("root", [Grant("*", ADMIN)])
    store.add_machine("busy", [Grant("a", DRIVE)])
    store.add_machine("idle", [Grant("a", DRIVE)])
    store.add_machine("past", [Grant("a", DRIVE, now - 1.0)])
    store.allow("192.0.2.9", [Grant("a", DRIVE)])
    store.close()
    old = now - (UNUSED_DAYS + 1) * DAY
    with open_trail(data) as trail:
        trail.add([Entry(old, "idle", "", "a", "robomaster", "chassis move", "done")])
        trail.add([Entry(now - DAY, "busy", "", "a", "robomaster", "chassis move", "done")])
    found = weak(Config(robots=OUTSIDE, data=data, access=AccessConfig(on=True, tls=TlsConfig(on=True, plain=False))))
    assert set(found) == {
        "machine root",
        "machine past",
        "address 192.0.2.9",
        "unused: root",
        "unused: idle",
        "unused: past",
        "unused: 192.0.2.9",
    }


def test_certificate_that_expires_is_weak(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Clients refuse it, and the robot's log only says that they hung up."""
    monkeypatch.setattr("roboglot.protocols.cyberdog.signing.VALID_FOR", timedelta(days=29))
    certificate, key = ensure_site(data / "cyberdog", {"127.0.0.1"})
    tls = TlsConfig(on=True, certificate=str(certificate), key=str(key))
    found = weak(Config(robots=OUTSIDE, data=data, access=AccessConfig(on=True, tls=tls)))
    assert {"gateway certificate", "web certificate"} <= found.keys()
    assert str(certificate) in found["web certificate"]


def test_expired_certificate_is_named_at_the_start(
    data: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    ensure_certificates(data / "cyberdog")
    monkeypatch.setattr("roboglot.protocols.cyberdog.signing.VALID_FOR", timedelta(hours=-1))
    certificate, key = ensure_site(data / "cyberdog", {"127.0.0.1"})
    tls = TlsConfig(on=True, certificate=str(certificate), key=str(key))
    asked: Any = SimpleNamespace(config=Config(data=data, access=AccessConfig(on=True, tls=tls)))
    assert Runtime._build_tls(asked) is not None
    assert f"{certificate} expired on" in caplog.text


def test_the_command_prints_fingerprints(data: Path) -> None:
    ensure_certificates(data / "cyberdog")
    command = [sys.executable, "-m", "roboglot", "doctor", "--security", "--data", str(data)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
    assert ended.returncode == 0, ended
    assert "gateway certificate" in ended.stdout
    assert "SHA-256" in ended.stdout
