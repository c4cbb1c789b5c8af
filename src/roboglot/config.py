"""Configuration: dataclasses, filled from one TOML file, the environment and the command line.

Precedence: command line over ``ROBOGLOT_*`` environment over the file over the defaults here.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import field
from datetime import UTC, tzinfo
from ipaddress import IPv4Address, ip_address
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import msgspec

from roboglot.spelling import instead
from roboglot.text_files import parse_toml, text_of
from roboglot.validation import host_and_port, path_of, why_invalid
from roboglot.values import dataclass

RECORDING = "recording:"  # prefix of the body of a recorded robot
ROBOTS_MAX = 100
REMEDY = "let people in by name ([access] or --access), or let everyone in (insecure = true or --insecure)"
Limit = Annotated[int, msgspec.Meta(ge=1, le=2**40)]
Port = Annotated[int, msgspec.Meta(ge=0, le=65535)]  # 0: any free port


@dataclass(frozen=True, slots=True)
class StartConfig:
    """Start of a simulated robot: m and rad in the world's frame, and its floor from 0 on."""

    x: float
    y: float
    yaw: float = 0.0
    floor: Annotated[int, msgspec.Meta(ge=0)] = 0


@dataclass(frozen=True, slots=True)
class RobotConfig:
    """One robot: name, body, and address of all its doors (empty: the one after the previous robot's).

    A body with "://" in it is the URL of a real robot, "slamware://192.168.11.1". ``start`` (else a dock, or beside the
    others) and ``serial`` (else made of seed and name) are for simulated robots. Where communicating robots meet, the
    one with the higher ``priority`` goes first.
    """

    name: str = "a"
    body: str = "universal"
    address: str = ""
    start: StartConfig | None = None
    priority: Annotated[int, msgspec.Meta(ge=-100, le=100)] = 0
    serial: Annotated[str, msgspec.Meta(max_length=64)] = ""

    @property
    def is_real(self) -> bool:
        """True for a real robot behind a driver."""
        return "://" in self.body

    @property
    def recording(self) -> str:
        """File of a recorded robot, "recording:FILE"; empty for all others."""
        return self.body.removeprefix(RECORDING) if self.body.startswith(RECORDING) else ""

    @property
    def is_simulated(self) -> bool:
        """True for a robot in the world."""
        return not (self.is_real or self.recording)


@dataclass(frozen=True, slots=True)
class ProgramsConfig:
    """Limits of one run of a program: bytes of memory beyond an empty program's, seconds of processor time, printed
    characters, depth of calls, calls of the robot per second, and seconds of real time (0: unlimited; suspended ones do
    not count). ``memory_together``: bytes of all programs; 0: 2 GiB, or half of the machine's memory.
    """

    memory: Limit = 64 * 1024 * 1024
    cpu: Limit = 300
    output: Limit = 4 * 1024 * 1024
    recursion: Annotated[int, msgspec.Meta(ge=1, le=10_000)] = 1000
    call_rate: Limit = 2000
    wall: Annotated[float, msgspec.Meta(ge=0)] = 0.0
    memory_together: Annotated[int, msgspec.Meta(ge=0)] = 0


@dataclass(frozen=True, slots=True)
class TlsConfig:
    """TLS on the ports of REST, block programs and the console: ``on`` with any [access.tls] in the file.

    ``certificate`` and ``key`` are PEM files; without them roboglot makes its own. ``plain``: the same ports accept
    unencrypted connections, too, for clients without TLS.
    """

    on: bool = False
    certificate: str = ""
    key: str = ""
    plain: bool = True

    def __post_init__(self) -> None:
        if bool(self.certificate) != bool(self.key):
            raise ValueError("[access.tls] needs both certificate and key, or neither")


@dataclass(frozen=True, slots=True)
class AccessConfig:
    """Access control: ``on`` with any [access] in the file, or with ``--access``. Without it, everyone has all rights.

    ``local``: programs on this machine need no credentials. Limits: ``requests`` and ``bytes`` (both directions) per
    second and client, simultaneous ``connections`` per address and door of a robot, ``logins`` (wrong passwords) per
    minute and address. ``gateway``: "HOST:PORT" for `roboglot connect`; empty: none. ``people``: the folder with the
    list of who may do what; empty: the data folder.
    """

    on: bool = False
    local: bool = True
    requests: Limit = 2000
    bytes: Limit = 20_000_000
    connections: Limit = 64
    logins: Limit = 10
    gateway: str = ""
    people: str = ""
    tls: TlsConfig = field(default_factory=TlsConfig)


