"""The private CA and what it signs."""

from __future__ import annotations

import os
import stat
from datetime import UTC, datetime
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.x509.oid import NameOID

from roboglot.protocols.cyberdog import certificates
from roboglot.protocols.cyberdog.certificates import BadCertificates, ensure_certificates, export_client


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


def test_keys_are_private_and_the_ca_key_is_gone(tmp_path: Path) -> None:
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
    """While one makes its own, the other's appear."""
    real, mine = certificates._write, []

    def interrupted(path: Path, data: bytes, *, private: bool = False) -> None:
        if not mine:
            mine.append(path)
            certificates._make(tmp_path / "tls")
        real(path, data, private=private)

    monkeypatch.setattr(certificates, "_write", interrupted)
    taken = ensure_certificates(tmp_path)
    assert taken == ensure_certificates(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["tls"]


def test_broken_and_expired_ones_are_not_replaced_silently(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ensure_certificates(tmp_path)

    class Later(datetime):
        @classmethod
        def now(cls, tz: object = None) -> datetime:
            return datetime(2090, 1, 1, tzinfo=UTC)

    with monkeypatch.context() as patched:
        patched.setattr(certificates, "datetime", Later)
        with pytest.raises(BadCertificates, match="expired"):
            ensure_certificates(tmp_path)
    (tmp_path / "tls" / "server-key.pem").unlink()
    with pytest.raises(BadCertificates, match="broken"):
        ensure_certificates(tmp_path)
