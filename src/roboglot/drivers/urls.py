"""Makes drivers from the URLs of real robots. Imports a driver only when its scheme is used."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from urllib.parse import parse_qsl, urlsplit

from roboglot.drivers import DRIVERS
from roboglot.drivers.driver import Driver
from roboglot.drivers.driver_type import Target, Workshop
from roboglot.model.robot import Robot

OPTIONS_MAX = 16


class Drivers:
    """Makes the drivers of one program and holds their shared state. Without ``touches`` robots are only observed.

    ``own``: addresses of the program's own doors, which discovery ignores.
    """

    def __init__(self, *, own: Collection[str] = (), touches: bool = True) -> None:
        self._workshop = Workshop(own, touches)
        self._made: list[Driver] = []

    @property
    def all(self) -> Sequence[Driver]:
        """The drivers made so far."""
        return self._made

    def add(self, robot: Robot, url: str) -> None:
        """Give the bare ``robot`` the components of the real one at ``url``. Raises ValueError for a bad URL.

        ``slamware://HOST[:PORT]``, ``robomaster://HOST[:PORT]``, ``robomaster://discover``, and
        ``cyberdog://HOST[:PORT]?certs=FOLDER[&app=PORT]``: the folder has ca-cert.pem, client-cert.pem and
        client-key.pem, or is "none" for a dog on this machine that talks without TLS; the dog calls back at ``app``.
        RoboMasters take ``?event=PORT&video=PORT&audio=PORT&push=PORT&local=ADDRESS`` if not a real one's, and
        ``drive=speed`` for velocities that last until changed, instead of short moves.
        """
        try:
            parts = urlsplit(url)
            host, port = parts.hostname or "", parts.port
            options = dict(parse_qsl(parts.query, strict_parsing=bool(parts.query), max_num_fields=OPTIONS_MAX))
        except ValueError as error:
            raise ValueError(f"{url}: {error}") from None
        if not host or parts.path not in ("", "/") or parts.fragment or parts.username:
            raise ValueError(f"a robot's URL is SCHEME://HOST:PORT, not {url}")
        driver = next((driver for driver in DRIVERS if driver.scheme == parts.scheme), None)
        if driver is None:
            raise ValueError(f"{url}: there are drivers for {', '.join(f'{d.scheme}://' for d in DRIVERS)}")
        if unknown := options.keys() - driver.options:
            raise ValueError(f"{url}: unknown options: {', '.join(sorted(unknown))}")
        self._made.append(driver.make(self._workshop, robot, Target(url, host, port, options)))
