"""Keys and certificates of this door: makes, signs and reads them. Knows no door.

The only file that needs cryptography's library, which is loaded when something is made, or wrong.

Real robots carry RSA-4096 keys; making three of those takes two to five seconds, a P-256 key takes none, and every
TLS library that gRPC clients are built on accepts it. The CA's own key is thrown away when both certificates are
signed: no further ones can be made. They name usages and key identifiers as RFC 5280 asks, since Python 3.13 and later
verify strictly.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Collection
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, load_pem_private_key
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from roboglot.protocols.cyberdog.pem_files import CA_CERT, SERVER_CERT, SERVER_KEY, write
from roboglot.wire.cyberdog.channel import APP_NAME, ROBOT_NAME

VALID_FOR = timedelta(days=3650)
SLOW_CLOCKS = timedelta(days=1)  # a client whose clock is behind still accepts a fresh certificate
CA_KEY, APPS_CA = "ca-key.pem", "roboglot apps"


def make(tls: Path) -> None:
    """Make a CA and both pairs in a folder that is renamed into place once complete."""
    tls.parent.mkdir(parents=True, exist_ok=True)
    ca_key = ec.generate_private_key(ec.SECP256R1())
    ca = _certificate("roboglot cyberdog CA", ca_key, "roboglot cyberdog CA", ca_key)
    draft = Path(tempfile.mkdtemp(prefix=".tls-", dir=tls.parent))
    try:
        write(draft / CA_CERT, ca.public_bytes(Encoding.PEM))
        for role, name in (("server", ROBOT_NAME), ("client", APP_NAME)):
            key = ec.generate_private_key(ec.SECP256R1())
            signed = _certificate(name, key, "roboglot cyberdog CA", ca_key)
            pem = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
            write(draft / f"{role}-cert.pem", signed.public_bytes(Encoding.PEM))
            write(draft / f"{role}-key.pem", pem, private=True)
        draft.rename(tls)
    except OSError:
        shutil.rmtree(draft, ignore_errors=True)
        if not tls.exists():  # another robot was faster: its certificates serve as well
            raise


def expiry(ca: bytes, certificate: bytes, key: bytes) -> datetime:
    """Return the end of a certificate's time. Raises ValueError in plain words if the three do not belong together."""
    try:
        x509.load_pem_x509_certificates(ca)
        signed = x509.load_pem_x509_certificate(certificate)
        if load_pem_private_key(key, password=None).public_key() != signed.public_key():
            raise ValueError(f"{SERVER_KEY} is not the key of {SERVER_CERT}")
    except (TypeError, UnsupportedAlgorithm) as error:  # TypeError: the key has a password
        raise ValueError(str(error)) from error
    return signed.not_valid_after_utc


def sign_app(name: str, apps: Path) -> tuple[bytes, bytes]:
    """Return certificate and key of an app, signed by the CA in ``apps``. Raises OSError, ValueError."""
    own = ec.generate_private_key(ec.SECP256R1())
    certificate = _certificate(name, own, APPS_CA, _apps_ca(apps), APP_NAME)
    return certificate.public_bytes(Encoding.PEM), _pem(own)


def sign_site(names: Collection[str], apps: Path) -> tuple[bytes, bytes]:
    """Return certificate and key of HTTPS ports, signed by the CA in ``apps``. Raises OSError, ValueError."""
    own = ec.generate_private_key(ec.SECP256R1())
    signed = _certificate("roboglot", own, APPS_CA, _apps_ca(apps), *sorted(names), server_only=True)
    return signed.public_bytes(Encoding.PEM), _pem(own)


def fingerprint(certificate: Path) -> str:
    """SHA-256 of a PEM certificate, as `roboglot connect` and openssl show it. Raises OSError, ValueError."""
    return x509.load_pem_x509_certificate(certificate.read_bytes()).fingerprint(hashes.SHA256()).hex()


def valid_until(certificate: Path) -> datetime:
    """Return the end of a PEM certificate's time. Raises OSError, ValueError."""
    return x509.load_pem_x509_certificate(certificate.read_bytes()).not_valid_after_utc


def serves(path: Path, names: Collection[str]) -> bool:
    """Return whether a certificate of ours is for all these names and still good for a month."""
    try:
        certificate = x509.load_pem_x509_certificate(path.read_bytes())
        listed = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        certificate.extensions.get_extension_for_class(x509.AuthorityKeyIdentifier)  # those of 0.2 have none
    except (ValueError, x509.ExtensionNotFound):
        return False
    fresh = certificate.not_valid_after_utc > datetime.now(UTC) + timedelta(days=30)
    return fresh and {_general_name(name) for name in names} <= set(listed)


def _apps_ca(apps: Path) -> ec.EllipticCurvePrivateKey:
    """Return the key that signs apps' certificates, made on first use; renew its certificate if clients reject it."""
    if not (apps / CA_KEY).exists():
        apps.mkdir(parents=True, exist_ok=True, mode=0o700)
        write(apps / CA_KEY, _pem(ec.generate_private_key(ec.SECP256R1())), private=True)
    issuer_key = load_pem_private_key((apps / CA_KEY).read_bytes(), password=None)
    if not isinstance(issuer_key, ec.EllipticCurvePrivateKey):
        raise ValueError(f"{apps / CA_KEY} is not a key that roboglot wrote; remove {apps} to create new ones")
    if not _is_strict(apps / CA_CERT):
        write(apps / CA_CERT, _certificate(APPS_CA, issuer_key, APPS_CA, issuer_key).public_bytes(Encoding.PEM))
    return issuer_key


def _is_strict(ca: Path) -> bool:
    """Return whether the file is a CA's certificate that says what its key is for; those of 0.2 do not."""
    try:
        x509.load_pem_x509_certificate(ca.read_bytes()).extensions.get_extension_for_class(x509.KeyUsage)
    except (FileNotFoundError, ValueError, x509.ExtensionNotFound):
        return False
    return True


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


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
    public = key.public_key()
    builder = (
        x509.CertificateBuilder()
        .subject_name(_name(name))
        .issuer_name(_name(issuer))
        .public_key(public)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - SLOW_CLOCKS)
        .not_valid_after(now + VALID_FOR)
        .add_extension(x509.BasicConstraints(ca=is_ca, path_length=0 if is_ca else None), critical=True)
        .add_extension(_usage(is_ca), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(public), critical=False)
    )
    if not is_ca:
        # Libraries that ignore the common name look here; both ends are server and client.
        uses = [ExtendedKeyUsageOID.SERVER_AUTH, *(() if server_only else (ExtendedKeyUsageOID.CLIENT_AUTH,))]
        names = x509.SubjectAlternativeName([_general_name(host) for host in hosts or (name,)])
        by = x509.AuthorityKeyIdentifier.from_issuer_public_key(issuer_key.public_key())
        builder = builder.add_extension(names, critical=False)
        builder = builder.add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        builder = builder.add_extension(by, critical=False)
    return builder.sign(issuer_key, hashes.SHA256())


def _usage(is_ca: bool) -> x509.KeyUsage:
    """Return what the key may do: sign certificates, or handshakes."""
    others = ("content_commitment", "key_encipherment", "data_encipherment", "key_agreement", "encipher_only")
    return x509.KeyUsage(
        digital_signature=not is_ca,
        key_cert_sign=is_ca,
        crl_sign=is_ca,
        decipher_only=False,
        **dict.fromkeys(others, False),
    )


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _name(common: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common)])
