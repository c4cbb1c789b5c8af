"""The private CA of this door and the two certificates it signs, made once in the data folder. Knows no channel.

Real robots carry RSA-4096 keys; making three of those takes two to five seconds, a P-256 key takes none, and every
TLS library that gRPC clients are built on accepts it. The CA's own key is thrown away when both certificates are
signed: no further ones can be made.
"""

from __future__ import annotations

import logging
import os
import shutil
import tempfile
from collections.abc import Collection, Sequence
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, load_pem_private_key
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from roboglot.values import dataclass
from roboglot.wire.cyberdog.channel import APP_NAME, ROBOT_NAME

log = logging.getLogger(__name__)
VALID_FOR = timedelta(days=3650)
SLOW_CLOCKS = timedelta(days=1)  # a client whose clock is behind still accepts a fresh certificate
CA_CERT, SERVER_CERT, SERVER_KEY = "ca-cert.pem", "server-cert.pem", "server-key.pem"
CA_KEY, APPS, APPS_CA = "ca-key.pem", "apps", "roboglot apps"
CLIENT_FILES = (CA_CERT, "client-cert.pem", "client-key.pem")


class BadCertificates(OSError):
    """Certificates in the folder are incomplete or expired; the message says what to do."""


@dataclass(frozen=True, slots=True)
class Certificates:
    """PEM texts: what the robot trusts, and what it proves itself with in both roles.

    ``callers``: CAs whose certificates admit a client: ``ca``, and that of apps with certificates of their own.
    """

    ca: bytes
    certificate: bytes
    key: bytes
    callers: bytes


def ensure_certificates(folder: Path) -> Certificates:
    """Return the certificates in ``folder``/tls, making missing ones. Raises BadCertificates, or the disk's OSError.

    All files appear at once or not at all, so robots that start together agree on one CA.
    """
    tls = folder / "tls"
    if not tls.exists():
        _make(tls)
    try:
        ca, certificate, key = ((tls / name).read_bytes() for name in (CA_CERT, SERVER_CERT, SERVER_KEY))
        x509.load_pem_x509_certificates(ca)
        signed = x509.load_pem_x509_certificate(certificate)
        if load_pem_private_key(key, password=None).public_key() != signed.public_key():
            raise ValueError(f"{SERVER_KEY} is not the key of {SERVER_CERT}")
    except (OSError, TypeError, ValueError, UnsupportedAlgorithm) as error:  # TypeError: the key has a password
        raise BadCertificates(f"the certificates in {tls} are broken ({error}); remove it to have new ones") from error
    if (expires := signed.not_valid_after_utc) < datetime.now(UTC):
        raise BadCertificates(f"the certificates in {tls} expired on {expires:%Y-%m-%d}; remove it to have new ones")
    apps = folder / APPS / CA_CERT
    return Certificates(ca, certificate, key, ca + (apps.read_bytes() if apps.exists() else b""))


class CertificateStore:
    """Current certificates in ``folder``/tls: replaced files take effect at the next connection."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._read_at = self._stamp()
        self._current = ensure_certificates(folder)

    def newest(self) -> Certificates:
        """Return the files' current certificates; broken or expired ones change nothing. Callable from any thread."""
        stamp = self._stamp()
        if stamp == self._read_at:
            return self._current
        self._read_at = stamp
        try:
            renewed = ensure_certificates(self._folder)
        except OSError as error:
            log.warning("cannot load the changed certificates, the old ones stay: %s", error)
            return self._current
        if renewed != self._current:
            log.info("new certificates in %s", self._folder)
            self._current = renewed
        return self._current

    def _stamp(self) -> tuple[int, ...]:
        files = [self._folder / "tls" / name for name in (CA_CERT, SERVER_CERT, SERVER_KEY)]
        apps = self._folder / APPS / CA_CERT
        try:
            return tuple(file.stat().st_mtime_ns for file in (*files, *([apps] if apps.exists() else [])))
        except OSError:  # they are about to be replaced anyway
            return ()


def export_client(folder: Path, out: Path) -> Sequence[Path]:
    """Copy what a client needs (CA, certificate, key; the key readable by its owner alone) to ``out``."""
    ensure_certificates(folder)
    out.mkdir(parents=True, exist_ok=True)
    for name in CLIENT_FILES:
        _write(out / name, (folder / "tls" / name).read_bytes(), private=name.endswith("-key.pem"))
    return [out / name for name in CLIENT_FILES]


def export_app(folder: Path, name: str, out: Path) -> Sequence[Path]:
    """Write what one app needs to ``out``: a certificate of its own, whose common name is ``name``, its key, the CA.

    It is signed by a CA for apps, which is made at the first and, unlike the robot's own, kept to sign more.
    """
    ensure_certificates(folder)
    issuer_key = _apps_ca(folder / APPS)
    own = ec.generate_private_key(ec.SECP256R1())
    out.mkdir(parents=True, exist_ok=True, mode=0o700)
    certificate = _certificate(name, own, APPS_CA, issuer_key, APP_NAME).public_bytes(Encoding.PEM)
    for file, data in zip(CLIENT_FILES, ((folder / "tls" / CA_CERT).read_bytes(), certificate, _pem(own)), strict=True):
        _write(out / file, data, private=file.endswith("-key.pem"))
    return [out / file for file in CLIENT_FILES]