@dataclass(frozen=True, slots=True)
class ConsoleConfig:
    """The web console, one for all robots: on ``port``, or the next free one. ``origins``, ``hosts``: as in [slamware].

    ``address``: outside loopback only with [access], like the robots' own addresses. ``otlp``: the URL of an
    OpenTelemetry collector to which metrics are pushed every ``otlp_period`` s; empty: none.
    """

    enabled: bool = True
    address: str = "127.0.0.1"
    port: Port = 50080
    origins: tuple[str, ...] = ()
    hosts: tuple[str, ...] = ()
    otlp: str = ""
    otlp_period: Annotated[float, msgspec.Meta(ge=1, le=3600)] = 10.0

    def __post_init__(self) -> None:
        if self.otlp and not self.otlp.startswith(("http://", "https://")):
            raise ValueError(f"console.otlp is the http:// or https:// address of a collector, not {self.otlp!r}")


@dataclass(frozen=True, slots=True)
class RecordConfig:
    """Recording: ``to`` a file or a folder from the start on; empty: only on request.

    ``ring`` keeps the last ``ring_seconds`` in memory and writes them at a robot's new fault. A file ends at
    ``part_bytes`` or ``part_seconds``, and the next one begins; all files together take at most ``total_bytes``.
    ``redact``: further names of fields to redact. ``truth``: with ground truth; ``video``: with the cameras;
    ``photos``: with photos and films fetched from real robots (those of simulated ones show no people).
    """

    to: str = ""
    ring: bool = False
    ring_seconds: Annotated[float, msgspec.Meta(ge=1, le=3600)] = 300.0
    part_bytes: Limit = 256 * 1024 * 1024
    part_seconds: Annotated[float, msgspec.Meta(ge=1)] = 3600.0
    total_bytes: Limit = 4 * 1024 * 1024 * 1024
    redact: tuple[str, ...] = ()
    truth: bool = True
    video: bool = False
    photos: bool = False


@dataclass(frozen=True, slots=True)
class Config:
    """Everything that ``roboglot up`` needs. ``speed`` of the clock; ``lockstep``: it stands until it is advanced.

    ``doors``: the doors' own sections by name; missing ones have their defaults.
    ``database``: URL of a PostgreSQL server for the robots' stored data, for a fleet on several machines; without it,
    they are in a file of the data folder. ``registry``: where programs agree on who runs which robot: a server's URL,
    or a file shared on one machine; default: ``database``; without either, programs do not check that.
    ``insecure``: robots may listen outside loopback without access control, so that all clients there may drive them.
    """

    world: str = "office"
    robots: tuple[RobotConfig, ...] = (RobotConfig(),)
    speed: float = 1.0
    lockstep: bool = False
    seed: int = 1
    data: Path = field(default_factory=lambda: default_data_folder(os.environ))
    database: str = ""
    registry: str = ""
    doors: Mapping[str, Any] = field(default_factory=dict)
    programs: ProgramsConfig = field(default_factory=ProgramsConfig)
    access: AccessConfig = field(default_factory=AccessConfig)
    console: ConsoleConfig = field(default_factory=ConsoleConfig)
    record: RecordConfig = field(default_factory=RecordConfig)
    insecure: bool = False

    def __post_init__(self) -> None:
        if self.lockstep and self.speed != 1.0:
            raise ValueError("speed has no effect in lockstep, where input advances time: leave one of them out")
        if self.access.gateway:
            host_and_port(self.access.gateway, "access.gateway")

    @property
    def exposed(self) -> tuple[RobotConfig, ...]:
        """The robots that other machines can reach."""
        return tuple(robot for robot in self.robots if not is_loopback(robot.address))


def is_address(host: str) -> bool:
    """Return True for an IP address, False for a name."""
    with suppress(ValueError):
        return bool(ip_address(host))
    return False


def is_loopback(host: str) -> bool:
    """Return True if ``host`` can only be this machine: 127.0.0.0/8, ::1, localhost and names below it."""
    try:
        address = ip_address(host)
    except ValueError:
        return host == "localhost" or host.endswith(".localhost")
    return (getattr(address, "ipv4_mapped", None) or address).is_loopback


