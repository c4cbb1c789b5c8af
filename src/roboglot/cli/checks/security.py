"""``roboglot doctor --security``: listeners, their reach, unused rights, and weak settings."""

from __future__ import annotations

import sqlite3
import stat
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

from roboglot.access.rights import ALL_ROBOTS, IMPLIED, effective, write_rights
from roboglot.access.store import FILE, Grant, Identity, IdentityKind, open_store
from roboglot.access.trail import FILE as TRAIL
from roboglot.access.trail import open_trail
from roboglot.cli.checks.finding import Finding
from roboglot.cli.checks.listeners import holder_of
from roboglot.config import Config, is_loopback
from roboglot.hosting.error_text import in_words
from roboglot.operations import Right
from roboglot.protocols import DOORS
from roboglot.protocols.door import PortKind
from roboglot.storage.transactions import FAILURES
from roboglot.validation import host_and_port

UNUSED_DAYS = 30
DAY = 86400.0  # s


def examine_security(config: Config) -> Iterator[Finding]:
    """Yield all findings, listeners first."""
    yield from _listeners(config)
    yield from _opened(config)
    yield from _fingerprints(config)
    identities = list(_identities(config))
    yield from _identity_findings(config, identities)
    yield from _unused(config, identities)
    yield from _settings(config)
    yield _folder(config.data)


def reach_of(address: str) -> str:
    """Return which clients can reach this address."""
    if is_loopback(address):
        return "programs on this machine"
    return "every network of this machine" if address in ("0.0.0.0", "::") else f"the network of {address}"


def _listeners(config: Config) -> Iterator[Finding]:
    """Yield every TCP port of the configuration: its state, and the clients that could reach it."""
    places = [
        (f"robot {robot.name}, {label}", robot.address, number)
        for robot in config.robots
        for door in DOORS
        if door.listens(config)
        for kind in (PortKind.TCP, PortKind.ROUTER)
        for label, number in door.port_numbers(config, kind).items()
    ]
    if config.console.enabled:
        places.append(("console", config.console.address, config.console.port))
    if config.access.on and config.access.gateway:
        places.append(("gateway", *host_and_port(config.access.gateway, "access.gateway")))
    for label, address, port in places:
        holder = holder_of(address, port)
        now = f"open now, by {holder}" if holder else "closed now"
        yield Finding(label, True, f"{address}:{port} for {reach_of(address)}; {now}")


def _opened(config: Config) -> Iterator[Finding]:
    access, outside = config.access, {robot.name: robot.address for robot in config.exposed}
    listed = ", ".join(f"{name} on {address}" for name, address in outside.items())
    if config.insecure:
        yield Finding(
            "open to everyone",
            not outside,
            listed or "no robot, as all are on loopback",
            "[access] or --access instead of insecure",
        )
    elif not access.on:
        yield Finding("access", not outside, "clients need no name; all robots are on loopback")
    if access.on and outside:
        yield Finding(
            "encryption",
            access.tls.on and not access.tls.plain,
            f"{listed}: " + _encryption(config),
            "use `roboglot connect`, or [access.tls] with plain = false where all clients can",
        )
    if access.on and access.gateway and access.local:
        yield Finding(
            "gateway and local",
            False,
            "programs on this machine need no name; clients through tunnels, on other loopback addresses, do",
            "[access] local = false, if others have accounts on this machine",
        )


def _encryption(config: Config) -> str:
    if not config.access.tls.on:
        return "tokens and passwords pass in the clear over REST and WebSocket"
    return "TLS and plain connections" if config.access.tls.plain else "TLS; the text protocol has none"


def _fingerprints(config: Config) -> Iterator[Finding]:
    """Yield the fingerprints of the certificates that clients are shown, to be compared at their first use."""
    from roboglot.protocols.cyberdog.pem_files import FOLDER, SERVER_CERT

    folder = config.data / FOLDER
    own = Path(config.access.tls.certificate) if config.access.tls.certificate else folder / "site" / "site-cert.pem"
    for label, path in (("gateway certificate", folder / "tls" / SERVER_CERT), ("web certificate", own)):
        if path.exists():
            from roboglot.protocols.cyberdog.signing import fingerprint, valid_until

            try:
                until = valid_until(path)
                lasts = until.timestamp() > time.time() + 30 * DAY
                seen = f"SHA-256 {fingerprint(path)}" + ("" if lasts else f", valid until {until:%Y-%m-%d}")
                yield Finding(label, lasts, seen, "" if lasts else f"replace {path}, or remove one that roboglot made")
            except (OSError, ValueError) as error:
                yield Finding(label, False, in_words(error), f"remove {path.parent} to have new ones")


