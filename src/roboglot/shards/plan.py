"""Plan of a fleet: its shards with their settings, robots and addresses, and its file."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from ipaddress import IPv4Address, ip_address
from pathlib import Path
from typing import Any

import msgspec

from roboglot.config import RECORDING, ROBOTS_MAX, Config, ConsoleConfig, is_loopback, refuse_unguarded
from roboglot.hosting.error_text import in_words
from roboglot.shards.shard import settings_of
from roboglot.spelling import instead, meant
from roboglot.validation import host_and_port

WORLDS_MAX = 500
FIRST_ADDRESS = "127.10.0.1"
PLAN = "fleet.json"
RECORDED = ".mcap"
FILES = {"registry", "people", "certificate", "key", "to", "cloud", "uart", "ca"}  # settings, of sections, too
NAMES_OR_FILES, SUFFIX = {"world", "body"}, re.compile(r"\.(toml|ya?ml)(\+|$)")
PORT_MAX = 65535
NAMES = "abcdefghijklmnopqrstuvwxyz"


class ShardPlan(msgspec.Struct):
    """One shard: its name and its settings, as a configuration file has them."""

    name: str
    settings: dict[str, Any]

    @property
    def robots(self) -> list[str]:
        """Names of its robots."""
        return [robot["name"] for robot in self.settings["robots"]]


class FleetPlan(msgspec.Struct):
    """All shards. ``request``: the options of the first start, to compare them at the next one."""

    request: dict[str, object]
    shards: list[ShardPlan]

    def home_of(self, robot: str) -> ShardPlan:
        """Return the shard of a robot. Raises LookupError."""
        for shard in self.shards:
            if robot in shard.robots:
                return shard
        raise LookupError(f"there is no robot {robot!r} in this fleet{meant(robot, self._robots)}")

    def shard(self, name: str) -> ShardPlan:
        """Return a shard by name. Raises LookupError."""
        for shard in self.shards:
            if shard.name == name:
                return shard
        raise LookupError(f"there is no shard {name!r}{instead(name, self._names)}")

    def find(self, name: str) -> ShardPlan:
        """Return the shard of this name, or of the robot of this name. Raises LookupError."""
        for shard in self.shards:
            if name == shard.name or name in shard.robots:
                return shard
        guess = meant(name, [*self._names, *self._robots]) or instead(name, self._names)
        raise LookupError(f"there is no shard and no robot {name!r}{guess}")

    @property
    def _names(self) -> list[str]:
        return [shard.name for shard in self.shards]

    @property
    def _robots(self) -> list[str]:
        return [robot for shard in self.shards for robot in shard.robots]


def plan_fleet(
    worlds: int, robots_each: int, template: dict[str, Any], data: Path, *, first: str = FIRST_ADDRESS
) -> FleetPlan:
    """Plan ``worlds`` shards from a template. Raises ValueError in plain words.

    The template is a configuration as for ``roboglot up``. Its robots, or ``robots_each`` of body "universal", are in
    every world, with the world's number after their names: a1, a2, … Every robot has its own address.
    """
    if not 1 <= worlds <= WORLDS_MAX:
        raise ValueError(f"between 1 and {WORLDS_MAX} worlds, not {worlds}")
    if not 0 <= robots_each <= ROBOTS_MAX:
        raise ValueError(f"between 1 and {ROBOTS_MAX} robots in each world, not {robots_each}")
    _refuse_unshareable(settings_of(template, origin="the template"), worlds)
    request = {"worlds": worlds, "first_address": first, "template": template}
    template = _anchored(template)
    robots = template.get("robots") or _robots(robots_each or 1)
    if robots_each and template.get("robots") and len(robots) != robots_each:
        raise ValueError(f"the template has {len(robots)} robots in a world, but --robots-each is {robots_each}")
    if any(robot.get("address") or robot.get("serial") for robot in robots):
        raise ValueError(
            "robots of a template must not have addresses or serial numbers: each world needs its own; see"
            " --first-address"
        )
    if "data" in template:
        raise ValueError("a template must not have `data`: each world has a folder of its own in that of --data")
    addresses = _addresses(first, worlds * len(robots))
    shards: list[ShardPlan] = []
    for number in range(1, worlds + 1):
        settings = dict(template)
        settings["data"] = str(data / "shards" / f"w{number}" / "data")
        settings["robots"] = [
            {**robot, "name": f"{robot.get('name', 'a')}{number}", "address": next(addresses)} for robot in robots
        ]
        if to := template.get("record", {}).get("to"):
            settings["record"] = {**template["record"], "to": f"{to}/w{number}/"}
        if "access" in template:
            settings["access"] = _access(template["access"], data, number)
        settings["console"] = _console(template, settings["robots"][0]["address"], number)
        settings["seed"] = int(template.get("seed", 1)) + number - 1
        shards.append(ShardPlan(f"w{number}", settings))
    plan = FleetPlan({**request, "robots_each": len(robots)}, shards)
    for shard in (plan.shards[0], plan.shards[-1]):  # they differ only in names, addresses and ports
        refuse_unguarded(checked(shard))
    return plan


def _refuse_unshareable(config: Config, worlds: int) -> None:
    """Raise ValueError if several worlds cannot have these settings."""
    if config.lockstep:
        raise ValueError("a template must not have `lockstep`: worlds of a fleet have no standard input")
    if not 0.0 < config.speed < math.inf:
        raise ValueError(f"the template: speed must be above 0, not {config.speed:g}")
    if worlds > 1 and (real := next((robot.body for robot in config.robots if robot.is_real), "")):
        raise ValueError(f"{worlds} worlds cannot share the real robot {real}")
    if (to := Path(config.record.to)).suffix == RECORDED:
        raise ValueError(f"worlds cannot share the recording {to}: `to` must be a folder, in which each has its own")


def checked(shard: ShardPlan) -> Config:
    """Return the shard's configuration. Raises ValueError."""
    return settings_of(shard.settings)


