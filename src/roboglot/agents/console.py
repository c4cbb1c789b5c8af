"""Client of the console's interface. Knows no robot and no tool."""

from __future__ import annotations

import asyncio
import http.client
from collections.abc import Mapping
from typing import TypeVar
from urllib.error import HTTPError, URLError
from urllib.parse import quote
from urllib.request import Request, urlopen

import msgspec

from roboglot.validation import decode_json

ANSWER_MAX = 16 << 20  # bytes
SECONDS = 20.0  # per answer


T = TypeVar("T")


class Refused(Exception):
    """The console refused or failed; the text is the reason, ``status`` HTTP's, if there was an answer."""

    status = 0


class ConsoleClient:
    """One console at ``url`` (http://127.0.0.1:50080); ``token``: if access is controlled.

    ``seconds``: for which the console may be silent.
    """

    def __init__(self, url: str, token: str = "", seconds: float = SECONDS) -> None:
        self._url, self._seconds = url.rstrip("/"), seconds
        self._headers = {"authorization": f"Bearer {token}"} if token else {}

    async def get(self, kind: type[T], *path: str) -> T:
        """Return the JSON below /api/ as a ``kind``. Raises Refused, even for JSON of another type."""
        return _decoded(await self.fetch(*path), kind)

    async def post(self, kind: type[T], *path: str, values: Mapping[str, object]) -> T:
        """Post ``values`` and return the result as a ``kind``. Raises Refused, even for JSON of another type."""
        return _decoded(await self.fetch(*path, body=msgspec.json.encode(values)), kind)

    async def fetch(self, *path: str, body: bytes | None = None) -> bytes:
        """Return the bytes below /api/. Raises Refused."""
        address = "/".join([self._url, "api", *(quote(part, safe="") for part in path)])
        headers = self._headers | ({"content-type": "application/json"} if body is not None else {})
        return await asyncio.to_thread(self._fetch, Request(address, data=body, headers=headers))

    def _fetch(self, request: Request) -> bytes:
        try:
            with urlopen(request, timeout=self._seconds) as reply:
                data: bytes = reply.read(ANSWER_MAX + 1)
        except HTTPError as error:
            with error:
                refused = Refused(_reason(error))
                refused.status = error.code
                raise refused from None
        except http.client.HTTPException as error:
            raise Refused(f"no roboglot answers at {self._url}: it is no HTTP ({type(error).__name__})") from None
        except (URLError, OSError) as error:
            why = getattr(error, "reason", error)
            raise Refused(f"no roboglot answers at {self._url}: {why}; start it with `roboglot up`") from None
        if len(data) > ANSWER_MAX:
            raise Refused(f"the answer is longer than {ANSWER_MAX} bytes")
        return data


def _decoded(data: bytes, kind: type[T]) -> T:
    try:
        return decode_json(data, kind)
    except msgspec.MsgspecError as error:
        raise Refused(f"the console's answer has the wrong form: {error}") from None


def _reason(error: HTTPError) -> str:
    try:
        return str(decode_json(error.read(ANSWER_MAX), dict)["error"])
    except (msgspec.MsgspecError, KeyError, TypeError):
        return f"{error.code} {error.reason}"
