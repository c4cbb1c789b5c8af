"""The private CA and what it signs."""

from __future__ import annotations

import contextlib
import os
import ssl
import stat
from datetime import UTC, datetime, timedelta, tzinfo
from pathlib import Path

import grpc
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, load_pem_private_key
from cryptography.x509.oid import NameOID

from roboglot.protocols.cyberdog import certificates, signing
from roboglot.protocols.cyberdog.certificates import (
    BadCertificates,
    CertificateStore,
    ensure_certificates,
    ensure_site,
    export_app,
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


def handshake(server: ssl.SSLContext, client: ssl.SSLContext, host: str) -> None:
    """Shake hands in memory, both verifying strictly, as Python does since 3.13. Raises ssl.SSLError."""
    for context in (server, client):
        context.verify_flags |= ssl.VERIFY_X509_STRICT
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    caller = client.wrap_bio(to_client, to_server, server_hostname=host)
    answerer = server.wrap_bio(to_server, to_client, server_side=True)
    for _ in range(3):
        for end in (caller, answerer):
            with contextlib.suppress(ssl.SSLWantReadError):
                end.do_handshake()
    caller.do_handshake()
    answerer.do_handshake()


def context(purpose: ssl.Purpose, trusted: Path, certificate: Path, key: Path) -> ssl.SSLContext:
    made = ssl.create_default_context(purpose, cafile=str(trusted))
    made.load_cert_chain(certificate, key)
    made.verify_mode = ssl.CERT_REQUIRED
    return made


def test_strict_clients_and_servers_accept_all_certificates(tmp_path: Path) -> None:
    ca, certificate, key = export_client(tmp_path / "data", tmp_path / "robots")
    robot = context(
        ssl.Purpose.CLIENT_AUTH, ca, *(tmp_path / "data" / "tls" / f"server-{end}.pem" for end in ("cert", "key"))
    )
    handshake(robot, context(ssl.Purpose.SERVER_AUTH, ca, certificate, key), "cyberdog2.server")

    _, certificate, key = export_app(tmp_path / "data", "anna", tmp_path / "anna")
    apps = tmp_path / "data" / "apps" / "ca-cert.pem"
    robot.load_verify_locations(apps)
    handshake(robot, context(ssl.Purpose.SERVER_AUTH, ca, certificate, key), "cyberdog2.server")

    site = context(ssl.Purpose.CLIENT_AUTH, apps, *ensure_site(tmp_path / "data", {"127.0.0.1"}))
    handshake(site, context(ssl.Purpose.SERVER_AUTH, apps, certificate, key), "127.0.0.1")


def without_new_extensions(key: ec.EllipticCurvePrivateKey) -> bytes:
    """Return the certificate of the apps' CA as 0.2 made it."""
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "roboglot apps")])
    now = datetime.now(UTC)
    builder = x509.CertificateBuilder(name, name, key.public_key(), 1, now, now + timedelta(days=90))
    builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
    return builder.sign(key, hashes.SHA256()).public_bytes(Encoding.PEM)


def test_old_ca_of_apps_is_renewed(tmp_path: Path) -> None:
    ensure_site(tmp_path, {"127.0.0.1"})
    apps = tmp_path / "apps" / "ca-cert.pem"
    key = load_pem_private_key((tmp_path / "apps" / signing.CA_KEY).read_bytes(), password=None)
    assert isinstance(key, ec.EllipticCurvePrivateKey)
    old = tmp_path / "old.pem"
    old.write_bytes(without_new_extensions(key))
    apps.write_bytes(old.read_bytes())

    _, certificate, own = export_app(tmp_path, "anna", tmp_path / "anna")
    assert apps.read_bytes() != old.read_bytes()
    site = context(ssl.Purpose.CLIENT_AUTH, apps, *ensure_site(tmp_path, {"127.0.0.1", "::1"}))
    handshake(site, context(ssl.Purpose.SERVER_AUTH, apps, certificate, own), "127.0.0.1")
    x509.load_pem_x509_certificate(certificate.read_bytes()).verify_directly_issued_by(
        x509.load_pem_x509_certificate(old.read_bytes())
    )


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
