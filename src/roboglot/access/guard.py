"""Admits clients to all robots of a program, checks and audits their requests, and disconnects those that lose rights.

No request waits for the list's database: requests use a copy in memory, renewed by a thread. While the database cannot
be reached, the copy stays as it is; rights still end at their time.
"""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Set
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple
from weakref import WeakValueDictionary

from roboglot.access import audit
from roboglot.access.callers import host_of, port_of
from roboglot.access.identities import LOCAL, Identities, Rights
from roboglot.access.proofs import Proofs
from roboglot.access.rights import NOTHING
from roboglot.access.store import AccessStore, Grant, IdentityKind, Snapshot, open_store
from roboglot.access.trail import Entry, Trail, open_trail
from roboglot.config import AccessConfig, is_loopback
from roboglot.model.action import Action
from roboglot.model.admission import NO_PROOF, THROUGH, Admission, Forbidden, Proof, ProofKind, Right, Unknown
from roboglot.model.client_context import connection, identity
from roboglot.model.components.logistics.delivery import Delivery
from roboglot.model.components.system.lease import Lease, moves
from roboglot.model.errors import RobotError
from roboglot.model.events.listeners import Failures, call_all
from roboglot.model.robot import Robot
from roboglot.model.tap import DRIVER, Direction, Exchange
from roboglot.storage.transactions import FAILURES, Transactions
from roboglot.transport.limiter import Limiter
from roboglot.transport.log_limiter import LogLimiter

log = logging.getLogger(__name__)
limited_log = LogLimiter(log)

LOOK_PERIOD = 0.25  # s between two checks of the list and of expiry times
LOOK_PAUSE = 0.02  # s at least, even when unknown clients come
LOOK_MAX = 1.0  # s that an unknown client waits for a check
HANDSHAKES = 20  # TLS handshakes per second from one address; bursts of twice as many
HANDSHAKES_TOGETHER = 200  # per second from all addresses
ALLOWED_MAX = 4096  # cached pairs of identity and operation
BURST_SECONDS = 2.0  # the burst allowance: seconds' worth of bytes at once


class Tunnelled(NamedTuple):
    """Identity at the other end of a tunnel, and its host.

    ``calls``: the tunnel's open connections by local port. Other programs on this machine may call from the same
    loopback address, but not from one of these ports.
    """

    who: str
    host: str
    calls: WeakValueDictionary[int, asyncio.Protocol]