def _identities(config: Config) -> list[Identity]:
    if not config.database and not (config.data / FILE).exists():
        return []
    store = open_store(config.data, config.database)
    try:
        return store.identities()
    finally:
        store.close()


def _identity_findings(config: Config, identities: list[Identity]) -> Iterator[Finding]:
    """Yield the rights of each identity, and their weaknesses."""
    now = time.time()
    for identity in identities:
        grants = [grant for grant in identity.grants if grant.until is None or grant.until > now]
        may = "; ".join(f"{write_rights(g.rights)} on {g.robot}{_until(g)}" for g in grants) or "no rights left"
        remedy = _weakness(identity, grants)
        yield Finding(f"{identity.kind} {identity.name}", not remedy, may, remedy)
    if config.access.on and not identities:
        yield Finding("people and machines", config.access.local, "no one has rights", "roboglot access add NAME")


def _until(grant: Grant) -> str:
    return "" if grant.until is None else time.strftime(" until %Y-%m-%d %H:%M", time.localtime(grant.until))


def _weakness(identity: Identity, grants: list[Grant]) -> str:
    if not grants:
        return f"roboglot access revoke {identity.name}" if identity.grants else ""
    rights = effective(right for grant in grants for right in grant.rights)
    if identity.kind is IdentityKind.ADDRESS and any(grant.until is None for grant in grants) and rights > {Right.SEE}:
        return "an address is weak proof on a shared network: limit its time (--for 2h)"
    if identity.kind is IdentityKind.ADDRESS and Right.ADMIN in rights:
        return "an address is weak proof: administrators should have a password or a token"
    if Right.ADMIN in rights and any(grant.robot == ALL_ROBOTS and grant.until is None for grant in grants):
        return "admin on all robots without an end: is drive, program or edit enough?"
    return ""


def _unused(config: Config, identities: list[Identity]) -> Iterator[Finding]:
    """Yield rights beyond seeing that were not used for UNUSED_DAYS; none if the audit is younger."""
    now = time.time()
    if not config.database and not (config.data / TRAIL).exists():
        return
    used, oldest = _used(config, now - UNUSED_DAYS * DAY)
    if oldest is None or now - oldest < UNUSED_DAYS * DAY:
        yield Finding("unused rights", True, f"the audit is younger than {UNUSED_DAYS} days")
        return
    for identity in identities:
        had = {right for grant in identity.grants for right in grant.rights} - {Right.SEE}
        idle = sorted(right for right in had if not IMPLIED[right] - {Right.SEE} & used[identity.name])
        if idle:
            seen = f"{', '.join(idle)} not used for {UNUSED_DAYS} days"
            yield Finding(f"unused: {identity.name}", False, seen, f"roboglot access revoke {identity.name}, or fewer")


def _used(config: Config, since: float) -> tuple[Mapping[str, set[Right]], float | None]:
    """Return the rights used by each identity, and the beginning of the audit (Unix s)."""
    needed: dict[tuple[str, str], Right] = {
        (door.name, str(_key(operation.key))): operation.right
        for door in DOORS
        for operation in door.table()
        if operation.right is not None
    }
    used: dict[str, set[Right]] = defaultdict(set)
    oldest = None
    try:
        with open_trail(config.data, config.database) as trail:
            for _, entry in trail.rows():
                oldest = entry.at if oldest is None else oldest
                if entry.outcome == "done" and entry.at >= since:
                    right = needed.get((entry.door, entry.operation))
                    used[entry.who] |= {right} if right else set(Right)  # nothing is claimed about unknown uses
    except (sqlite3.Error, OSError, *FAILURES):
        return used, None
    return used, oldest


def _key(key: object) -> object:
    return int(key) if isinstance(key, int) else key


def _settings(config: Config) -> Iterator[Finding]:
    """Yield settings that open more than their names suggest."""
    for name, section in (*((door.name, door.section(config)) for door in DOORS), ("console", config.console)):
        if "*" in getattr(section, "origins", ()):
            yield Finding(f"[{name}] origins", False, "every web page may drive the robots", "name the pages")
        if getattr(section, "plaintext", False):
            yield Finding(f"[{name}] plaintext", False, "gRPC without TLS and certificates", "for tests only")
        if getattr(section, "without_filter", False):
            yield Finding(
                f"[{name}] without_filter", False, "programs run without the kernel's filter", "trusted programs only"
            )


def _folder(path: Path) -> Finding:
    if not path.exists():
        return Finding("data folder", True, f"{path} does not exist yet")
    mode = stat.S_IMODE(path.stat().st_mode)
    return Finding(
        "data folder", not mode & 0o077, f"{path} has mode {mode:o}", f"chmod 700 {path}: keys and programs are in it"
    )
