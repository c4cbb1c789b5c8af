"""A broker that encrypts and asks for a password: robots reach it, and say why if they cannot."""

from __future__ import annotations

import asyncio
import dataclasses
import gc
import getpass
import ipaddress
import logging
import re
import shutil
import subprocess
import warnings
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

pytest.importorskip("aiomqtt", reason="needs roboglot[vda5050]")

from roboglot.model.robot import Robot
from roboglot.protocols.vda5050 import server
from roboglot.protocols.vda5050.config import Vda5050Config
from roboglot.protocols.vda5050.server import Vda5050Door
from roboglot.testing.addresses import free_addresses, free_port
from tests.protocols.vda5050.conftest import MOSQUITTO, listening

PATIENCE = 60.0  # real s
NAME, PASSWORD = "robot", "secret"
pytestmark = pytest.mark.world("empty")


def certify(folder: Path, address: str) -> None:
    """Write a certificate that is its own authority, and its key."""
    key, now = ec.generate_private_key(ec.SECP256R1()), datetime.now(UTC)
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "broker")])
    made = (
        x509.CertificateBuilder(name, name, key.public_key(), 1, now - timedelta(days=1), now + timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address(address))]), critical=False)
        .sign(key, hashes.SHA256())
    )
    (folder / "cert.pem").write_bytes(made.public_bytes(Encoding.PEM))
    (folder / "key.pem").write_bytes(key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))


@pytest.fixture(scope="module")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Vda5050Config]:
    """Settings of a robot that reaches it."""
    hasher = shutil.which("mosquitto_passwd")
    if MOSQUITTO is None or hasher is None:
        pytest.skip("needs mosquitto: apt-get install mosquitto")
    folder, address, port = tmp_path_factory.mktemp("guarded"), free_addresses(1), free_port()
    certify(folder, address)
    (folder / "names").touch()
    subprocess.run([hasher, "-b", folder / "names", NAME, PASSWORD], check=True)
    (folder / "conf").write_text(
        f"user {getpass.getuser()}\n"  # root's would read as another user, who cannot
        f"listener {port} {address}\ncertfile {folder}/cert.pem\nkeyfile {folder}/key.pem\n"
        f"allow_anonymous false\npassword_file {folder}/names\n"
    )
    process = subprocess.Popen([MOSQUITTO, "-c", folder / "conf"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    listening(port, address)
    yield Vda5050Config(f"{address}:{port}", username=NAME, password=PASSWORD, tls=True, ca=f"{folder}/cert.pem")
    process.terminate()
    process.wait()


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({}, "connected to the broker"),
        ({"password": "guess"}, "Not authorized"),
        ({"ca": ""}, "certificate verify failed"),
        ({"tls": False}, "it does not answer as a broker.*; if it is a broker that encrypts, set tls = true$"),
    ],
)
async def test_guarded_brokers_are_reached_or_named(
    wrong: dict[str, Any],
    said: str,
    broker: Vda5050Config,
    robot: Robot,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(server, "LINK_SECONDS", 1.0 if wrong else PATIENCE)
    caplog.set_level(logging.INFO)
    door = Vda5050Door(robot, dataclasses.replace(broker, **wrong))
    await door.start()
    async with asyncio.timeout(PATIENCE):
        while not re.search(said, caplog.text, re.MULTILINE):  # noqa: ASYNC110 - there is no event of it
            await asyncio.sleep(0.01)
    await door.close()
    with warnings.catch_warnings(action="ignore"):
        gc.collect()  # paho leaves a socket that TLS refuses to the collector
    assert {record.name for record in caplog.records} == {server.__name__}


def test_endpoints_name_encryption_and_user(robot: Robot) -> None:
    config = Vda5050Config("127.0.0.1:8883", username=NAME, password=PASSWORD, tls=True, ca="/ca.pem")
    (endpoint,) = Vda5050Door(robot, config).endpoints
    assert endpoint.address.startswith("mqtts://127.0.0.1:8883/")
    assert " --cafile /ca.pem -u robot -P PASSWORD " in endpoint.try_line
