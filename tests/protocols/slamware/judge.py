"""A client that asserts of every answer that the door's OpenAPI document describes it."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from typing import Any

import httpx

from tests.protocols.slamware.generated import Generator, Request


class Judge:
    """Sends requests, and judges what comes back."""

    def __init__(self, client: httpx.AsyncClient, document: Mapping[str, Any]) -> None:
        self._client, self._generator = client, Generator(document, 0)
        self._patterns = [
            (re.compile(re.sub(r"\\\{\w+\\\}", "[^/]+", re.escape(path))), methods)
            for path, methods in sorted(document["paths"].items(), key=lambda entry: "{" in entry[0])
        ]
        self.get, self.post = functools.partial(self.ask, "GET"), functools.partial(self.ask, "POST")
        self.put, self.delete = functools.partial(self.ask, "PUT"), functools.partial(self.ask, "DELETE")

    @classmethod
    async def of(cls, client: httpx.AsyncClient) -> Judge:
        return cls(client, (await client.get("/openapi.json")).json())

    async def ask(self, method: str, path: str, **content: Any) -> httpx.Response:
        """The answer to a request."""
        reply = await self._client.request(method, path, **content)
        operation = next(found[method.lower()] for pattern, found in self._patterns if pattern.fullmatch(path))
        request = Request(f"{method} {path}", operation, method, path, {}, {}, None, wrong=False)
        problem = self._generator.problem(request, reply)
        assert not problem, f"{method} {path}: {problem}: {reply.text}"
        return reply
