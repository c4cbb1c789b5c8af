"""Gets pip itself, as a wheel, for a Python that came without it.

Looks where pip would look (PIP_* variables, pip.conf, find-links, proxies, certificates), takes exactly the version in
requirements/pip.lock and believes nothing whose SHA-256 is not written there. Standard library only. Knows no virtual
environment and installs nothing: see bootstrap.py.
"""

from __future__ import annotations

import base64
import configparser
import hashlib
import netrc
import os
import re
import ssl
import time
import urllib.error
import urllib.request
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urljoin, urlsplit, urlunsplit

INDEX = "https://pypi.org/simple"
PAGE_BYTES_MAX = 32 * 1024 * 1024
ATTEMPTS_MAX = 3
TIMEOUT_S = 30.0


class WheelUnavailable(Exception):
    """No place gave the wheel with the right checksum; the text says what each place answered."""


@dataclass(frozen=True, slots=True)
class Pin:
    """One locked wheel: its file name and the SHA-256 digests (hex) that are good."""

    filename: str
    digests: frozenset[str]

    def accepts(self, content: bytes) -> bool:
        return hashlib.sha256(content).hexdigest() in self.digests


def read_pin(lock: str) -> Pin:
    """Reads `pip==X --hash=sha256:…` from the text of requirements/pip.lock; ValueError if it is something else."""
    version = re.search(r"^pip==([\w.]+)", lock, re.MULTILINE)
    digests = frozenset(re.findall(r"--hash=sha256:([0-9a-f]{64})", lock))
    if version is None or not digests:
        raise ValueError("requirements/pip.lock holds no pip with a hash")
    return Pin(f"pip-{version[1]}-py3-none-any.whl", digests)


def config_files(environ: Mapping[str, str]) -> list[Path]:
    """pip's configuration files, the weakest first, as pip's manual ("Configuration files") orders them."""
    chosen = environ.get("PIP_CONFIG_FILE")
    if chosen == os.devnull:
        return []
    home = Path(environ.get("HOME") or "/nonexistent")
    system = environ.get("XDG_CONFIG_DIRS") or "/etc/xdg"
    files = [Path(place) / "pip/pip.conf" for place in reversed(system.split(":"))] + [Path("/etc/pip.conf")]
    files.append(home / ".pip/pip.conf")
    files.append(Path(environ.get("XDG_CONFIG_HOME") or home / ".config") / "pip/pip.conf")
    return [*files, Path(chosen)] if chosen else files


def pip_settings(environ: Mapping[str, str], files: Iterable[Path]) -> dict[str, str]:
    """What pip would use for `install`: PIP_* over [install] over [global], keys in kebab-case; skips bad files."""
    sections: dict[str, dict[str, str]] = {"global": {}, "install": {}}
    for file in files:
        parser = configparser.RawConfigParser()
        try:
            parser.read(file, encoding="utf-8")
        except (configparser.Error, OSError, UnicodeDecodeError):
            continue
        for name, values in sections.items():
            if parser.has_section(name):
                values.update((key.replace("_", "-"), value) for key, value in parser.items(name))
    variables = {key[4:].lower().replace("_", "-"): value for key, value in environ.items() if key.startswith("PIP_")}
    return {**sections["global"], **sections["install"], **{key: value for key, value in variables.items() if value}}


def pages(settings: Mapping[str, str]) -> list[str]:
    """Places to look, in order: find-links (folders or pages), then the indexes' pages about pip."""
    places = settings.get("find-links", "").split()
    if settings.get("no-index", "").lower() in {"1", "true", "yes", "on"}:
        return places
    indexes = [settings.get("index-url", INDEX), *settings.get("extra-index-url", "").split()]
    return places + [f"{index.rstrip('/')}/pip/" for index in indexes]