class Guard:
    """Guard of all robots. ``start`` begins to follow the list; ``reload`` reads it at once.

    ``shared``: a server's database with list and audit of a fleet, closed by its owner; without it, both are files in
    ``folder``, the list perhaps in another (``config.people``). Raises OSError, ValueError, sqlite3.Error,
    DatabaseError.
    """

    def __init__(
        self,
        folder: Path,
        config: AccessConfig,
        robots: Mapping[str, Robot],
        *,
        shared: Transactions | None = None,
        now: Callable[[], float] = time.time,
    ) -> None:
        self.config = config
        self.now = now
        self._store = AccessStore(shared) if shared else open_store(Path(config.people) if config.people else folder)
        self._trail = Trail(shared) if shared else open_trail(folder)
        self._own = () if shared else (self._store, self._trail)
        self.audit = audit.Audit(self._trail)
        self.requests = Limiter(config.requests, config.requests, time.monotonic)
        self.tunnels: dict[str, Tunnelled] = {}  # by the loopback address that stands for each client
        self._list = self._store.snapshot()
        self._identities = Identities(self._list.identities)
        self._proofs = Proofs(self._identities, config.logins)
        self.bytes = Limiter(config.bytes, config.bytes * BURST_SECONDS, time.monotonic)
        self._handshakes = Limiter(HANDSHAKES, 2 * HANDSHAKES, time.monotonic)
        self._handshakes_together = Limiter(HANDSHAKES_TOGETHER, HANDSHAKES_TOGETHER, time.monotonic)
        self._ended, self._wanted = threading.Event(), threading.Event()
        self._looks = list[asyncio.Future[None]]()  # clients that wait for the list
        self._thread: threading.Thread | None = None
        self._next_end = self._identities.next_end(now())
        self._admissions = [RobotAdmission(self, name, robot) for name, robot in robots.items()]
        for admission in self._admissions:
            admission.renew(self._identities)

    def start(self) -> None:
        """Follow the list and the clock, on the running loop."""
        loop = asyncio.get_running_loop()
        for admission in self._admissions:
            admission.settle_control()
        self._thread = threading.Thread(target=self._follow, args=(loop,), name="access", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop following the list, and write the rest of the audit."""
        self._ended.set()
        self._wanted.set()
        if self._thread is not None:
            self._thread.join(2.0)
        self.audit.close()
        for opened in self._own:
            opened.close()

    def reload(self) -> None:
        """Reload the list: lost rights end now, on open connections, too."""
        self._adopt(self._store.snapshot())

    def _adopt(self, newer: Snapshot) -> None:
        """Apply a snapshot of the list, unless a later one has been applied."""
        if newer.version < self._list.version:
            return
        self._list = newer
        older, self._identities = self._identities, Identities(newer.identities)
        self._next_end = self._identities.next_end(self.now())
        replaced = self._identities.replaced(older)
        self._proofs.renew(self._identities, replaced)
        for admission in self._admissions:
            admission.renew(self._identities, replaced)

    def cached_identity(self, address: str, proof: Proof) -> str | None:
        """See ``Admission.cached_identity``."""
        if proof is not NO_PROOF:
            return self._proofs.known(proof, address)
        host, peer = host_of(address), address.rpartition(THROUGH)[2]
        if (tunnelled := self.tunnels.get(host_of(peer))) is not None and port_of(peer) in tunnelled.calls:
            return tunnelled.who  # whoever else asks at the tunnel's other end
        if self._identities.has(host, IdentityKind.ADDRESS):
            return host
        return LOCAL if self.config.local and is_loopback(host) else None

    def may(self, who: str, robot: str, right: Right) -> bool:
        """Return whether ``who`` has the right on the robot."""
        return right in self._identities.rights(robot, self.now(), local=self.config.local).get(who, NOTHING)

    async def admit(self, address: str, proof: Proof) -> str:
        """See ``Admission.admit``."""
        if (who := self.cached_identity(address, proof)) is not None:
            return who
        before = self._list.version
        try:
            return await self._proofs.find(proof, host_of(address))
        except Unknown:
            if proof is NO_PROOF or not await self._is_newer(before):
                raise
        return self.cached_identity(address, proof) or await self._proofs.find(proof, host_of(address))

    async def _is_newer(self, version: int) -> bool:
        """Read the list at once; return whether it has changed since ``version``."""
        if self._thread is not None:
            look = asyncio.get_running_loop().create_future()
            self._looks.append(look)
            self._wanted.set()
            await asyncio.wait([look], timeout=LOOK_MAX)
        return self._list.version > version

    async def invite(self, name: str, grant: Grant) -> Proof:
        """See ``Admission.invite``."""
        token = await asyncio.to_thread(self._store.add_guest, name, [grant], self.now())
        self._adopt(await asyncio.to_thread(self._store.snapshot))
        return Proof(ProofKind.HTTP, f"Bearer {token}")

    def device(self, name: str, shown: str) -> str:
        """See ``Admission.device``."""
        return self._proofs.device(name, shown)

    async def shut_out(self, name: str) -> None:
        """See ``Admission.shut_out``."""
        if self._identities.has(name, IdentityKind.GUEST):
            await asyncio.to_thread(self._store.revoke, name)
            self._adopt(await asyncio.to_thread(self._store.snapshot))

    def may_shake_hands(self, host: str) -> bool:
        """See ``Admission.may_shake_hands``."""
        return self._handshakes.take(host) and self._handshakes_together.take("")

    def _follow(self, loop: asyncio.AbstractEventLoop) -> None:
        """Follow the list in a thread, so that neither robots nor lockstep wait for its database."""
        seen = self._list.version
        while not self._ended.wait(LOOK_PAUSE):
            self._wanted.wait(LOOK_PERIOD)
            self._wanted.clear()
            looks, self._looks = self._looks, []
            if self.now() >= self._next_end:
                self._next_end = float("inf")  # until recomputed
                loop.call_soon_threadsafe(lambda: self._adopt_safely(self._list))
            try:
                if self._store.version != seen:
                    newer = self._store.snapshot()
                    seen = newer.version
                    loop.call_soon_threadsafe(partial(self._adopt_safely, newer))
            except FAILURES as error:
                limited_log.warning("list", "cannot read the list of identities, the last one stays: %s", error)
            for look in looks:
                loop.call_soon_threadsafe(look.cancel)

    def _adopt_safely(self, newer: Snapshot) -> None:
        if self._ended.is_set():
            return
        try:
            self._adopt(newer)
        except Exception:
            log.exception("cannot apply the list of identities, the last one stays")


class RobotAdmission(Admission):
    """The guard at one robot's doors."""

    enforced = True

    def __init__(self, guard: Guard, name: str, robot: Robot) -> None:
        self._guard, self._name, self._robot = guard, name, robot
        self.connections_max = guard.config.connections
        self._rights: Rights = {}
        self._needs: dict[str, Right] = {}
        self._allowed: dict[tuple[str, str], Right] = {}  # the right that sufficed; cleared when rights change
        self._listeners: list[Callable[[str], None]] = []
        self._failures = Failures()
        self._gains: list[Callable[[str], None]] = []
        self._releasing: asyncio.Future[None] | None = None
        self._disowning: asyncio.Future[None] | None = None
        self._offers: dict[int, tuple[asyncio.Server, Callable[[], asyncio.Protocol]]] = {}
        robot.admission = self
        robot.actions.guard(self._check_mover)
        robot.tap.listen(self._note_reply)

    def cached_identity(self, address: str, proof: Proof = NO_PROOF) -> str | None:
        """Return the client's identity if it is known without work, else None."""
        return self._guard.cached_identity(address, proof)

    async def admit(self, address: str, proof: Proof = NO_PROOF) -> str:
        """Return the client's identity. Raises Unknown."""
        try:
            return await self._guard.admit(address, proof)
        except Unknown as unknown:
            self._note("", address, "", "", "turned away", str(unknown))
            raise

    def spend(self, client: str, amount: int) -> float:
        """Count bytes; return the seconds until the client may send more."""
        return self._guard.bytes.spend(client, amount)

    def carries_datagrams(self, address: str) -> bool:
        """Return whether datagrams reach the client: False through a tunnel."""
        return host_of(address) not in self._guard.tunnels

    def may_shake_hands(self, host: str) -> bool:
        """Return whether one more TLS handshake may begin."""
        return self._guard.may_shake_hands(host)

    async def invite(self, name: str, rights: frozenset[Right], seconds: float) -> Proof | None:
        """Admit a guest for ``seconds``; return its proof."""
        proof = await self._guard.invite(name, Grant(self._name, rights, self._guard.now() + seconds))
        self._note(identity(), connection(), "", "rights", "invited", name)
        return proof

    def device(self, name: str, shown: str) -> str:
        """Return the mark of a browser in which ``name`` has logged in."""
        return self._guard.device(name, shown)

    async def shut_out(self, name: str) -> None:
        """Revoke a guest."""
        await self._guard.shut_out(name)

    def check(self, door: str, operation: str, right: Right | None) -> None:
        """Raises Forbidden, and records it, unless the client has ``right``."""
        who = identity()
        if self._allowed.get((who, operation)) is right is not None and self._guard.requests.take(who):
            return
        right = right or Right.ADMIN
        self._needs[operation] = right
        if right not in self._rights.get(who, NOTHING):
            why = f"{who or 'a client without a name'} has no right to {right} on robot {self._name}"
        elif not self._guard.requests.take(who):
            why = f"{who} sends more than {self._guard.config.requests} requests a second"
        else:
            if len(self._allowed) >= ALLOWED_MAX:
                self._allowed.clear()
            self._allowed[who, operation] = right
            return
        limited_log.warning(f"{door} {operation} {who}", "%s: %s refused: %s", door, operation, why)
        self._note(who, connection(), door, operation, "refused", why)
        raise Forbidden(why)

    @contextmanager
    def noting(self, door: str, operation: str) -> Iterator[None]:
        """See ``Admission.noting``."""
        try:
            yield
        except RobotError as error:
            self._note(identity(), connection(), door, operation, "refused", str(error))
            raise
        self._note(identity(), connection(), door, operation, "done", "")

    def may(self, right: Right) -> bool:
        """Return whether the current client has ``right``."""
        return right in self._rights.get(identity(), NOTHING)

    def offer(self, server: asyncio.Server, factory: Callable[[], asyncio.Protocol]) -> None:
        """Register a port that tunnels reach within the process."""
        self._offers[server.sockets[0].getsockname()[1]] = server, factory

    def offered(self, port: int) -> tuple[asyncio.Server, Callable[[], asyncio.Protocol]] | None:
        """See ``Admission.offered``."""
        return self._offers.get(port)

    def on_gained(self, listener: Callable[[str], None]) -> Callable[[], None]:
        """Call ``listener`` with each identity that gains a right."""
        self._gains.append(listener)
        return lambda: self._gains.remove(listener) if listener in self._gains else None

    def on_lost(self, listener: Callable[[str], None]) -> Callable[[], None]:
        """Call ``listener`` with each identity that loses a right."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def renew(self, identities: Identities, replaced: Set[str] = frozenset()) -> None:
        """Replace the rights; clients that lost some, or use an old proof, are stopped and disconnected."""
        before = self._rights
        self._allowed.clear()
        self._rights = identities.rights(self._name, self._guard.now(), local=self._guard.config.local)
        for who, rights in before.items():
            lost = rights - self._rights.get(who, NOTHING)
            if lost or (who in replaced and rights):
                self._stop(who, cut=Right.DRIVE in lost or who in replaced)
        for who in [who for who, rights in self._rights.items() if rights - before.get(who, NOTHING)]:
            for listener in self._gains:
                listener(who)

    def settle_control(self) -> None:
        """Release control that was kept over a restart for a client that may no longer drive."""
        if Lease not in self._robot or not (client := self._robot[Lease].client):
            return
        lease = self._robot[Lease]
        drives = any(lease.is_of(who) for who, rights in self._rights.items() if Right.DRIVE in rights)
        if not drives and not (self._guard.config.local and is_loopback(host_of(client) or client)):
            log.warning("%s, who has control of robot %s, may no longer drive it", client, self._name)
            self._releasing = asyncio.ensure_future(lease.release())

    def _check_mover(self, action: Action) -> None:
        """Raise Forbidden for a motion whose client has lost the right to drive since its request was checked."""
        who = action.identity
        if who and moves(action) and Right.DRIVE not in self._rights.get(who, NOTHING):
            why = f"{who} may no longer drive"
            self._note(who, action.connection, "", action.name, "refused", why)
            raise Forbidden(why)

    def _stop(self, who: str, *, cut: bool) -> None:
        log.warning("%s lost rights on robot %s", who, self._name)
        self._note(who, "", "", "rights", "lost", "revoked, changed or at their end")
        for action in self._robot.actions.running():
            if cut and action.identity == who:
                action.cancel(f"{who} may no longer drive", hard=True)
        if cut and Lease in self._robot and self._robot[Lease].is_of(who):
            self._releasing = asyncio.ensure_future(self._robot[Lease].release())
        if cut and Delivery in self._robot:
            self._disowning = asyncio.ensure_future(self._robot[Delivery].disown(who))
        call_all(self._listeners, who, self._failures)

    def _note_reply(self, exchange: Exchange) -> None:
        """Audit a reply to a change, or a robot's refusal; ``check`` audits its own refusals."""
        right = self._needs.get(exchange.operation)
        if exchange.door.startswith(DRIVER) or exchange.direction is not Direction.REPLY or right in (None, Right.SEE):
            return
        who = identity()
        if right in self._rights.get(who, NOTHING):
            outcome = exchange.status if exchange.refusal else "done"
            self._note(who, exchange.connection, exchange.door, exchange.operation, outcome, exchange.refusal)

    def _note(self, who: str, address: str, door: str, operation: str, outcome: str, reason: str) -> None:
        if (tunnelled := self._guard.tunnels.get(host_of(address))) is not None:
            address = f"{tunnelled.host} by tunnel"
        entry = Entry(audit.now(), who, address, self._name, door, operation, outcome, reason)
        self._guard.audit.note(entry)
