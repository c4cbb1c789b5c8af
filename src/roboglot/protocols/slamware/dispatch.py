"""The ASGI application: finds the operation of a request, runs it, and renders its answer or error.

No web framework, as Litestar took 0.25 s to import and 0.3 s a robot to set up these 167 routes: more than the whole
program may take to be ready.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterable
from contextlib import nullcontext
from contextvars import copy_context
from functools import lru_cache, partial
from inspect import iscoroutinefunction
from time import perf_counter
from typing import get_args

import msgspec

from roboglot.model.admission import NO_PROOF, Forbidden, LockedOut, Proof, ProofKind, Unknown
from roboglot.model.client_context import set_client
from roboglot.model.components.mapping.map_memory import is_settled, settle
from roboglot.model.components.system.network import Network
from roboglot.model.errors import NotFound, RobotError
from roboglot.model.responder import Responder
from roboglot.model.response_delay import delay_response
from roboglot.operations import BadParameters, Operation, Right
from roboglot.protocols.browsers import Browsers, of_rows
from roboglot.protocols.forwarding import caller
from roboglot.protocols.slamware.bodies import ClientGone, Receive, Scope

# Each chapter registers its operations.
from roboglot.protocols.slamware.chapters import industry  # noqa: F401
from roboglot.protocols.slamware.chapters.artifact import landmarks, lines_and_areas, points_of_interest  # noqa: F401
from roboglot.protocols.slamware.chapters.delivery import (  # noqa: F401
    admin,
    cargo,
    stage,
    tasks,
)
from roboglot.protocols.slamware.chapters.firmware import firmware  # noqa: F401
from roboglot.protocols.slamware.chapters.firmware.uploads import Upload
from roboglot.protocols.slamware.chapters.motion import actions, strategies  # noqa: F401
from roboglot.protocols.slamware.chapters.multi_floor import (  # noqa: F401
    elevators,
    floors,
    tours,
    track_search,
)
from roboglot.protocols.slamware.chapters.platform import platform  # noqa: F401
from roboglot.protocols.slamware.chapters.slam import docks, localization, maps  # noqa: F401
from roboglot.protocols.slamware.chapters.statistics import statistics  # noqa: F401
from roboglot.protocols.slamware.chapters.system import (  # noqa: F401
    cube,
    devices,
    health,
    lights,
    network,
    parameters,
    power,
    raw_imu,
    system,
)
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.errors import REASON, HttpError, bad_request, from_robot, reason_phrase
from roboglot.protocols.slamware.pages import Pages
from roboglot.protocols.slamware.parameters import Parameters
from roboglot.protocols.slamware.routes import Match, all_routes
from roboglot.protocols.slamware.table import NO_CONTENT, TABLE, Text, changes_map, concerns_map
from roboglot.protocols.turns import wait_for_turn
from roboglot.wire.contracts import Row

log = logging.getLogger(__name__)
LOGGED_MAX = 200  # characters of a path or a refusal in a log line
HEADS_MAX = 64  # cached heads of responses

FastPath = Callable[[], bytes | None]  # a whole response, or None: the request must be parsed
Send = Callable[[dict[str, object]], Awaitable[None]]
Headers = list[tuple[bytes, bytes]]

JSON = (b"content-type", b"application/json")
CHALLENGE = (b"www-authenticate", b'Basic realm="roboglot", charset="UTF-8"')
CLOSE = (b"connection", b"close")
BINARY = (b"content-type", b"application/octet-stream")
PLAIN = (b"content-type", b"text/plain; charset=utf-8")
PREFLIGHT: Headers = [
    (b"access-control-allow-methods", b"GET, POST, PUT, DELETE, OPTIONS"),
    (b"access-control-allow-headers", b"*, Authorization"),
    (b"access-control-allow-private-network", b"true"),
    (b"access-control-max-age", b"86400"),
]
STOP_PATHS = ("/api/core/motion/v1/actions/", "/api/delivery/v1/tasks")  # DELETE on these stops the robot
FRAME_POLICY = (b"content-security-policy", b"frame-ancestors 'self'")  # against clickjacking by other pages


class Application:
    """Answers requests for one robot. Knows HTTP, but no socket."""

    def __init__(self, context: Context, browsers: Browsers | None = None) -> None:
        self._context = context
        self._tap, self._admission = context.robot.tap, context.robot.admission
        self._browsers = browsers or Browsers("[slamware]")
        self._routes = all_routes()
        self._pages = Pages()
        self._encode = msgspec.json.Encoder().encode
        self._parameters = Parameters(context)
        self._admitted: tuple[str, object, Headers] = "", None, []  # last method and headers, the answer's headers
        self.closing = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        host, address = _peer(scope)
        client = f"slamware {host}".strip()
        set_client(client, address)
        if fairness := self._context.robot.fairness:
            await wait_for_turn(fairness, fairness.of(address), lambda: _stops_robot(scope))
        begun = perf_counter()
        cors: Headers = []
        why = ""
        try:
            cors = self._check_origin(scope)
            if self._admission.enforced and scope["method"] != "OPTIONS":  # browsers send no credentials in a preflight
                await self._authenticate(scope)
            status, headers, body = await self._answer(scope, receive)
        except ClientGone:
            return
        except HttpError as error:
            why = error.body
            body = why.encode(errors="replace")
            status, headers = error.status, [PLAIN, (REASON, reason_phrase(error.text)), *error.headers]
        except asyncio.CancelledError:
            if self.closing:
                return
            raise
        if log.isEnabledFor(logging.DEBUG):
            self._log(client, scope, status, body, perf_counter() - begun)
        if self._tap.watched:
            self._note_reply(scope, status, body, why)
        if fairness:
            fairness.lend(fairness.of(address), perf_counter() - begun)
        await delay_response(self._context.robot)
        headers += cors
        headers += [(b"content-length", b"%d" % len(body))] if status != 204 else []
        await send({"type": "http.response.start", "status": status, "headers": headers})
        await send({"type": "http.response.body", "body": body})

    def fast_path(self, scope: Scope) -> FastPath | None:
        """Return a function that answers a GET when its client repeats it; None if that takes more than a plain call.

        The function returns None, with no effect, if the repetition must be handled like the first request: for a
        subscriber of the tap, for a slow network, or because it is refused.
        """
        robot = self._context.robot
        operation, match = self._find_plain_read(scope)
        if operation is None or match is None or self._admission.enforced or robot.responder is not None:
            return None
        if log.isEnabledFor(logging.DEBUG):
            return None
        try:
            values = operation.parse(self._parameters.named(operation, match, scope))
            cors = self._check_origin(scope)
        except (HttpError, BadParameters):
            return None
        handler = partial(copy_context().run, operation.handler, self._context, **values)
        card = robot[Network] if Network in robot else None  # noqa: SIM401 - a later one is real
        (_, address), fairness, tap, mapped = _peer(scope), robot.fairness, self._tap, concerns_map(operation)

        def read() -> bytes | None:
            try:
                answer = handler()
                if answer is NO_CONTENT or answer is None:
                    return None
                headers, body = self._render(answer, scope)
            except Exception:  # noqa: BLE001 - it changes nothing: handled in full, it fails again and is logged
                return None
            return head(*headers, *cors) % len(body) + body

        def reply() -> bytes | None:
            if tap.watched or (card is not None and card.delay) or (mapped and not is_settled(robot)):
                return None
            return fairness.timed(fairness.of(address), read) if fairness else read()  # a map takes ten times a pose

        return reply

    def _find_plain_read(self, scope: Scope) -> tuple[Operation[str] | None, Match | None]:
        """Return the operation of a GET, and its match, if its handler is a plain function that only reads."""
        if scope["method"] != "GET" or (match := self._routes.find(scope["raw_path"].decode("latin-1"))) is None:
            return None, None
        operation = TABLE.get(match.methods["GET"].key) if "GET" in match.methods else None
        if operation is None or operation.right is not Right.SEE or "body" in operation.names:
            return None, None
        return (None, None) if iscoroutinefunction(operation.handler) else (operation, match)

    def _check_origin(self, scope: Scope) -> Headers:
        """Return the CORS headers of an answer. Raises HttpError 403 for pages of other hosts."""
        method, rows = scope["method"], scope["headers"]
        if method == self._admitted[0] and rows == self._admitted[1]:  # a client that polls
            return self._admitted[2]
        request = of_rows(rows, method)
        cors: Headers = []
        if why := self._browsers.refusal(request):
            raise HttpError(403, "Forbidden", why)
        if self._browsers.any_origin:
            cors = [(b"access-control-allow-origin", b"*")]
        elif request.origin is not None:
            cors = [(b"access-control-allow-origin", request.origin.encode("latin-1")), (b"vary", b"Origin")]
        self._admitted = method, rows, cors
        return cors

    def _log(self, client: str, scope: Scope, status: int, body: bytes, seconds: float) -> None:
        """Log a request and its outcome, for ``--verbose``."""
        path = scope["raw_path"].decode("latin-1").encode("unicode_escape").decode()[:LOGGED_MAX]
        why = f": {body[:LOGGED_MAX].decode(errors='replace')!r}" if status >= 400 else ""
        ms = seconds * 1000
        words = self._context.robot.id, client, scope["method"], path, status, ms, why
        log.debug("robot %s: %s %s %s -> %d, %.1f ms%s", *words)

    async def _authenticate(self, scope: Scope) -> None:
        """Authenticate the client, and act for its identity from here on. Raises HttpError 401."""
        address = caller(_peer(scope)[1], scope["headers"])
        header = next((value.decode("latin-1") for name, value in scope["headers"] if name == b"authorization"), "")
        proof = Proof(ProofKind.HTTP, header) if header else NO_PROOF
        try:
            who = self._admission.cached_identity(address, proof)
            if who is None:
                who = await self._admission.admit(address, proof)
        except Unknown as unknown:
            headers = (CHALLENGE, CLOSE) if isinstance(unknown, LockedOut) else (CHALLENGE,)  # the body is not read
            raise HttpError(401, "Unauthorized", str(unknown), headers) from None
        set_client(f"slamware {who}", address, who)

    async def _answer(self, scope: Scope, receive: Receive) -> tuple[int, Headers, bytes]:
        method = scope["method"]
        if (match := self._routes.find(scope["raw_path"].decode("latin-1"))) is None:
            return 200, *self._page(scope["path"], method)
        if method == "OPTIONS":
            return 200, [*PREFLIGHT, (b"allow", allowed(match.methods).encode())], b""
        if (row := match.methods.get("GET" if method == "HEAD" else method)) is None:
            raise not_allowed(match.methods)
        # Only events change by being read; the server omits the body of an answer to HEAD.
        with self._context.events.kept() if method == "HEAD" else nullcontext():
            return await self._carry_out(row, match, scope, receive)

    def _page(self, path: str, method: str) -> tuple[Headers, bytes]:
        """Return a page that is not part of the API. Raises HttpError."""
        if (page := self._pages.find(path)) is None:
            raise HttpError(404, "Not Found")
        if method not in ("GET", "HEAD"):
            raise not_allowed(["GET"])
        return [(b"content-type", page[0].encode()), FRAME_POLICY], page[1]

    async def _carry_out(self, row: Row, match: Match, scope: Scope, receive: Receive) -> tuple[int, Headers, bytes]:
        scope["operation"] = row.key
        operation, responder = TABLE.get(row.key), self._context.robot.responder
        if operation is None and responder is None:
            raise HttpError(501, f"{row.name} is not implemented", row.key)
        self._check_right(row.key, operation.right if operation else Right.ADMIN)
        if responder is not None or operation is None:
            assert responder is not None
            return await self._ask_responder(responder, row, scope, receive)
        values = await self._parameters.read(operation, match, scope, receive)
        if self._tap.watched:
            self._note_request(scope)
        answer = await self._call(operation, row, values, scope)
        if answer is NO_CONTENT:
            return 204, [], b""
        if answer is None and type(None) in get_args(operation.answer):
            return 200, [JSON], b"null"
        return 200, *self._render(answer, scope)

    def _check_right(self, key: str, right: Right | None) -> None:
        """Raise HttpError if the client lacks the right."""
        if self._admission.enforced:
            try:
                self._admission.check("slamware", key, right)
            except Forbidden as forbidden:
                raise from_robot(forbidden) from None

    async def _check_again(self, scope: Scope, key: str, right: Right | None) -> None:
        """Raise HttpError if the client lost its right, or its proof, while it sent the body."""
        await self._authenticate(scope)
        if not self._admission.may(right or Right.ADMIN):
            self._check_right(key, right)

    async def _call(self, operation: Operation[str], row: Row, values: dict[str, object], scope: Scope) -> object:
        """Run the handler and return its result. Raises HttpError only."""
        try:
            if self._admission.enforced and "body" in values:
                await self._check_again(scope, row.key, operation.right)
            if changes_map(operation):
                await self._context.maps.starting.ended()
            if concerns_map(operation):
                await settle(self._context.robot)
            self._context.robot.starts.check(operation.right)
            return await operation.call(self._context, values)
        except BadParameters as error:
            raise bad_request(row.key, str(error)) from None
        except RobotError as error:
            raise from_robot(error, row.key) from None
        except HttpError:
            raise
        except Exception:
            log.exception("%s crashed", row.key)
            raise HttpError(500, "Internal Server Error", row.name) from None
        finally:
            if isinstance(body := values.get("body"), Upload):
                body.close()

    async def _ask_responder(
        self, responder: Responder, row: Row, scope: Scope, receive: Receive
    ) -> tuple[int, Headers, bytes]:
        """Return the answer of the robot's responder. Raises HttpError 501 if it has none."""
        scope["body"] = await self._parameters.whole(scope, receive)
        if self._tap.watched:
            self._note_request(scope)
        reads = scope["method"] in ("GET", "HEAD")
        try:
            async for reply in responder.answer("slamware", row.key, _for_tap(scope), reads=reads):
                status = int(reply.status)
                kind = PLAIN if status >= 400 else _kind_of(reply.payload, scope)
                return status, [kind] if reply.payload else [], reply.payload
        except NotFound as unknown:  # it names the request
            raise HttpError(501, "Not Implemented", str(unknown)) from None
        raise HttpError(501, "Not Implemented", f"the recording ends before {row.key} was answered")

    def _note_request(self, scope: Scope) -> None:
        scope["began"] = self._tap.request("slamware", scope["operation"], _for_tap(scope))

    def _note_reply(self, scope: Scope, status: int, body: bytes, why: str) -> None:
        if "began" not in scope:  # refused before it was parsed
            scope.setdefault("operation", "")
            self._note_request(scope)
        self._tap.reply("slamware", scope["operation"], body, str(status), why, scope["began"])

    def _render(self, answer: object, scope: Scope) -> tuple[Headers, bytes]:
        match answer:
            case None:
                return [], b""
            case bytes():
                return [BINARY], answer
            case Text() if _accepts_only_text(scope):
                return [PLAIN], answer.value.encode()
            case Text():
                return [JSON], self._encode(answer.value)
            case _:
                return [JSON], self._encode(answer)