class _Links(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "a":
            self.found.extend(value for name, value in attrs if name == "href" and value)


def find_wheel(html: str, page_url: str, filename: str) -> str | None:
    """The absolute URL of the file on a "simple" index page (PEP 503) or a find-links page; None if it isn't there."""
    links = _Links()
    links.feed(html)
    for link in links.found:
        target = urljoin(page_url, link)
        if unquote(urlsplit(target).path).rpartition("/")[2] == filename:
            return urlunsplit(urlsplit(target)._replace(fragment=""))
    return None


def split_credentials(url: str) -> tuple[str, str | None]:
    """The URL without user and password, and `user:password` from it or from ~/.netrc, if there is one."""
    parts = urlsplit(url)
    user, at, host = parts.netloc.rpartition("@")
    if at:
        return urlunsplit(parts._replace(netloc=host)), unquote(user)
    try:
        entry = netrc.netrc().authenticators(parts.hostname or "") if parts.scheme.startswith("http") else None
    except (OSError, netrc.NetrcParseError, RuntimeError, KeyError):
        entry = None
    return url, f"{entry[0]}:{entry[2]}" if entry else None


def _has_certificates() -> bool:
    paths = ssl.get_default_verify_paths()
    return paths.cafile is not None or (paths.capath is not None and any(Path(paths.capath).iterdir()))


def _context(url: str, settings: Mapping[str, str], secret: bool) -> ssl.SSLContext:
    own = settings.get("cert") or os.environ.get("REQUESTS_CA_BUNDLE") or os.environ.get("CURL_CA_BUNDLE")
    parts = urlsplit(url)
    if {parts.hostname, parts.netloc} & set(settings.get("trusted-host", "").split()):
        return ssl._create_unverified_context()
    if own:
        folder = Path(own).is_dir()
        return ssl.create_default_context(cafile=None if folder else own, capath=own if folder else None)
    if not secret and not _has_certificates():
        # A system with no certificates at all can't check anybody. What comes is checked by its SHA-256 (or is a page
        # of links to what is), and pip then brings its own certificates for everything else.
        return ssl._create_unverified_context()
    return ssl.create_default_context()


def read_url(url: str, settings: Mapping[str, str]) -> tuple[bytes, str]:
    """Content and final URL; OSError (so URLError too) when it can't be had, ValueError when it is too long."""
    bare, credentials = split_credentials(url)
    if bare.startswith("file:") and bare.endswith("/"):
        bare += "index.html"
    request = urllib.request.Request(bare, headers={"Accept": "text/html, */*", "User-Agent": "roboglot-bootstrap"})
    if credentials:
        token = base64.b64encode(credentials.encode()).decode()
        request.add_unredirected_header("Authorization", f"Basic {token}")
    proxy = settings.get("proxy")
    opener = urllib.request.build_opener(
        urllib.request.ProxyHandler({"http": proxy, "https": proxy} if proxy else None),
        urllib.request.HTTPSHandler(context=_context(bare, settings, secret=credentials is not None)),
    )
    for attempt in range(1, ATTEMPTS_MAX + 1):
        try:
            with opener.open(request, timeout=float(settings.get("default-timeout", TIMEOUT_S))) as response:
                content: bytes = response.read(PAGE_BYTES_MAX + 1)
                if len(content) > PAGE_BYTES_MAX:
                    raise ValueError(f"more than {PAGE_BYTES_MAX} bytes")
                return content, response.geturl()
        except OSError as error:
            refused = isinstance(error, urllib.error.HTTPError) and error.code < 500
            if refused or attempt == ATTEMPTS_MAX or bare.startswith("file:"):
                raise
            time.sleep(attempt)
    raise AssertionError("the loop returns or raises")


def _from_place(place: str, pin: Pin, settings: Mapping[str, str]) -> bytes | None:
    if "://" not in place and not place.startswith("file:"):
        file = Path(place) / pin.filename
        return file.read_bytes() if file.is_file() else None
    page, page_url = read_url(place, settings)
    url = find_wheel(page.decode("utf-8", "replace"), page_url, pin.filename)
    if url is None:
        return None
    user = urlsplit(place).netloc.rpartition("@")[0]
    parts = urlsplit(url)
    if user and parts.netloc == urlsplit(page_url).netloc:
        url = urlunsplit(parts._replace(netloc=f"{user}@{parts.netloc}"))
    return read_url(url, settings)[0]


def get_wheel(pin: Pin, folder: Path, settings: Mapping[str, str]) -> Path:
    """The checked wheel in the folder, from there if it is there already; WheelUnavailable if no place has it."""
    target = folder / pin.filename
    if target.is_file() and pin.accepts(target.read_bytes()):
        return target
    answers = []
    for place in pages(settings):
        name = split_credentials(place)[0]
        try:
            content = _from_place(place, pin, settings)
        except (OSError, ValueError) as error:
            answers.append(f"{name}: {error}")
            continue
        if content is None:
            answers.append(f"{name}: has no {pin.filename}")
        elif not pin.accepts(content):
            answers.append(f"{name}: wrong checksum, refused")
        else:
            part = target.with_suffix(".part")
            part.write_bytes(content)
            part.replace(target)
            return target
    raise WheelUnavailable("\n".join(answers) or "no package index is configured")
