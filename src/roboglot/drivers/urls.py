"""Makes drivers from the URLs of real robots. Imports a driver only when its scheme is used."""

from __future__ import annotations

import logging
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlsplit

from roboglot.drivers.driver import Driver
from roboglot.model.robot import Robot

if TYPE_CHECKING:
    from roboglot.clients.robomaster.datagrams import PushPort
    from roboglot.drivers.robomaster.watchdog import Watchdog

log = logging.getLogger(__name__)
SCHEMES = ("slamware", "robomaster", "cyberdog")
PLAINTEXT = "none"  # instead of a folder of certificates
BOUNDED = "move"  # how an EP is driven, unless ``drive=speed``
PORT_OPTIONS = ("event", "video", "audio", "push")


class Drivers:
    """Makes the drivers of one program and holds what they share. Without ``touches`` robots are only observed.

    ``own``: addresses of the program's own doors, which discovery ignores.
    """

    def __init__(self, *, own: Collection[str] = (), touches: bool = True) -> None:
        self._own, self._touches = own, touches
        self._made: list[Driver] = []
        self._pushes: dict[tuple[str, int], PushPort] = {}  # a UDP port can be bound once
        self._watchdog: Watchdog | None = None

    @property
    def all(self) -> Sequence[Driver]:
        """The drivers made so far."""
        return self._made

    def drive(self, robot: Robot, url: str) -> None:
        """Give the bare ``robot`` the components of the real one at ``url``. Raises ValueError for a bad URL.

        ``slamware://HOST[:PORT]``, ``robomaster://HOST[:PORT]``, ``robomaster://discover``, and
        ``cyberdog://HOST[:PORT]?certs=FOLDER[&app=PORT]``: the folder has ca-cert.pem, client-cert.pem and
        client-key.pem, or is "none" for a dog on this machine that talks without TLS; the dog calls back at ``app``.
        RoboMasters take ``?event=PORT&video=PORT&audio=PORT&push=PORT&local=ADDRESS`` where those are not a real one's,
        and ``drive=speed`` to be driven by velocities that stand until they are changed.
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

                self._made.append(SlamwareDriver(robot, url, host, port or PORT, touches=self._touches))
            case "robomaster" if not options.keys() - {"local", "drive"}:
                if port:
                    ports["control"] = port
                self._made.append(self._robomaster(robot, url, host, ports, options))
            case "cyberdog" if not ports and options.keys() <= {"certs", "app"} and "certs" in options:
                self._made.append(_cyberdog(robot, url, host, port, options, touches=self._touches))
            case "cyberdog" if "certs" not in options:
                raise ValueError(f"{url}: a CyberDog requires certificates: cyberdog://HOST?certs=FOLDER")
            case "slamware" | "robomaster" | "cyberdog":
                raise ValueError(f"{url}: unknown options: {', '.join([*options, *ports])}")
            case _:
                raise ValueError(f"{url}: there are drivers for {', '.join(f'{s}://' for s in SCHEMES)}")

    def _robomaster(
        self, robot: Robot, url: str, host: str, given: dict[str, int], options: Mapping[str, str]
    ) -> Driver:
        from roboglot.clients.robomaster.client import Ports
        from roboglot.clients.robomaster.datagrams import PushPort
        from roboglot.drivers.robomaster.driver import Endpoint, RoboMasterDriver
        from roboglot.drivers.robomaster.watchdog import Watchdog

        if (drive := options.get("drive", BOUNDED)) not in (BOUNDED, "speed"):
            raise ValueError(f"{url}: drive is {BOUNDED} (moves that end by themselves) or speed, not {drive}")
        ports, local = Ports(**given), options.get("local")
        key = local or "", ports.push
        pushes = self._pushes.setdefault(key, PushPort(*key))
        watchdog = self._watchdog = self._watchdog or Watchdog()
        return RoboMasterDriver(
            robot,
            url,
            Endpoint(host, ports, local, bounded=drive == BOUNDED),
            pushes=pushes,
            watchdog=watchdog,
            own=self._own,
            touches=self._touches,
        )


def _cyberdog(robot: Robot, url: str, host: str, port: int | None, options: dict[str, str], *, touches: bool) -> Driver:
    from roboglot.clients.cyberdog import Certificates
    from roboglot.clients.errors import LinkLost
    from roboglot.drivers.cyberdog.driver import CyberDogDriver
    from roboglot.wire.cyberdog.channel import APP_PORT, ROBOT_PORT

    folder = options["certs"]

    def certificates() -> Certificates | None:
        try:
            return None if folder == PLAINTEXT else Certificates.load(Path(folder))
        except OSError as error:
            log.warning("cannot read the certificates in %s: %s", folder, error)
            raise LinkLost(f"cannot read its certificates: {error.strerror or 'damaged file'}") from None

    if not options.get("app", "1").isdigit():
        raise ValueError(f"{url}: app is a port")
    app_port = int(options.get("app", APP_PORT))
    return CyberDogDriver(robot, url, host, port or ROBOT_PORT, certificates, app_port=app_port, touches=touches)