def refuse_unguarded(config: Config) -> None:
    """Raise ValueError if other machines can reach a robot or the console without access control or ``insecure``."""
    guarded = config.insecure or config.access.on
    if config.console.enabled and not is_loopback(config.console.address) and not guarded:
        raise ValueError(
            f"others could open the console on {config.console.address} and drive every robot. Use 127.0.0.1, {REMEDY}"
        )
    if config.exposed and not guarded:
        listed = ", ".join(f"{robot.name} on {robot.address}" for robot in config.exposed)
        raise ValueError(
            f"others could reach robot {listed}, and its protocols require no password: everyone there could"
            f" drive it. Use an address of 127.0.0.0/8, {REMEDY}"
        )


def default_data_folder(environment: Mapping[str, str]) -> Path:
    """Return the user's data folder by the XDG rules. Raises ValueError for a user without a home folder."""
    if share := environment.get("XDG_DATA_HOME"):
        return Path(share) / "roboglot"
    home = environment.get("HOME") or os.path.expanduser("~")  # from the user database, where HOME is not set
    if home == "~":
        raise ValueError("there is no home folder to keep data in: choose a folder with --data")
    return Path(home) / ".local" / "share" / "roboglot"


def load_config(
    path: Path | None, overrides: Mapping[str, object], doors: Mapping[str, type] = MappingProxyType({})
) -> Config:
    """Read the file at ``path``, if any, and apply ``overrides`` that are not None. Raises ValueError with the key.

    The override ``address`` is that of the first robot. ``doors`` are the types of the doors' sections by name
    (``roboglot.protocols.sections()``).
    """
    try:
        values: dict[str, object] = parse_toml(text_of(path)) if path else {}
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    except ValueError as error:  # bad TOML, or not UTF-8
        raise ValueError(f"{path}: {error}") from None
    return config_of(values, overrides, doors, origin=str(path or "configuration"))


def config_of(
    values: dict[str, Any],
    overrides: Mapping[str, object] = MappingProxyType({}),
    doors: Mapping[str, type] = MappingProxyType({}),
    *,
    origin: str = "configuration",
) -> Config:
    """Return the configuration with a file's values; ``origin`` is for errors. Raises ValueError with the key."""
    values = dict(values)
    try:
        _refuse_unknown(values, Config, "", doors)
    except ValueError as error:
        raise ValueError(f"{origin}: {error}") from None
    if isinstance(values.get("access"), dict):
        values["access"] = {"on": True} | values["access"]
        if isinstance(values["access"].get("tls"), dict):
            values["access"]["tls"] = {"on": True} | values["access"]["tls"]
    for key, value in overrides.items():
        if key == "address" and value is not None:
            values["robots"] = _with_first_at(values.get("robots") or [{}], value)
        elif value is not None:
            before = values.get(key, {})
            values[key] = before | value if isinstance(value, dict) and isinstance(before, dict) else value
    door_values = {name: values.pop(name) for name in doors if name in values}
    try:
        config = msgspec.convert(values, Config, dec_hook=path_of)
    except msgspec.ValidationError as error:
        raise ValueError(f"{origin}: {why_invalid(error, wanted=Config)}") from None
    sections = {name: _section(name, doors[name], section, origin) for name, section in door_values.items()}
    return dataclasses.replace(config, robots=with_addresses(config.robots), doors=sections)


def _with_first_at(robots: object, address: object) -> object:
    """Return the tables of robots with the first one at ``address``; other values unchanged: they are refused later."""
    if isinstance(robots, list) and robots and isinstance(robots[0], dict):
        return [{**robots[0], "address": address}, *robots[1:]]
    return robots


def _section(name: str, kind: type, values: object, origin: str) -> object:
    """Return a door's own section. Raises ValueError with the key."""
    try:
        return msgspec.convert(values, kind)
    except msgspec.ValidationError as error:
        raise ValueError(f"{origin}: {why_invalid(error, field=name, wanted=kind)}") from None


