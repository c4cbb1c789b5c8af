"""Protection from foreign web pages, by a request's Host, Origin, Referer and Sec-Fetch-* headers.

The protocols have no authentication of their own, and every page in every browser of this machine reaches loopback. So
a request is refused when a page of another host sent it (Origin), or when its Host is a name that may have been rebound
to this machine's address. Programs other than browsers send no Origin and an address or a known name as Host.
"""

from __future__ import annotations

import logging
import re
import socket
from collections.abc import Collection, Sequence
from functools import lru_cache
from ipaddress import ip_address
from urllib.parse import urlsplit

from roboglot.config import REMEDY, is_loopback
from roboglot.model.admission import Admission
from roboglot.protocols.forwarding import HEADERS, elsewhere_of
from roboglot.values import dataclass

log = logging.getLogger(__name__)

ANY = "*"
ORIGIN_MAX = 2048  # characters of a Host, an Origin or a Referer
VERDICTS_MAX = 256  # cached, so that a client's next request costs one look-up
WARNINGS_MAX = 64  # different refusals logged as warnings; later ones only with --verbose
_HOST = re.compile(r"(?:\[([0-9A-Fa-f:.]+)\]|([A-Za-z0-9._-]+))(?::\d{1,5})?")
_ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://[^/?#@\s]+")


@dataclass(frozen=True, slots=True)
class Headers:
    """Headers that say where a request comes from; None and empty where they are missing."""

    host: str | None = None
    origin: str | None = None
    referer: str | None = None
    site: str = ""  # Sec-Fetch-Site
    opens_page: bool = False  # a navigation by link, bookmark or address bar
    elsewhere: str = ""  # the other machine for which a proxy on this one passes the request on


class Browsers:
    """The rule of one door. ``setting`` names its part of the configuration, for messages; empty: it has none.

    ``origins``: pages of other hosts that may use the door ("https://studio.example"), or "*" for all. ``hosts``: names
    of this machine beside its addresses, localhost and its own host name. ``admission``: where it asks for no names,
    requests that a proxy passes on for other machines are refused. Raises ValueError for what is not an origin.
    """

    def __init__(
        self,
        setting: str,
        origins: Sequence[str] = (),
        hosts: Sequence[str] = (),
        admission: Admission | None = None,
    ) -> None:
        self._setting, self._admission = setting, admission
        self._origins = frozenset(_checked(setting, origin) for origin in origins)
        self._hosts = own_names() | {host.lower().rstrip(".") for host in hosts}
        self._warned: set[str] = set()
        self._verdict = lru_cache(VERDICTS_MAX)(self._judge)

    @property
    def any_origin(self) -> bool:
        """True if every page may use the door."""
        return ANY in self._origins

    def warn_if_open(self) -> None:
        """Log, at a door's start, that it serves every web page."""
        if self.any_origin:
            log.warning(
                '%s origins = ["*"]: every web page in every browser that reaches this robot may command it',
                self._setting,
            )

    def refusal(self, headers: Headers) -> str:
        """Return the reason for a refusal, worded for the sender; empty if the request may pass."""
        why = self._verdict(headers)
        if why:
            new = why not in self._warned and len(self._warned) < WARNINGS_MAX
            self._warned.add(why) if new else None
            log.log(logging.WARNING if new else logging.DEBUG, "refused a request: %s", why)
        return why

    def _judge(self, headers: Headers) -> str:
        if any(len(text or "") > ORIGIN_MAX for text in (headers.host, headers.origin, headers.referer)):
            return f"its Host, Origin or Referer is longer than {ORIGIN_MAX} characters"
        host = None if headers.host is None else host_name(headers.host)
        if headers.host is not None and not self._knows(host):
            return (
                f"its Host {headers.host!r} is neither an address nor a known name of this machine"
                f"{self._hint('hosts', 'adds names')}"
            )
        if headers.elsewhere and not self._admits_outsiders:
            remedy = f": {REMEDY}" if self._setting else ""
            return f"a proxy passes it on for {headers.elsewhere}, and only programs of this machine may use it{remedy}"
        page = headers.origin
        if page is None and headers.site == "cross-site" and not headers.opens_page:
            page = _origin_of(headers.referer)  # pictures and scripts on other pages are requested without an Origin
        if page is None or self._welcomes(page, host):
            return ""
        return f"it comes from a web page of {page!r}{self._hint('origins', 'lets pages of other hosts in')}"

    @property
    def _admits_outsiders(self) -> bool:
        return self._admission is None or self._admission.enforced or self._admission.outsiders

    def _hint(self, key: str, does: str) -> str:
        return f" ({self._setting} {key} {does})" if self._setting else ""

    def _knows(self, host: str | None) -> bool:
        return host is not None and (_is_address(host) or host.endswith(".localhost") or host in self._hosts)

    def _welcomes(self, origin: str, host: str | None) -> bool:
        """Return whether a page of ``origin`` may use the door as ``host``."""
        if self.any_origin or origin.lower() in self._origins:
            return True
        try:
            parts = urlsplit(origin)
            page = parts.hostname
        except ValueError:
            return False
        if page is None or host is None or parts.scheme not in ("http", "https"):
            return False
        page = page.rstrip(".")
        return page == host or (_is_this_machine(page) and is_loopback(host))


def _is_this_machine(page: str) -> bool:
    """Return whether a page's host is this machine; other loopback addresses are robots or tunnels, so untrusted."""
    return page in ("127.0.0.1", "::1", "localhost") or page.endswith(".localhost")


def own_names() -> set[str]:
    """Return the names of this machine, locally and by mDNS."""
    name = socket.gethostname().lower()
    return {"localhost", name, f"{name.partition('.')[0]}.local"}


def host_name(text: str) -> str | None:
    """Return the name or address in a Host header, lower case, without port and brackets; None if malformed."""
    match = _HOST.fullmatch(text)
    return (match[1] or match[2]).lower().rstrip(".") if match else None


def of_rows(rows: Collection[tuple[bytes, bytes]], method: str) -> Headers:
    """Read the header rows (names in lower case) of an ASGI request."""
    texts = {name: value.decode("latin-1") for name, value in rows if name in _NAMES}
    found = {name.decode(): value for name, value in texts.items()}
    elsewhere = ""
    if not HEADERS.isdisjoint(texts):  # they may be repeated
        elsewhere = elsewhere_of(value.decode("latin-1") for name, value in rows if name in HEADERS)
    opens_page = (
        method == "GET" and found.get("sec-fetch-mode") == "navigate" and found.get("sec-fetch-dest") == "document"
    )
    return Headers(
        found.get("host"),
        found.get("origin"),
        found.get("referer"),
        found.get("sec-fetch-site", ""),
        opens_page,
        elsewhere,
    )


_NAMES = HEADERS | {b"host", b"origin", b"referer", b"sec-fetch-site", b"sec-fetch-mode", b"sec-fetch-dest"}


def _is_address(host: str) -> bool:
    try:
        ip_address(host)
    except ValueError:
        try:
            socket.inet_aton(host)  # the short form of an address: 127.1
        except OSError:
            return False
    return True


def _origin_of(referer: str | None) -> str:
    """Return the origin of the page in a Referer; "null" if it is hidden."""
    match = _ORIGIN.match(referer or "")
    return match[0] if match else "null"


def _checked(setting: str, origin: str) -> str:
    """Return an origin of the configuration in the form that browsers send."""
    text = origin.lower().rstrip("/")
    if text not in (ANY, "null") and not _ORIGIN.fullmatch(text):
        raise ValueError(f'{setting} origins: {origin!r} is not an origin; write "https://studio.example", or "*"')
    return text
