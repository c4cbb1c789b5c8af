"""The pages' files, read once, compressed once, with a tag so that a browser asks for them only once."""

from __future__ import annotations

import base64
import gzip
import hashlib
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

FOLDER = Path(__file__).parent / "web"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".mjs": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".json": "application/json",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".gif": "image/gif",
    ".cur": "image/x-icon",
    ".mp3": "audio/mpeg",
}
_INLINE = re.compile(rb'<script type="importmap">(.*?)</script>', re.DOTALL)


@dataclass(frozen=True, slots=True)
class Asset:
    """One file: what it is, plain and packed."""

    content_type: str
    plain: bytes
    packed: bytes
    tag: str


class Assets:
    """All files below ``web``, by path ("/app.js"); "/" is the page itself."""

    @cached_property
    def _files(self) -> dict[str, Asset]:
        found = {}
        for path in sorted(FOLDER.rglob("*")):
            if path.suffix in TYPES:
                plain = path.read_bytes()
                tag = f'"{hashlib.sha256(plain).hexdigest()[:24]}"'
                asset = Asset(TYPES[path.suffix], plain, gzip.compress(plain, 9, mtime=0), tag)
                found["/" + path.relative_to(FOLDER).as_posix()] = asset
        for folder in ("/", "/studio/"):
            found[folder] = found[f"{folder}index.html"]
        found["/studio"] = found["/studio/"]
        return found

    def find(self, path: str) -> Asset | None:
        """The file at ``path``."""
        return self._files.get(path)

    @cached_property
    def policy(self) -> bytes:
        """The Content-Security-Policy: nothing from elsewhere, no inline script but the import map, by its hash."""
        inline = _INLINE.search(self._files["/"].plain)
        digest = base64.b64encode(hashlib.sha256(inline[1] if inline else b"").digest()).decode()
        return (
            f"default-src 'none'; script-src 'self' 'sha256-{digest}'; style-src 'self'; img-src 'self' blob: data:; "
            "connect-src 'self'; font-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; "
            "frame-ancestors 'none'"
        ).encode()
