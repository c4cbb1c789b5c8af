"""The reference cloud, where robots post events and people choose favourites. An ASGI application.

Knows accounts and documents; no robot, and no more of a frame than type, operate and ids.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from roboglot.protocols.browsers import Browsers, of_rows
from roboglot.storage.cloud import CloudStore, TooMany
from roboglot.wire.visual.cloud import KINDS, RECORD, ROBOT_HEADER, CloudCode, format_answer
from roboglot.wire.visual.requests import DEBUG, FRAME_MAX, ID_MAX, TARGETS_MAX

log = logging.getLogger(__name__)

BODY_MAX = 4 * FRAME_MAX  # bytes
BODY_SECONDS_MAX = 30.0  # s (machine clock) for a body to arrive
RECORDS_SHOWN = 1000
STATUS = {CloudCode.MISSING: 400}  # HTTP status, where it differs from the code

Scope = Mapping[str, Any]
Receive = Callable[[], Awaitable[Mapping[str, Any]]]
Send = Callable[[Mapping[str, object]], Awaitable[None]]


class Answer(Exception):
    """The end of a request."""

    def __init__(self, code: CloudCode, message: str, items: list[dict[str, object]] | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.items = items


class BackEnd:
    """``POST /programs`` is the robots' (0.2.1.3), ``POST /favourites`` the people's; both with an account's token."""

    def __init__(self, store: CloudStore, browsers: Browsers | None = None) -> None:
        self._store = store
        self._browsers = browsers or Browsers("")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            return
        frame: dict[str, object] = {}
        try:
            await self._serve(scope, receive, frame)
        except Answer as answer:
            code, message, items = answer.code, str(answer), answer.items
        except Exception:
            log.exception("a request crashed")
            code, message, items = CloudCode.BROKEN, "the cloud could not do it", None
        id = frame.get("id")
        body = format_answer(code, message, id if isinstance(id, str) else "", items)
        status = STATUS.get(code, int(code) if len(code) == 3 else 500)
        headers = [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode())]
        await send({"type": "http.response.start", "status": status, "headers": headers})
        await send({"type": "http.response.body", "body": body})

    async def _serve(self, scope: Scope, receive: Receive, frame: dict[str, object]) -> None:
        """Handle a request; always raises Answer. ``frame`` receives the fields of the frame."""
        if why := self._browsers.refusal(of_rows(scope["headers"], scope["method"])):
            raise Answer(CloudCode.REFUSED, why)
        handler = {"/programs": self._program, "/favourites": self._favourite}.get(scope["path"])
        if handler is None:
            raise Answer(CloudCode.NOT_FOUND, "only /programs and /favourites exist")
        if scope["method"] != "POST":
            raise Answer(CloudCode.NO_SUCH_METHOD, "only POST is allowed")
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        account = await self._account(headers.get("authorization", ""))
        try:
            async with asyncio.timeout(BODY_SECONDS_MAX):
                frame |= await _json_of(receive)
        except TimeoutError:
            raise Answer(CloudCode.TIMED_OUT, f"the frame took longer than {BODY_SECONDS_MAX:g} s") from None
        await handler(account, headers.get(ROBOT_HEADER, "")[:ID_MAX], frame)
        raise Answer(CloudCode.OK, "done")

    async def _account(self, authorization: str) -> str:
        scheme, _, token = authorization.partition(" ")
        if scheme.lower() != "bearer" or not token:
            raise Answer(CloudCode.UNAUTHORISED, "an account's token is required: Authorization: Bearer …")
        if (account := await self._store.account_of(token.strip())) is None:
            raise Answer(CloudCode.REFUSED, "no account has this token")
        return account

    async def _program(self, account: str, robot: str, frame: dict[str, object]) -> None:
        """Handle a robot's post: a frame of its front end, an inquiry of its own, or a feedback."""
        if "feedback" in frame:
            await self._store.record(account, robot, json.dumps(frame))
            return
        kind, operate, ids = _text(frame, "type"), _text(frame, "operate"), _ids(frame)
        if operate == "inquiry":
            raise Answer(CloudCode.OK, "these", await self._inquire(account, kind, ids))
        if kind not in KINDS:
            raise Answer(CloudCode.NOT_FOUND, f"there is no type {kind}")
        if not ids:
            raise Answer(CloudCode.MISSING, "target_id is empty")
        document = json.dumps(frame)
        if operate == "save":
            for name in ("mode", "condition", "body"):
                _text(frame, name)
            try:
                await self._store.save(account, kind, ids[0], document)
            except TooMany as full:
                raise Answer(CloudCode.REFUSED, str(full)) from None
        elif operate == "delete":
            await self._store.delete(account, kind, ids)
        elif ids != [DEBUG]:
            await self._store.record(account, robot, document)

    async def _inquire(self, account: str, kind: str, known: list[str]) -> list[dict[str, object]]:
        """Return favourites that the robot lacks, or events of the account's robots."""
        if kind in KINDS:
            found = [json.loads(document) for document in await self._store.favourites(account, kind, known)]
            return [frame | {"id": frame["target_id"][0], "operate": "save", "state": "null"} for frame in found]
        if kind != RECORD:
            raise Answer(CloudCode.NOT_FOUND, f"there is no type {kind}")
        rows = await self._store.records(account, RECORDS_SHOWN)
        return [_record(robot, json.loads(document)) for robot, document in rows]

    async def _favourite(self, account: str, _robot: str, request: dict[str, object]) -> None:
        """Set a favourite: ``{"type", "id", "favourite": true or false}``."""
        kind, id = _text(request, "type"), _text(request, "id")
        favourite = request.get("favourite", True)
        if kind not in KINDS or not id.isprintable():
            raise Answer(CloudCode.NOT_FOUND, f"there is no such {kind}")
        if not isinstance(favourite, bool):
            raise Answer(CloudCode.MISSING, "favourite is true or false")
        if not await self._store.set_favourite(account, kind, id, favourite=favourite):
            raise Answer(CloudCode.NOT_FOUND, f"no robot of this account has saved the {kind} {id}")