def save(plan: FleetPlan, folder: Path) -> None:
    """Write the plan; one that is stored already is left alone, as the disk may be full. Raises OSError."""
    _store(msgspec.json.format(msgspec.json.encode(plan), indent=1), folder)


def _store(text: bytes, folder: Path) -> None:
    """Write a plan, which may hold a database's password, for its owner only; a crash leaves the old or the new one."""
    stored, fresh = folder / PLAN, folder / f"{PLAN}.new"
    if _text_in(folder) == text:
        return
    try:
        with fresh.open("wb") as file:
            os.fchmod(file.fileno(), 0o600)
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(stored)
    except OSError as error:
        fresh.unlink(missing_ok=True)
        raise OSError(error.errno, error.strerror, str(stored)) from None


class EarlierPlan:
    """Copy of a folder's plan, or the fact that it has none, to be restored if a new plan fails."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._text = folder, _text_in(folder)

    def restore(self) -> bool:
        """Put the earlier plan back; return False if it has not been replaced. Raises OSError."""
        if _text_in(self._folder) == self._text:
            return False
        if self._text is None:
            (self._folder / PLAN).unlink()
        else:
            _store(self._text, self._folder)
        return True


def _text_in(folder: Path) -> bytes | None:
    return (folder / PLAN).read_bytes() if (folder / PLAN).is_file() else None


def load(folder: Path) -> FleetPlan | None:
    """Return the plan in ``folder``; None if there is none. Raises ValueError."""
    try:
        return msgspec.json.decode((folder / PLAN).read_bytes(), type=FleetPlan)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise ValueError(in_words(error)) from None
    except msgspec.DecodeError as error:
        raise ValueError(f"{folder / PLAN} cannot be read: {error}") from None


def _anchored(value: Any, name: str = "") -> Any:
    """Return settings with absolute names of files: the next `fleet up` may run in another folder."""
    match value:
        case dict():
            return {name: _anchored(inner, name) for name, inner in value.items()}
        case list():
            return [_anchored(inner, name) for inner in value]
        case str() if name == "body" and value.startswith(RECORDING):
            return RECORDING + str(Path(value.removeprefix(RECORDING)).absolute())
        case str() if value and "://" not in value:
            is_file = name in FILES or (name in NAMES_OR_FILES and SUFFIX.search(value))
            return str(Path(value).absolute()) if is_file else value
    return value


def _robots(count: int) -> list[dict[str, object]]:
    if count <= len(NAMES):
        return [{"name": name, "body": "universal"} for name in NAMES[:count]]
    return [{"name": f"r{number}_", "body": "universal"} for number in range(1, count + 1)]


def _console(template: dict[str, Any], address: str, number: int) -> dict[str, Any]:
    """Return the console's settings, by default at the address of the world's first robot."""
    given = dict(template.get("console", {}))
    if given.get("address") and (port := given.get("port", ConsoleConfig().port)):  # one address: separate ports
        given["port"] = _port(port, number, "console.port")
    return {"address": address, **given} if is_loopback(address) else {"enabled": False, **given}


def _access(given: dict[str, object], data: Path, number: int) -> dict[str, object]:
    """Return a world's access control: all have one list of people, and gateways with successive ports."""
    access = {"people": str(data), **given}
    if gateway := str(given.get("gateway", "")):
        _, port = host_and_port(gateway, "access.gateway")
        access["gateway"] = f"{gateway.rpartition(':')[0]}:{_port(port, number, 'access.gateway') if port else 0}"
    return access


def _port(first: int, number: int, setting: str) -> int:
    """Return a world's port: each has the one after that of the world before. Raises ValueError beyond the last."""
    if (port := first + number - 1) > PORT_MAX:
        raise ValueError(f"{setting} of world w{number} would be {port}: worlds take the ports from {first} on")
    return port


def _addresses(first: str, count: int) -> Iterator[str]:
    """Return ``count`` addresses from the first one on. Raises ValueError."""
    try:
        start = ip_address(first)
    except ValueError as error:
        raise ValueError(f"the first address: {error}") from None
    if not isinstance(start, IPv4Address):
        raise ValueError(f"the first address must be an IPv4 address, not {first}")
    if int(start) + count > int(IPv4Address("255.255.255.255")):
        raise ValueError(f"there are no {count} addresses from {first} on")
    return (str(start + number) for number in range(count))
