"""From a real robot's URL to its driver. Knows the schemes; each driver is only loaded when it is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from roboglot.drivers.driver import Driver
from roboglot.model.robot import Robot

if TYPE_CHECKING:
    from roboglot.clients.robomaster.datagrams import PushPort

SCHEMES = ("slamware", "robomaster")
PORT_OPTIONS = ("event", "video", "audio", "push")


class Drivers:
    """Makes those of one program: what they share is shared here."""

    def __init__(self) -> None:
        self._made: list[Driver] = []
        self._pushes: dict[tuple[str, int], PushPort] = {}  # a UDP port is had once

    @property
    def all(self) -> Sequence[Driver]:
        """Those that were made."""
        return self._made

    def drive(self, robot: Robot, url: str) -> None:
        """Give ``robot``, which has nothing yet, the components of the real one at ``url``. ValueError in plain words.

        ``slamware://HOST[:PORT]``, ``robomaster://HOST[:PORT]`` and ``robomaster://discover``. RoboMasters take
        ``?event=PORT&video=PORT&audio=PORT&push=PORT&local=ADDRESS`` where those are not a real robot's.
        """
        try:
            parts = urlsplit(url)
            host, port = parts.hostname or "", parts.port
            options = dict(parse_qsl(parts.query, strict_parsing=bool(parts.query), max_num_fields=16))
            ports = {name: int(options.pop(name)) for name in PORT_OPTIONS if name in options}
        except ValueError as error:
            raise ValueError(f"{url}: {error}") from None
        if not host or parts.path not in ("", "/") or parts.fragment or parts.username:
            raise ValueError(f"a robot's URL is SCHEME://HOST:PORT, not {url}")
        match parts.scheme:
            case "slamware" if not options and not ports:
                from roboglot.drivers.slamware.driver import PORT, SlamwareDriver

                self._made.append(SlamwareDriver(robot, url, host, port or PORT))
            case "robomaster" if not options.keys() - {"local"}:
                if port:
                    ports["control"] = port
                self._made.append(self._robomaster(robot, url, host, ports, options.get("local")))
            case "slamware" | "robomaster":
                raise ValueError(f"{url}: what is {', '.join([*options, *ports])}?")
            case _:
                raise ValueError(f"{url}: there are drivers for {', '.join(f'{s}://' for s in SCHEMES)}")

    def _robomaster(self, robot: Robot, url: str, host: str, given: dict[str, int], local: str | None) -> Driver:
        from roboglot.clients.robomaster.client import Ports
        from roboglot.clients.robomaster.datagrams import PushPort
        from roboglot.drivers.robomaster.driver import RoboMasterDriver

        ports = Ports(**given)
        key = local or "", ports.push
        pushes = self._pushes.setdefault(key, PushPort(*key))
        return RoboMasterDriver(robot, url, host, ports, local=local, pushes=pushes)