def zone_of(name: str) -> tzinfo:
    """Return the time zone with this IANA name. Raises ValueError."""
    if name == "UTC":
        return UTC
    from zoneinfo import ZoneInfo

    try:
        return ZoneInfo(name)
    except (KeyError, ValueError, OSError):
        raise ValueError(f"there is no time zone {name!r} on this machine") from None


def parse_robot(text: str) -> RobotConfig:
    """Parse ``name=body``, ``name=body@address`` or ``name=body:x,y,yaw,floor@address``; ``body`` may be a real robot's
    URL or ``recording:FILE``. Raises ValueError."""
    name, equals, rest = text.partition("=")
    body, _, address = rest.partition("@")
    start = None
    if "://" not in body and not body.startswith(RECORDING):
        body, colon, where = body.partition(":")
        start = _start(text, where) if colon else None
    if not (name and equals and body):
        raise ValueError(f"a robot is name=body or name=URL, both with @address or without, not {text!r}")
    if not name.isidentifier():
        raise ValueError(f"a robot's name is letters, digits and _, and begins with no digit: not {name!r}")
    return RobotConfig(name, body, address, start)


def serial_of(seed: int, name: str) -> str:
    """Return the serial number of a robot whose configuration has none."""
    return f"RG-{seed:04d}-{name}"


def _start(text: str, where: str) -> StartConfig:
    """Return the start place ``x,y``, ``x,y,yaw`` or ``x,y,yaw,floor``. Raises ValueError."""
    numbers = where.split(",")
    try:
        x, y, yaw = map(float, [*numbers, "0"][:3])
        floor = int(numbers[3]) if len(numbers) > 3 else 0
    except ValueError:
        x, y, yaw, floor = math.nan, 0.0, 0.0, 0
    if not (2 <= len(numbers) <= 4 and math.isfinite(x + y + yaw) and floor >= 0):
        raise ValueError(f"a robot starts at x,y or x,y,yaw or x,y,yaw,floor (m, rad), not {where!r} in {text!r}")
    return StartConfig(x, y, yaw, floor)


def with_addresses(robots: tuple[RobotConfig, ...]) -> tuple[RobotConfig, ...]:
    """Fill empty addresses: 127.0.0.1 for the first robot, for each other one the address after the previous one's."""
    if started := [robot.name for robot in robots if robot.is_real and robot.start]:
        raise ValueError(f"robot {started[0]} is a real one: it starts where it stands")
    if not 1 <= len(robots) <= ROBOTS_MAX:
        raise ValueError(f"between 1 and {ROBOTS_MAX} robots, not {len(robots)}")
    filled: list[RobotConfig] = []
    for robot in robots:
        address = robot.address or (str(IPv4Address(filled[-1].address) + 1) if filled else "127.0.0.1")
        if not is_address(address) and (address.replace(".", "").isdigit() or not {*":,/ @"}.isdisjoint(address)):
            raise ValueError(f"robot {robot.name}: {address} is not an address")
        filled.append(dataclasses.replace(robot, address=address))
    kinds = {
        "name": [r.name for r in filled],
        "address": [r.address for r in filled],
        "serial number": [r.serial for r in filled if r.serial],
        "URL": [r.body for r in filled if r.is_real],  # one owner per connection
    }
    for what, values in kinds.items():
        if twice := {value for value in values if values.count(value) > 1}:
            raise ValueError(f"two robots have the {what} {twice.pop()}")
    return tuple(filled)


def _refuse_unknown(
    values: Mapping[str, object], kind: type, prefix: str, doors: Mapping[str, type] = MappingProxyType({})
) -> None:
    """Raise ValueError for a key that is not a setting, as a misspelt one would be ignored silently."""
    fields = {f.name: f.default_factory for f in dataclasses.fields(kind) if f.name != "doors"} | dict(doors)
    for key, value in values.items():
        if key not in fields:
            if not prefix and key in {field.name for field in dataclasses.fields(RobotConfig)}:
                raise ValueError(f"{key} is a setting of one robot: it belongs below [[robots]]")
            raise ValueError(f"{prefix + key} is not a setting{instead(key, fields)}")
        nested = {"robots": RobotConfig, "start": StartConfig}.get(key, fields[key])
        for entry in value if isinstance(value, list) else [value]:
            if isinstance(entry, dict) and isinstance(nested, type) and dataclasses.is_dataclass(nested):
                _refuse_unknown(entry, nested, f"{prefix}{key}.")
