"""Passwords and tokens as stored: never in a form that grants access."""

from __future__ import annotations

import base64
import hashlib
import hmac
import secrets

PASSWORD_MIN, PASSWORD_MAX = 8, 256  # characters
TOKEN_BYTES = 32
_N, _R, _P = 1 << 14, 8, 1  # scrypt parameters: 16 MB and about 50 ms per hash
_SALT_BYTES, _KEY_BYTES = 16, 32


def new_token() -> str:
    """Return 256 random bits as text."""
    return secrets.token_urlsafe(TOKEN_BYTES)


def token_hash(token: str) -> str:
    """Return the stored form of a token; its 256 bits need no slow hash."""
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).hexdigest()


def password_hash(password: str) -> str:
    """Return the stored form of a password: "scrypt$salt$key". Raises ValueError if it is too short or too long."""
    if not PASSWORD_MIN <= len(password) <= PASSWORD_MAX:
        raise ValueError(f"a password has {PASSWORD_MIN} to {PASSWORD_MAX} characters")
    salt = secrets.token_bytes(_SALT_BYTES)
    return f"scrypt${_text(salt)}${_text(_derived(password, salt))}"


def password_fits(password: str, kept: str) -> bool:
    """Return whether a password matches its stored form; takes as long for an empty ``kept``, to reveal nothing."""
    kind, _, rest = kept.partition("$")
    salt, _, key = rest.partition("$")
    derived = _derived(password[: PASSWORD_MAX + 1], base64.b64decode(salt) or bytes(_SALT_BYTES))
    return kind == "scrypt" and hmac.compare_digest(derived, base64.b64decode(key))


def new_device(name: str, kept: str) -> str:
    """Return the mark of a browser in which ``name`` logged in with the password of stored form ``kept``.

    It needs no list: nothing but the stored form with its salt makes one, and a new password ends it.
    """
    nonce = secrets.token_urlsafe(_SALT_BYTES)
    return f"{nonce}.{_seal(nonce, name, kept)}"


def device_fits(device: str, name: str, kept: str) -> bool:
    """Return whether ``new_device`` has made this for the name and its present password."""
    nonce, _, seal = device.partition(".")
    made = _seal(nonce, name, kept).encode()
    return bool(kept and seal) and hmac.compare_digest(seal.encode("utf-8", "surrogatepass"), made)


def _seal(nonce: str, name: str, kept: str) -> str:
    text = f"device {nonce} {name}".encode("utf-8", "surrogatepass")
    return hmac.new(kept.encode(), text, hashlib.sha256).hexdigest()


def _derived(password: str, salt: bytes) -> bytes:
    data = password.encode("utf-8", "surrogatepass")
    return hashlib.scrypt(data, salt=salt, n=_N, r=_R, p=_P, dklen=_KEY_BYTES, maxmem=1 << 26)


def _text(data: bytes) -> str:
    return base64.b64encode(data).decode()
