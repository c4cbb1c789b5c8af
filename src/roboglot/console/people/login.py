"""The log-in page's requests: sign in by name and password, by a token or by a class's code; sign out; who am I."""

from __future__ import annotations

import base64
import time
from typing import Annotated

import msgspec

from roboglot.console.desk import Desk
from roboglot.console.http import Problem, Receive, Scope, Send, answer_json, read_as
from roboglot.console.people.classes import Classes, Elsewhere
from roboglot.console.people.entry import address_of, admission_of, cookie_of
from roboglot.console.people.sessions import Sessions, cookie_name, read_cookie, set_cookie
from roboglot.console.settings import JOIN_TRIES
from roboglot.model.admission import NO_PROOF, LockedOut, Proof, ProofKind, Unknown
from roboglot.protocols.forwarding import came_by_tls
from roboglot.transport.limiter import Limiter

SIGN_IN, SIGN_OUT = "/api/sign_in", "/api/sign_out"
Secret = Annotated[str, msgspec.Meta(max_length=300)]
MINUTE = 60.0
DEVICE_LIFETIME = 365 * 86_400.0  # s; a log-in renews it


class Credentials(msgspec.Struct, forbid_unknown_fields=True):
    """Credentials of a person: ``name`` and ``password``, or a ``token``, or a ``name`` and a class's ``code``."""

    name: Annotated[str, msgspec.Meta(max_length=64)] = ""
    password: Secret = ""
    token: Secret = ""
    code: Annotated[str, msgspec.Meta(max_length=12)] = ""


class Login:
    """Log-in and log-out of one console."""

    def __init__(self, desk: Desk, sessions: Sessions, classes: Classes) -> None:
        self._desk, self._sessions, self._classes = desk, sessions, classes
        self._tries = Limiter(JOIN_TRIES / MINUTE, JOIN_TRIES, time.monotonic)

    async def serve(self, scope: Scope, receive: Receive, send: Send) -> bool:
        """Answer a request to one of our paths, without an identity; return False for other paths. Raises Problem."""
        if scope["path"] not in (SIGN_IN, SIGN_OUT):
            return False
        if scope["method"] != "POST":
            raise Problem(405, "signing in and out needs POST")
        name = cookie_name((scope.get("server") or ("", 0))[1] or 0)
        secure = scope.get("scheme") == "https" or came_by_tls(scope["headers"])
        if scope["path"] == SIGN_OUT:
            await self._sessions.end(cookie_of(scope))
            await answer_json(send, {"name": ""}, 200, [set_cookie(name, "", secure=secure)])
            return True
        credentials = await read_as(receive, Credentials)
        device = read_cookie(scope["headers"], f"{name}-device")
        token, answer = await self._sign_in(address_of(scope), credentials, device)
        if not token:  # the pupil belongs to another world
            await answer_json(send, answer)
            return True
        await self._sessions.end(cookie_of(scope))  # a session that others may know ends
        cookies = [set_cookie(name, token, secure=secure)]
        if credentials.password and (mark := self._device(answer, device)):
            cookies.append(
                set_cookie(f"{name}-device", mark, secure=secure, path=SIGN_IN, lifetime=DEVICE_LIFETIME),
            )
        await answer_json(send, answer, 200, cookies)
        return True

    def _device(self, answer: dict[str, object], mark: str) -> str:
        admission = admission_of(self._desk)
        return admission.device(str(answer["name"]), mark) if admission is not None else ""

    async def _sign_in(self, address: str, credentials: Credentials, device: str) -> tuple[str, dict[str, object]]:
        if credentials.code:
            return await self._join(address, credentials)
        admission = admission_of(self._desk)
        if admission is None:
            raise Problem(409, "no sign-in is needed here: access is not switched on")
        if not (credentials.token or (credentials.name and credentials.password)):
            raise Problem(400, "give a name and a password, or a token, or a name and a code")
        proof = Proof(ProofKind.HTTP, _header(credentials))
        try:
            who = await admission.admit(address, proof._replace(device=device))
        except LockedOut as locked:
            raise Problem(429, str(locked)) from None
        except Unknown as unknown:
            raise Problem(401, str(unknown)) from None
        return await self._sessions.open(proof, who), {"name": who}

    async def _join(self, address: str, credentials: Credentials) -> tuple[str, dict[str, object]]:
        host = address.rpartition(":")[0]
        if not self._tries.take(host):
            raise Problem(429, "too many wrong codes from your address: wait a minute")
        seat = await self._classes.join(credentials.code, credentials.name)
        self._tries.give_back(host)
        if isinstance(seat, Elsewhere):
            return "", {"elsewhere": seat.page, "code": seat.code, "name": seat.name}
        token = await self._sessions.open(seat.proof or NO_PROOF, seat.identity, seat.robot, seat.code)
        answer: dict[str, object] = {"name": seat.identity, "robot": seat.robot}
        return token, answer | ({"studio": seat.code} if seat.studio else {})


def _header(credentials: Credentials) -> str:
    """Return the credentials as an Authorization header."""
    if credentials.token:
        return f"Bearer {credentials.token.strip()}"
    pair = f"{credentials.name}:{credentials.password}".encode("utf-8", "surrogatepass")
    return "Basic " + base64.b64encode(pair).decode()