async def _json_of(receive: Receive) -> dict[str, object]:
    """Return the body of a request as a JSON object. Raises Answer."""
    body = bytearray()
    while True:
        event = await receive()
        body += event.get("body", b"")
        if event["type"] == "http.disconnect" or len(body) > BODY_MAX:
            raise Answer(CloudCode.REFUSED, f"a frame has at most {BODY_MAX} bytes")
        if not event.get("more_body"):
            break
    try:
        frame = json.loads(bytes(body))
    except (ValueError, RecursionError):
        frame = None
    if not isinstance(frame, dict):
        raise Answer(CloudCode.MISSING, "a JSON object is required")
    return frame


def _text(frame: dict[str, object], name: str) -> str:
    value = frame.get(name)
    if not isinstance(value, str) or not value:
        raise Answer(CloudCode.MISSING, f"{name} is missing")
    return value


def _ids(frame: dict[str, object]) -> list[str]:
    ids = frame.get("target_id", [])
    most = TARGETS_MAX if frame.get("operate") != "inquiry" else 20 * TARGETS_MAX
    if not isinstance(ids, list) or len(ids) > most:
        raise Answer(CloudCode.MISSING, f"target_id is a list of at most {most} ids")
    if not all(isinstance(id, str) and 0 < len(id) <= ID_MAX and id.isprintable() for id in ids):
        raise Answer(CloudCode.MISSING, f"ids are texts of 1 to {ID_MAX} characters")
    return ids


def _record(robot: str, document: dict[str, Any]) -> dict[str, Any]:
    """Return an event as an item of a list."""
    event = document.get("feedback", document)
    targets = event.get("target_id", "")
    return {
        "type": RECORD,
        "id": ",".join(targets) if isinstance(targets, list) else targets,
        "describe": event.get("describe", ""),
        "operate": event.get("operate", ""),
        "style": robot,
        "mode": event.get("mode", ""),
        "condition": event.get("condition", ""),
        "body": "",
        "state": event.get("state", ""),
    }