def ensure_site(folder: Path, names: Collection[str]) -> tuple[Path, Path]:
    """Return certificate and key of the HTTPS ports, for these addresses and host names; made if there are none.

    The CA for apps signs it, so clients that trust ``folder``/apps/ca-cert.pem believe later ones, too.
    """
    pair = folder / "site" / "site-cert.pem", folder / "site" / "site-key.pem"
    if all(path.exists() for path in pair) and _serves(pair[0], names):
        return pair
    ensure_certificates(folder)
    pair[0].parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    own = ec.generate_private_key(ec.SECP256R1())
    hosts = tuple(sorted(names))
    signed = _certificate("roboglot", own, APPS_CA, _apps_ca(folder / APPS), *hosts, server_only=True)
    _write(pair[1], _pem(own), private=True)
    _write(pair[0], signed.public_bytes(Encoding.PEM))
    return pair


def fingerprint(certificate: Path) -> str:
    """SHA-256 of a PEM certificate, as `roboglot connect` and openssl show it. Raises OSError, ValueError."""
    return x509.load_pem_x509_certificate(certificate.read_bytes()).fingerprint(hashes.SHA256()).hex()


def _serves(path: Path, names: Collection[str]) -> bool:
    """Return whether a certificate of ours is for all these names and still good for a month."""
    try:
        certificate = x509.load_pem_x509_certificate(path.read_bytes())
        listed = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (ValueError, x509.ExtensionNotFound):
        return False
    fresh = certificate.not_valid_after_utc > datetime.now(UTC) + timedelta(days=30)
    return fresh and {_general_name(name) for name in names} <= set(listed)


def _apps_ca(apps: Path) -> ec.EllipticCurvePrivateKey:
    """Return the key that signs apps' certificates; made on first use."""
    if not (apps / CA_KEY).exists():
        apps.mkdir(parents=True, exist_ok=True, mode=0o700)
        issuer = ec.generate_private_key(ec.SECP256R1())
        signed = _certificate(APPS_CA, issuer, APPS_CA, issuer)
        _write(apps / CA_KEY, _pem(issuer), private=True)
        _write(apps / CA_CERT, signed.public_bytes(Encoding.PEM))
    issuer_key = load_pem_private_key((apps / CA_KEY).read_bytes(), password=None)
    if not isinstance(issuer_key, ec.EllipticCurvePrivateKey):
        raise BadCertificates(f"{apps / CA_KEY} is no key of ours; remove {apps} to have new ones")
    return issuer_key


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def _make(tls: Path) -> None:
    """Make a CA and both pairs in a folder that is renamed into place once complete."""
    tls.parent.mkdir(parents=True, exist_ok=True)
    ca_key = ec.generate_private_key(ec.SECP256R1())
    ca = _certificate("roboglot cyberdog CA", ca_key, "roboglot cyberdog CA", ca_key)
    draft = Path(tempfile.mkdtemp(prefix=".tls-", dir=tls.parent))
    try:
        _write(draft / CA_CERT, ca.public_bytes(Encoding.PEM))
        for role, name in (("server", ROBOT_NAME), ("client", APP_NAME)):
            key = ec.generate_private_key(ec.SECP256R1())
            signed = _certificate(name, key, "roboglot cyberdog CA", ca_key)
            pem = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
            _write(draft / f"{role}-cert.pem", signed.public_bytes(Encoding.PEM))
            _write(draft / f"{role}-key.pem", pem, private=True)
        draft.rename(tls)
    except OSError:
        shutil.rmtree(draft, ignore_errors=True)
        if not tls.exists():  # another robot was faster: its certificates serve as well
            raise


def _certificate(
    name: str,
    key: ec.EllipticCurvePrivateKey,
    issuer: str,
    issuer_key: ec.EllipticCurvePrivateKey,
    *hosts: str,
    server_only: bool = False,
) -> x509.Certificate:
    """``name``'s certificate for ``hosts`` (its name, if none), signed by ``issuer``; its own if they are the same."""
    now = datetime.now(UTC)
    is_ca = name == issuer
    builder = (
        x509.CertificateBuilder()
        .subject_name(_name(name))
        .issuer_name(_name(issuer))
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - SLOW_CLOCKS)
        .not_valid_after(now + VALID_FOR)
        .add_extension(x509.BasicConstraints(ca=is_ca, path_length=0 if is_ca else None), critical=True)
    )
    if not is_ca:
        # Libraries that ignore the common name look here; both ends are server and client.
        uses = [ExtendedKeyUsageOID.SERVER_AUTH, *(() if server_only else (ExtendedKeyUsageOID.CLIENT_AUTH,))]
        names = x509.SubjectAlternativeName([_general_name(host) for host in hosts or (name,)])
        builder = builder.add_extension(names, critical=False)
        builder = builder.add_extension(x509.ExtendedKeyUsage(uses), critical=False)
    return builder.sign(issuer_key, hashes.SHA256())


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _name(common: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common)])


def _write(path: Path, data: bytes, *, private: bool = False) -> None:
    """Write a file atomically; if ``private``, it is never readable by others."""
    descriptor, draft = tempfile.mkstemp(dir=path.parent)  # made with mode 0600
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        if not private:
            Path(draft).chmod(0o644)
        Path(draft).replace(path)
    except OSError:
        Path(draft).unlink(missing_ok=True)
        raise
