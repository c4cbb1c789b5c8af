"""From a real robot's URL to its driver. Knows the schemes; each driver is only loaded when it is asked for."""

from __future__ import annotations

from urllib.parse import parse_qs, urlsplit

from roboglot.drivers.driver import Driver
from roboglot.model.robot import Robot

SCHEMES = ("slamware",)


def drive(robot: Robot, url: str) -> Driver:
    """Give ``robot``, which has nothing yet, the components of the real one at ``url``. ValueError in plain words.

    ``slamware://HOST[:PORT]``.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname or "", parts.port
        options = parse_qs(parts.query, strict_parsing=bool(parts.query))
    except ValueError as error:
        raise ValueError(f"{url}: {error}") from None
    if not host or parts.path not in ("", "/") or parts.fragment or parts.username:
        raise ValueError(f"a robot's URL is SCHEME://HOST:PORT, not {url}")
    match parts.scheme:
        case "slamware" if not options:
            from roboglot.drivers.slamware.driver import PORT, SlamwareDriver

            return SlamwareDriver(robot, url, host, port or PORT)
        case _:
            raise ValueError(f"{url}: there are drivers for {', '.join(f'{s}://' for s in SCHEMES)}")