@lru_cache(HEADS_MAX)
def head(*headers: tuple[bytes, bytes]) -> bytes:
    """Return the head of a response with status 200 as the server writes it, with %d for the length of its body."""
    rows = [b"%s: %s\r\n" % row for row in headers]
    return b"HTTP/1.1 200 OK\r\n%scontent-length: %%d\r\n\r\n" % b"".join(rows).replace(b"%", b"%%")


def _peer(scope: Scope) -> tuple[str, str]:
    """Return the client's host, and its host and port; empty and ":0" if unknown."""
    host, port = scope.get("client") or ("", 0)
    return host, f"{host}:{port}"


def _for_tap(scope: Scope) -> bytes:
    """Return a request in the tap's form: method, path and query, an empty line, the body."""
    query = b"?" + scope["query_string"] if scope["query_string"] else b""
    return b"%s %s%s\n\n%s" % (scope["method"].encode(), scope["raw_path"], query, scope.get("body", b""))


def _kind_of(body: bytes, scope: Scope) -> tuple[bytes, bytes]:
    """Return the Content-Type of a recorded body, by its content."""
    try:
        msgspec.json.decode(body)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return PLAIN if _accepts_only_text(scope) else BINARY
    return JSON


def allowed(methods: Iterable[str]) -> str:
    """Return the header Allow of a path with these methods."""
    return ", ".join([*methods, *(["HEAD"] if "GET" in methods else []), "OPTIONS"])


def not_allowed(methods: Iterable[str]) -> HttpError:
    """Return the error 405 with the allowed methods."""
    words = allowed(methods)
    return HttpError(405, "Method Not Allowed", words, ((b"allow", words.encode()),))


def _accepts_only_text(scope: Scope) -> bool:
    """Return whether the client accepts text/plain and nothing else."""
    accepted = b",".join(value for name, value in scope["headers"] if name == b"accept")
    return {entry.partition(b";")[0].strip().lower() for entry in accepted.split(b",")} == {b"text/plain"}


def _stops_robot(scope: Scope) -> bool:
    return bool(scope["method"] == "DELETE" and scope["path"].startswith(STOP_PATHS))
