"""The pages' files, read and compressed once, with a tag so that browsers fetch them only once."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
from collections.abc import Iterator
from functools import cache, cached_property
from pathlib import Path

from roboglot.values import dataclass

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
}
_COMMENT = re.compile(rb"^(?://.*|/\*\*.*\*/)$", re.MULTILINE)
STUDIO_FILES = "/studio/files.json"  # files that the studio's service worker keeps for use without a server
_INLINE = re.compile(rb'<script type="importmap">(.*?)</script>', re.DOTALL)


@dataclass(frozen=True, slots=True)
class Asset:
    """One file: its type, plain and compressed content."""

    content_type: str
    plain: bytes
    packed: bytes
    tag: str


@cache
def _paths() -> dict[str, Path]:
    files = ((path.relative_to(FOLDER).as_posix().removesuffix(".gz"), path) for path in sorted(FOLDER.rglob("*")))
    found = {f"/{name}": path for name, path in files if Path(name).suffix in TYPES}
    for folder in ("/", "/studio/", "/fleet/"):
        found[folder] = found[f"{folder}index.html"]
    found["/studio"] = found["/studio/"]
    return found


@cache
def _read(path: Path) -> Asset:
    plain, packed, kind = path.read_bytes(), b"", Path(path.name.removesuffix(".gz")).suffix
    if path.suffix == ".gz":  # large libraries are stored compressed; in a wheel all pages are
        packed, plain = plain, gzip.decompress(plain)
    if kind == ".js":  # comments are stripped from our own modules; line numbers stay
        packed, plain = b"", _COMMENT.sub(b"", plain)
    return Asset(TYPES[kind], plain, packed or gzip.compress(plain, 9, mtime=0), _tag(plain))


def _tag(plain: bytes) -> str:
    return f'"{hashlib.sha256(plain).hexdigest()[:24]}"'


@cache
def _studio_files() -> Asset:
    """Return the list of the studio's paths: its files, those shared with the console, and two answers."""
    console = ("/views/", "/app.js", "/index.html", "/studio/index.html", "/fleet/")
    paths = [path for path in _paths() if path not in ("/", "/studio") and not path.startswith(console)]
    plain = json.dumps([*paths, "/api/blocks", "/api/lessons"]).encode()
    return Asset(TYPES[".json"], plain, gzip.compress(plain, 9, mtime=0), _tag(plain))


class Assets:
    """All files below ``web``, by path ("/app.js"); "/" is the page itself. Each is read at its first use."""

    def find(self, path: str) -> Asset | None:
        """Return the file at ``path``; None if there is none."""
        if path == STUDIO_FILES:
            return _studio_files()
        found = _paths().get(path)
        return None if found is None else _read(found)

    def all(self) -> Iterator[tuple[str, Asset]]:
        """Yield every path with its file."""
        return ((path, _read(file)) for path, file in _paths().items())

    @cached_property
    def policy(self) -> bytes:
        """The Content-Security-Policy: no foreign content, no inline script but the import map, by its hash."""
        inline = _INLINE.search(_read(_paths()["/"]).plain)
        digest = base64.b64encode(hashlib.sha256(inline[1] if inline else b"").digest()).decode()
        return (
            f"default-src 'none'; script-src 'self' 'sha256-{digest}'; style-src 'self'; img-src 'self' blob: data:; "
            "media-src 'self'; "
            "connect-src 'self'; font-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; "
            "frame-ancestors 'none'"
        ).encode()
