"""Parameters of a request for its handler: from path, query and body, all bounded."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import parse_qsl

import msgspec

from roboglot.operations import Operation
from roboglot.protocols.slamware.bodies import Receive, Scope, chunks, read_body
from roboglot.protocols.slamware.chapters.firmware.uploads import PACKAGE_MAX, Upload
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.errors import HttpError, bad_request
from roboglot.protocols.slamware.routes import SHORTHANDS, Match
from roboglot.spelling import brief, instead
from roboglot.validation import why_invalid

BODY_MAX = 1 << 20  # bytes of a JSON body
UPLOAD_MAX = 64 << 20  # bytes of a binary body
UPLOADS_MAX = 4  # at a time
QUERY_FIELDS_MAX = 32
WORD_MAX = 60  # characters of an unknown field's name in an answer
WHOLE_MAX = 2.0**53  # beyond it floats cannot represent every integer


class Parameters:
    """Parameters of one robot's requests; counts uploads in progress."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._uploads = 0

    async def read(self, operation: Operation[str], match: Match, scope: Scope, receive: Receive) -> dict[str, object]:
        """Return a handler's parameters by name: path over query, and the body. Raises HttpError."""
        values = self.named(operation, match, scope)
        kind = operation.parameters.__annotations__.get("body")
        if kind is bytes:
            values["body"] = scope["body"] = await self.whole(scope, receive)
        elif kind is Upload:
            values["body"] = await self._stored(scope, receive)
        elif "body" in operation.names:
            body = scope["body"] = await read_body(scope, receive, BODY_MAX)
            if (action := SHORTHANDS.get(scope["path"])) is not None:
                body = b'{"action_name":"%s","options":%s}' % (self._prefixed(action), body or b"{}")
            if not body and not operation.requires("body"):
                return values
            try:
                sent = whole_numbers(msgspec.json.decode(body))
                values["body"] = msgspec.convert(sent, kind)
            except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as error:
                why = why_invalid(error, "the body", wanted=kind) if body else "a JSON body is needed"
                raise bad_request(operation.key, why) from None
            if why := _why_unknown(sent, values["body"]):
                raise bad_request(operation.key, why)
        return values

    def named(self, operation: Operation[str], match: Match, scope: Scope) -> dict[str, object]:
        """Return the parameters in path and query. Raises HttpError."""
        try:
            text = scope["query_string"].decode("latin-1")
            query = parse_qsl(text, max_num_fields=QUERY_FIELDS_MAX) if text else ()
        except ValueError as error:
            raise bad_request(operation.key, str(error)) from None
        values: dict[str, object] = {**dict(query), **match.values}
        values.pop("body", None)
        return values

    async def whole(self, scope: Scope, receive: Receive) -> bytes:
        """Read a whole binary body. Raises HttpError."""
        with self._uploading():
            return await read_body(scope, receive, UPLOAD_MAX)

    def _prefixed(self, action: str) -> bytes:
        return (self._context.actions.prefix + action).encode()

    @contextmanager
    def _uploading(self) -> Iterator[None]:
        """Count an upload. Raises HttpError 503 if there are too many."""
        if self._uploads >= UPLOADS_MAX:
            raise HttpError(503, "Service Unavailable", f"{UPLOADS_MAX} uploads are under way")
        self._uploads += 1
        try:
            yield
        finally:
            self._uploads -= 1

    async def _stored(self, scope: Scope, receive: Receive) -> Upload:
        """Write a binary body to disk as it arrives."""
        with self._uploading():
            upload = Upload()
            try:
                async for chunk in chunks(scope, receive, PACKAGE_MAX):
                    upload.write(chunk)
            except BaseException:
                upload.close()
                raise
            return upload


def _why_unknown(sent: object, body: object) -> str:
    """Return what is wrong if no field that was sent is known: the answer would be a success, for nothing done."""
    names = body.__struct_encode_fields__ if isinstance(body, msgspec.Struct) else ()
    if not isinstance(sent, dict) or not sent or not names or not sent.keys().isdisjoint(names):
        return ""
    word = next(iter(sent))
    return f"{brief(word, WORD_MAX)} is unknown{instead(word, names)}"


def whole_numbers(value: object) -> object:
    """Return JSON's ``value`` with 2.0 as 2, since both are integers in JSON schemas."""
    match value:
        case float() if value.is_integer() and abs(value) < WHOLE_MAX:
            return int(value)
        case dict():
            return {key: whole_numbers(entry) for key, entry in value.items()}
        case list():
            return [whole_numbers(entry) for entry in value]
    return value
