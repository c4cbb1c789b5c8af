"""The private CA of this door and the two certificates it signs, made once in the data folder. Knows no channel.

Loads ``signing``, and with it cryptography's library, when something must be made, or is wrong.
"""

from __future__ import annotations

import logging
import ssl
from collections.abc import Collection, Sequence
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path

from roboglot.protocols.cyberdog.pem_files import CA_CERT, SERVER_CERT, SERVER_KEY, write
from roboglot.values import dataclass

log = logging.getLogger(__name__)
APPS = "apps"
CLIENT_FILES = (CA_CERT, "client-cert.pem", "client-key.pem")
ROUNDS = 4  # of a handshake's messages, at most


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
        from roboglot.protocols.cyberdog.signing import make

        make(tls)
    try:
        ca, certificate, key = ((tls / name).read_bytes() for name in (CA_CERT, SERVER_CERT, SERVER_KEY))
        expires = _expiry(tls, ca, certificate, key)
    except (OSError, ValueError) as error:
        raise BadCertificates(f"the certificates in {tls} are broken ({error}); remove it to have new ones") from error
    if expires < datetime.now(UTC):
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
        write(out / name, (folder / "tls" / name).read_bytes(), private=name.endswith("-key.pem"))
    return [out / name for name in CLIENT_FILES]


def export_app(folder: Path, name: str, out: Path) -> Sequence[Path]:
    """Write what one app needs to ``out``: a certificate of its own, whose common name is ``name``, its key, the CA.

    It is signed by a CA for apps, which is made at the first and, unlike the robot's own, kept to sign more.
    """
    from roboglot.protocols.cyberdog.signing import sign_app

    ensure_certificates(folder)
    certificate, key = sign_app(name, folder / APPS)
    out.mkdir(parents=True, exist_ok=True, mode=0o700)
    for file, data in zip(CLIENT_FILES, ((folder / "tls" / CA_CERT).read_bytes(), certificate, key), strict=True):
        write(out / file, data, private=file.endswith("-key.pem"))
    return [out / file for file in CLIENT_FILES]


def ensure_site(folder: Path, names: Collection[str]) -> tuple[Path, Path]:
    """Return certificate and key of the HTTPS ports, for these addresses and host names; made if there are none.

    The CA for apps signs it, so clients that trust ``folder``/apps/ca-cert.pem believe later ones, too.
    """
    from roboglot.protocols.cyberdog.signing import serves, sign_site

    pair = folder / "site" / "site-cert.pem", folder / "site" / "site-key.pem"
    if all(path.exists() for path in pair) and serves(pair[0], names):
        return pair
    ensure_certificates(folder)
    pair[0].parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    certificate, key = sign_site(names, folder / APPS)
    write(pair[1], key, private=True)
    write(pair[0], certificate)
    return pair


@lru_cache(maxsize=8)  # a fleet's robots have the same ones, and a handshake takes 5 ms
def _expiry(tls: Path, ca: bytes, certificate: bytes, key: bytes) -> datetime:
    """Return the end of the time of certificates in ``tls``. Raises ValueError or OSError."""
    return _proven(tls) or _checked(ca, certificate, key)


def _proven(tls: Path) -> datetime | None:
    """Return the end of the server certificate's time after a handshake with it in memory; None if that fails.

    A handshake shows the same as a look at the files, in a sixth of the time that cryptography's library loads.
    """
    try:
        server, client = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        server.load_cert_chain(tls / SERVER_CERT, tls / SERVER_KEY, password=lambda: b"")
        client.check_hostname = False  # the certificate is in question, not its name
        client.load_verify_locations(tls / CA_CERT)
        to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
        caller = client.wrap_bio(to_client, to_server)
        answerer = server.wrap_bio(to_server, to_client, server_side=True)
        for _ in range(ROUNDS):
            proven = _is_through(caller)
            if _is_through(answerer) and proven:
                until = (caller.getpeercert() or {})["notAfter"]
                return datetime.fromtimestamp(ssl.cert_time_to_seconds(str(until)), UTC)
    except (OSError, ValueError, LookupError):  # OSError: an SSLError, too
        return None
    return None


def _is_through(end: ssl.SSLObject) -> bool:
    """Return whether one end has finished its part of a handshake. Raises SSLError."""
    try:
        end.do_handshake()
    except ssl.SSLWantReadError:
        return False
    return True


def _checked(ca: bytes, certificate: bytes, key: bytes) -> datetime:
    """Return the end of the certificate's time after a look at every byte. Raises ValueError in plain words."""
    from roboglot.protocols.cyberdog.signing import expiry

    return expiry(ca, certificate, key)
