"""Typed methods for operations: a signature determines path, query and body of the request, and type of the answer.

Parameters named in the contract key go into the path; ``body`` is sent as JSON, or unchanged if it is bytes; all others
that are not None form the query. Fields of an answer beyond the manual are ignored, missing ones raise BadAnswer.
"""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from types import NoneType
from typing import Any, ParamSpec, TypeVar, cast
from urllib.parse import quote, urlencode

import msgspec

from roboglot.clients.errors import BadAnswer, ClientError, RefusedByRobot
from roboglot.clients.slamware.http import Answer, HttpLink
from roboglot.model.tap import LOST, Line
from roboglot.validation import read_answer, why_invalid
from roboglot.values import dataclass
from roboglot.wire.slamware.chapters.slam.explore_map import BadMap, ExploreMap, decode_explore_map
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, decode_stcm, encode_stcm

P = ParamSpec("P")
T = TypeVar("T")
TIMEOUT = 5.0  # s for an answer
TRANSFER_TIMEOUT = 60.0  # s for maps and packages
BINARY_IN: Mapping[object, Callable[[bytes], object]] = {
    bytes: bytes,
    ExploreMap: decode_explore_map,
    CompositeMap: decode_stcm,
}


class SlamwareRefused(RefusedByRobot):
    """``code`` is the HTTP status, ``words`` the robot's explanation."""


class Chapter:
    """Base of the chapters; ``timeout`` is the limit of one request in s."""

    def __init__(self, link: HttpLink, timeout: float) -> None:
        self._link = link
        self.timeout = timeout


@dataclass(frozen=True, slots=True)
class _Plan:
    """HTTP form of a signature; made at the first call."""

    method: str
    path: str
    in_path: frozenset[str]
    signature: inspect.Signature
    decode: Callable[[Answer], object]
    transfer: bool


def call(key: str) -> Callable[[Callable[P, Awaitable[T]]], Callable[P, Coroutine[Any, Any, T]]]:
    """Turn a method (its body is never run) into a call of the contract's operation ``key`` ("GET /api/…").

    Raises SlamwareRefused for any status but 2xx, LinkLost, TimedOut, BadAnswer.
    """

    def make(stated: Callable[P, Awaitable[T]]) -> Callable[P, Coroutine[object, None, T]]:
        plan: list[_Plan] = []

        @functools.wraps(stated)
        async def ask(*args: P.args, **kwargs: P.kwargs) -> T:
            if not plan:
                plan.append(_plan(key, stated))
            bound = plan[0].signature.bind(*args, **kwargs)
            bound.apply_defaults()
            chapter = bound.arguments.pop("self")
            assert isinstance(chapter, Chapter)
            answer: T = await _ask(chapter, key, plan[0], bound.arguments)
            return answer

        vars(ask)["key"] = key  # lets tests compare the client with the contract
        return ask

    return make


def _plan(key: str, stated: Callable[..., Awaitable[object]]) -> _Plan:
    method, _, path = key.partition(" ")
    signature = inspect.signature(stated, eval_str=True)
    answer, body = signature.return_annotation, signature.parameters.get("body")
    transfer = answer in BINARY_IN or (body is not None and body.annotation in (bytes, CompositeMap))
    return _Plan(method, path, frozenset(re.findall(r"{(\w+)}", path)), signature, _decoder(key, answer), transfer)


async def _ask(chapter: Chapter, key: str, plan: _Plan, values: Mapping[str, Any]) -> Any:
    path = re.sub(r"{(\w+)}", lambda name: quote(str(values[name[1]]), safe=""), plan.path)
    query = {n: v for n, v in values.items() if n != "body" and n not in plan.in_path and v is not None}
    if query:
        path += "?" + urlencode(query)
    body, content_type = _encode(values.get("body"))
    timeout = max(TRANSFER_TIMEOUT, chapter.timeout) if plan.transfer else chapter.timeout
    asking, line = chapter._link.ask(plan.method, path, body, content_type, timeout), chapter._link.line
    if line is None or not line.watched:
        answer = await asking
    else:
        answer = await _noted(line, key, f"{plan.method} {path}\n\n".encode() + body, asking)
    if not 200 <= answer.status < 300:
        words = answer.body.decode("utf-8", "replace").strip()
        raise SlamwareRefused(key, answer.status, words if answer.reason in words else answer.reason)
    return plan.decode(answer)


async def _noted(line: Line, key: str, payload: bytes, asking: Awaitable[Answer]) -> Answer:
    """Return the answer; record request and answer."""
    began = line.request(key, payload)
    try:
        answer = await asking
    except ClientError as error:
        line.reply(key, b"", LOST, str(error), began)
        raise
    refusal = "" if 200 <= answer.status < 300 else answer.reason or str(answer.status)
    line.reply(key, bytes(answer.body), str(answer.status), refusal, began)
    return answer


def _encode(body: object) -> tuple[bytes, str]:
    match body:
        case None:
            return b"", "application/json"
        case bytes():
            return body, "application/octet-stream"
        case CompositeMap():
            return encode_stcm(body), "application/octet-stream"
        case _:
            return msgspec.json.encode(without_none(msgspec.to_builtins(body))), "application/json"


def without_none(value: Any) -> Any:
    """Return ``value`` without fields that are None, as robots differ in their handling of null."""
    match value:
        case dict():
            return {k: without_none(v) for k, v in value.items() if v is not None}
        case list():
            return [without_none(v) for v in value]
        case _:
            return value


def _decoder(key: str, kind: object) -> Callable[[Answer], object]:
    """Return a decoder of answers to values of type ``kind``; it raises BadAnswer."""
    if kind in (None, NoneType):
        return lambda _: None
    if kind is str:
        return lambda answer: _text(bytes(answer.body))
    if (binary := BINARY_IN.get(kind)) is not None:
        convert: Callable[[bytes], object] = binary
    else:
        convert = functools.partial(read_answer, kind=cast("type[object]", kind))

    def decode(answer: Answer) -> object:
        try:
            return convert(bytes(answer.body))
        except (msgspec.MsgspecError, BadMap, UnicodeDecodeError, RecursionError) as error:
            raise BadAnswer(f"{key}: {why_invalid(error, 'the answer')}") from None

    return decode


def _text(body: bytes) -> str:
    """Return a text that is bare or a JSON string, depending on the robot's build."""
    try:
        return msgspec.json.decode(body, type=str)
    except (msgspec.MsgspecError, UnicodeDecodeError):
        return body.decode("utf-8", "replace")
