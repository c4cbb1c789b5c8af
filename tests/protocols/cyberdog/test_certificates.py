"""The private CA and what it signs."""

from __future__ import annotations

import os
import stat
from datetime import UTC, datetime, tzinfo
from pathlib import Path

import grpc
import pytest
from cryptography import x509
from cryptography.x509.oid import NameOID

from roboglot.protocols.cyberdog import certificates, signing
from roboglot.protocols.cyberdog.certificates import (
    BadCertificates,
    CertificateStore,
    ensure_certificates,
    export_client,
)
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from tests.protocols.cyberdog.phone import ADDRESS, App, Client, Messages, Pems, context_of


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def common_name(pem: bytes) -> str:
    (attribute,) = x509.load_pem_x509_certificate(pem).subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(attribute.value)


def test_made_once_and_kept(tmp_path: Path) -> None:
    first = ensure_certificates(tmp_path)
    assert ensure_certificates(tmp_path) == first
    assert common_name(first.certificate) == "cyberdog2.server"
    ca = x509.load_pem_x509_certificate(first.ca)
    x509.load_pem_x509_certificate(first.certificate).verify_directly_issued_by(ca)


def test_keys_are_private_and_ca_key_is_gone(tmp_path: Path) -> None:
    previous = os.umask(0)
    try:
        ensure_certificates(tmp_path)
    finally:
        os.umask(previous)
    files = {path.name: mode(path) for path in (tmp_path / "tls").iterdir()}
    assert files == {
        "ca-cert.pem": 0o644,
        "server-cert.pem": 0o644,
        "server-key.pem": 0o600,
        "client-cert.pem": 0o644,
        "client-key.pem": 0o600,
    }
    assert [path.name for path in tmp_path.iterdir()] == ["tls"]


def test_export_gives_a_client_what_it_needs(tmp_path: Path) -> None:
    files = export_client(tmp_path / "data", tmp_path / "out")
    assert [path.name for path in files] == ["ca-cert.pem", "client-cert.pem", "client-key.pem"]
    assert common_name(files[1].read_bytes()) == "cyberdog2.client"
    assert mode(files[2]) == 0o600
    assert files[0].read_bytes() == ensure_certificates(tmp_path / "data").ca
    assert export_client(tmp_path / "data", tmp_path / "out") == files


def test_two_robots_starting_together_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another robot's certificates appear while one makes its own."""
    real, mine = signing.write, []

    def interrupted(path: Path, data: bytes, *, private: bool = False) -> None:
        if not mine:
            mine.append(path)
            signing.make(tmp_path / "tls")
        real(path, data, private=private)

    monkeypatch.setattr(signing, "write", interrupted)
    taken = ensure_certificates(tmp_path)
    assert taken == ensure_certificates(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["tls"]


def test_broken_and_expired_ones_are_not_replaced_silently(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ensure_certificates(tmp_path)

    class Later(datetime):
        @classmethod
        def now(cls, tz: tzinfo | None = None) -> Later:
            return cls(2090, 1, 1, tzinfo=tz or UTC)

    with monkeypatch.context() as patched:
        patched.setattr(certificates, "datetime", Later)
        with pytest.raises(BadCertificates, match="expired"):
            ensure_certificates(tmp_path)
    (tmp_path / "tls" / "server-key.pem").unlink()
    with pytest.raises(BadCertificates, match="broken"):
        ensure_certificates(tmp_path)


@pytest.mark.parametrize("name", ["ca-cert.pem", "server-cert.pem", "server-key.pem"])
@pytest.mark.parametrize("half", [True, False])
def test_half_a_change_changes_nothing_and_is_reported(tmp_path: Path, name: str, half: bool) -> None:
    """A file that is cut short, or a key or certificate whose other half has not come yet."""
    ensure_certificates(tmp_path / "new")
    file, store = tmp_path / "tls" / name, CertificateStore(tmp_path)
    before = store.newest()
    text = (tmp_path / "new" / "tls" / name).read_bytes()
    file.write_bytes(text[: len(text) // 2] if half else text)
    if name == "ca-cert.pem" and not half:  # complete: other apps are admitted
        assert store.newest().ca == text
        return
    assert store.newest() is before
    with pytest.raises(BadCertificates, match=f"broken.*{'' if half else 'server-key.pem is not the key'}"):
        ensure_certificates(tmp_path)


@pytest.mark.world("empty")
async def test_certificates_that_are_replaced_count_at_next_connection(
    robot, tmp_path: Path, messages: Messages, passing
) -> None:
    """The app's old ones are refused from then on, in both directions; who is connected stays so."""
    door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app_port=1), tmp_path)
    await door.start()
    tls = tmp_path / "cyberdog" / "tls"

    def proof() -> Pems:
        return Pems(*((tls / f"{name}.pem").read_bytes() for name in ("ca-cert", "client-cert", "client-key")))

    old = proof()
    try:
        async with old.channel(door.port) as connected:
            assert await Client(connected, messages).raw(10001)
            (tls / "server-key.pem").write_text("half a fi")  # new ones are being copied
            async with old.channel(door.port) as channel:
                assert await Client(channel, messages).raw(10001)
            ensure_certificates(tmp_path / "other")
            for file in (tmp_path / "other" / "tls").iterdir():
                (tls / file.name).write_bytes(file.read_bytes())
            async with proof().channel(door.port) as channel:
                assert await Client(channel, messages).raw(10001)
            async with old.channel(door.port) as channel:
                with pytest.raises(grpc.aio.AioRpcError) as refused:
                    await Client(channel, messages).raw(10001)
                assert refused.value.code() is grpc.StatusCode.UNAVAILABLE
            assert await Client(connected, messages).raw(10001)
        new = proof()
        app = App(messages)
        await app.start(grpc.ssl_server_credentials(((new.key, new.certificate),), new.ca, require_client_auth=True))
        context_of(door).app._app_port = app.port
        context_of(door).app.seen("ipv4:127.0.0.1:1")
        await passing(lambda: app.ticks)  # dialled with the new ones
        await app.stop()
    finally:
        await door.close()
