"""Requests made from the door's own OpenAPI document, right and wrong ones, and what their answers have to be.

A generator of its own, for it needs what no general one has: names that earlier answers gave, so that requests reach
something. By hand, against a robot that is up: ``python tests/protocols/slamware/generated.py --count 100000``.
"""

from __future__ import annotations

import argparse
import json
import random
import re
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote

import httpx

Schema = Mapping[str, Any]
# After these the robot is off for a while, and its port closed.
SILENCING = {
    "POST /api/core/system/v1/power/:shutdown",
    "POST /api/core/system/v1/power/:restartmodule",
}
NUMBERS = (0, 1, -1, 2, 0.5, -0.25, 3.14, 100, 255, 256, 65536, 2**31, -(2**63), 2**64, 1e9, -1e300, 1e-300)
TEXTS = (
    "",
    "a",
    "0",
    "-1",
    "true",
    "None",
    "1F",
    ":current",
    "大厅",
    "a/b",
    "a\0b",
    "x" * 300,
    "😀",
    "%2F",
    "nan",
    "1e999",
)
JUNK: tuple[Any, ...] = (*NUMBERS, *TEXTS, None, True, False, [], {}, [[]], [None], {"": {}}, [0] * 200)
WRONG = 0.25  # one in this many requests has an error
POOL_MAX = 60
KINDS: dict[str, Any] = {
    "null": type(None),
    "boolean": bool,
    "integer": int,
    "number": int | float,
    "string": str,
    "array": list,
    "object": dict,
}


@dataclass(frozen=True, slots=True)
class Request:
    """One request, and the description of the operation that it is for."""

    key: str
    operation: Schema
    method: str
    url: str
    params: dict[str, str]
    headers: dict[str, str]
    content: bytes | None
    wrong: bool
    forbidden: str = ""  # objections of the document to the body


@dataclass(slots=True)
class Generator:
    """Endless requests; the same seed makes the same ones as long as the answers are the same."""

    document: Schema
    seed: int
    exclude: frozenset[str] = frozenset(SILENCING)
    pool: list[str] = field(default_factory=list)
    binaries: list[bytes] = field(default_factory=lambda: [b"", b"STCM", bytes(range(256)) * 40])

    def requests(self) -> Iterator[Request]:
        """Yield every operation in turn, in another order each time."""
        chance = random.Random(self.seed)
        operations = [
            (f"{method.upper()} {path}", operation)
            for path, methods in self.document["paths"].items()
            for method, operation in methods.items()
        ]
        operations = [(key, operation) for key, operation in operations if key not in self.exclude]
        while True:
            chance.shuffle(operations)
            for key, operation in operations:
                yield self._request(chance, key, operation)

    def learn(self, answer: object) -> None:
        """Remember texts and numbers of an answer that may be names."""
        match answer:
            case dict():
                for name, value in answer.items():
                    if isinstance(value, str | int) and re.search("id|name|building|floor|key", str(name)):
                        self.pool.append(str(value))
                    else:
                        self.learn(value)
            case list():
                for value in answer[:20]:
                    self.learn(value)
        del self.pool[:-POOL_MAX]

    def _request(self, chance: random.Random, key: str, operation: Schema) -> Request:
        method, _, url = key.partition(" ")
        wrong = chance.random() < WRONG
        params = {}
        for parameter in operation.get("parameters", ()):
            if not parameter["required"] and chance.random() < 0.5:
                continue
            value = self._value(chance, parameter["schema"])
            if wrong and chance.random() < 0.5:
                value = chance.choice(JUNK)
            text = value if isinstance(value, str) else json.dumps(value)
            if parameter["in"] == "path":
                url = url.replace(f"{{{parameter['name']}}}", quote(text, safe="") or "%00")
            else:
                params[parameter["name"]] = text
        headers, content = {"accept": chance.choice(("*/*", "application/json", "text/plain"))}, None
        if (body := operation.get("requestBody")) and (body["required"] or chance.random() < 0.8):
            kind, described = chance.choice(list(body["content"].items()))
            headers["content-type"] = kind
            content, forbidden = self._body(chance, kind, described["schema"], wrong)
            return Request(key, operation, method, url, params, headers, content, wrong, forbidden)
        return Request(key, operation, method, url, params, headers, content, wrong)

    def _body(self, chance: random.Random, kind: str, schema: Schema, wrong: bool) -> tuple[bytes, str]:
        if kind != "application/json":
            data = bytearray(chance.choice(self.binaries))
            for _ in range(chance.choice((0, 1, 4)) if data else 0):
                data[chance.randrange(min(len(data), 400))] = chance.randrange(256)
            return bytes(data), ""
        value = self._value(chance, schema)
        if wrong:
            value = spoilt(chance, value)
        text = json.dumps(value).encode()
        if wrong and chance.random() < 0.1:
            return text[: chance.randrange(len(text))], ""
        return text, self.misfit(value, schema, more=True)

    def _value(self, chance: random.Random, schema: Schema, depth: int = 0) -> Any:
        schema = self.resolve(schema)
        if choices := schema.get("enum") or (schema.get("examples") if chance.random() < 0.8 else None):
            return chance.choice(choices)
        if options := schema.get("anyOf") or schema.get("oneOf"):
            return self._value(chance, chance.choice(options), depth + 1)
        match schema.get("type"):
            case None:
                return chance.choice(JUNK)
            case "null":
                return None
            case "boolean":
                return chance.random() < 0.5
            case "integer" | "number" as kind:
                return number(chance, schema, kind)
            case "string":
                return self._text(chance, schema)
            case "array":
                low, high = schema.get("minItems", 0), schema.get("maxItems", 1000)
                count = max(low, min(high, chance.choice((0, 1, 1, 2, 3, 40)) if depth < 4 else 0))
                return [self._value(chance, schema.get("items", {}), depth + 1) for _ in range(count)]
            case "object":
                return self._object(chance, schema, depth)
            case other:
                raise AssertionError(f"what is a {other}?")

    def _object(self, chance: random.Random, schema: Schema, depth: int) -> dict[str, Any]:
        required, made = schema.get("required", ()), {}
        for name, inner in schema.get("properties", {}).items():
            if name in required or (depth < 6 and chance.random() < 0.5):
                made[name] = self._value(chance, inner, depth + 1)
        if isinstance(more := schema.get("additionalProperties"), Mapping):
            for _ in range(chance.choice((0, 1, 3))):
                made[chance.choice(("display_name", "type", "elevator_id", "x"))] = self._value(chance, more, depth + 1)
        return made

    def _text(self, chance: random.Random, schema: Schema) -> str:
        low, high = schema.get("minLength", 0), schema.get("maxLength", 1 << 20)
        texts = [*self.pool[-chance.randrange(1, POOL_MAX) :]] if chance.random() < 0.6 else [*TEXTS]
        text = (chance.choice(texts) if texts else "a")[:high]
        return text if len(text) >= low else text + "a" * (low - len(text))

    def resolve(self, schema: Schema) -> Schema:
        """``schema``, or what it refers to."""
        while "$ref" in schema:
            schema = self.document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
        return schema

    def problem(self, request: Request, reply: httpx.Response) -> str:
        """Return the error in an answer; empty if there is none."""
        if reply.status_code >= 500 and reply.status_code != 501:
            return "a server's fault"
        if reply.status_code >= 400:
            return "" if reply.headers.get("content-type", "").startswith("text/plain") else "an error without a text"
        if request.forbidden:
            return f"a body that the document forbids: {request.forbidden}"
        described = request.operation["responses"].get(str(reply.status_code))
        if described is None:
            return "a status that is not described"
        contents = described.get("content")
        if not contents:
            return "a body that is not described" if reply.content else ""
        kind = reply.headers.get("content-type", "").partition(";")[0]
        if kind not in contents:
            return f"{kind!r} is not among {list(contents)}"
        if kind != "application/json":
            return ""
        answer = json.loads(reply.content, parse_constant=lambda name: sys.exit(f"{name} is no JSON"))
        self.learn(answer)
        return self.misfit(answer, contents[kind]["schema"])

    def misfit(self, value: Any, schema: Schema, path: str = "$", *, more: bool = False) -> str:
        """Return where and why ``value`` breaks ``schema``; empty if it does not. ``more``: objects may have more."""
        schema = self.resolve(schema)
        if options := schema.get("anyOf") or schema.get("oneOf"):
            misfits = [self.misfit(value, option, path, more=more) for option in options]
            return "" if "" in misfits else " / ".join(misfits)
        if "enum" in schema and value not in schema["enum"]:
            return f"{path}: {value!r} is not in {schema['enum']}"
        kind = schema.get("type")
        if kind == "integer" and isinstance(value, float) and value.is_integer() and abs(value) < 2**53:
            value = int(value)
        if kind and not (isinstance(value, KINDS[kind]) and (kind == "boolean" or not isinstance(value, bool))):
            return f"{path}: {str(value)[:80]!r} is no {kind}"
        if isinstance(value, int | float) and not (
            schema.get("minimum", value) <= value <= schema.get("maximum", value)
            and (value > schema["exclusiveMinimum"] if "exclusiveMinimum" in schema else True)
        ):
            return f"{path}: {value} is out of range"
        if isinstance(value, str) and not schema.get("minLength", 0) <= len(value) <= schema.get("maxLength", 1 << 30):
            return f"{path}: {len(value)} characters"
        if isinstance(value, list):
            if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", 1 << 30):
                return f"{path}: {len(value)} entries"
            found = (self.misfit(entry, schema.get("items", {}), f"{path}[]", more=more) for entry in value)
            return next(filter(None, found), "")
        return self._object_misfit(value, schema, path, more) if isinstance(value, dict) else ""

    def _object_misfit(self, value: dict[str, Any], schema: Schema, path: str, anything: bool) -> str:
        if missing := [name for name in schema.get("required", ()) if name not in value]:
            return f"{path}: no {missing}"
        properties, more = schema.get("properties", {}), schema.get("additionalProperties", "properties" not in schema)
        for name, entry in value.items():
            if name not in properties and more is False and not anything:
                return f"{path}: {name} is not described"
            inner = properties.get(name, more if isinstance(more, Mapping) else {})
            if found := self.misfit(entry, inner, f"{path}.{name}", more=anything):
                return found
        return ""


def number(chance: random.Random, schema: Schema, kind: str) -> int | float:
    """Return a number within the schema's bounds, often at their edges."""
    low, high = schema.get("minimum", schema.get("exclusiveMinimum", -1e6)), schema.get("maximum", 1e6)
    if kind == "integer":
        low, high = int(low), int(high)
        return chance.choice((low, high, chance.randint(low, high), max(low, min(1, high))))
    # Away from the edges: drawings at the world's end may reach beyond it.
    low, high = (bound * 0.9 if abs(bound) > 1e4 else bound for bound in (low, high))
    near = max(low, min(high, chance.uniform(-3, 3)))
    value = chance.choice((low, high, near, near, near, float(round(near))))
    return value if value != schema.get("exclusiveMinimum") else min(high, low + 0.5)


def spoilt(chance: random.Random, value: Any) -> Any:
    """``value`` with one part exchanged for anything, left out, or added."""
    if isinstance(value, dict) and value and chance.random() < 0.8:
        name, made = chance.choice(list(value)), dict(value)
        match chance.randrange(4):
            case 0:
                del made[name]
            case 1:
                made["extra"] = chance.choice(JUNK)
            case _:
                made[name] = spoilt(chance, made[name])
        return made
    if isinstance(value, list) and value and chance.random() < 0.8:
        return [*value[:-1], spoilt(chance, value[-1])]
    return chance.choice(JUNK)


def tell(request: Request, reply: httpx.Response, problem: str) -> str:
    """Return the description of a failure, as one can repeat it."""
    asked = f"{request.method} {request.url} {request.params} {request.headers}\n  {(request.content or b'')[:400]!r}"
    answered = f"{reply.status_code} {reply.reason_phrase} {reply.headers.get('content-type')} {reply.content[:300]!r}"
    return f"{problem}\n  {asked}\n  -> {answered}"


def main() -> None:
    """Send them to a running robot and print the misfits."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--url", default="http://127.0.0.1:1448")
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    statuses: Counter[int] = Counter()
    failures = 0
    with httpx.Client(base_url=options.url, timeout=60) as client:
        generator = Generator(client.get("/openapi.json").json(), options.seed)
        generator.binaries.append(client.get("/api/core/slam/v1/maps/stcm").content)
        began = time.monotonic()
        for number, request in zip(range(options.count), generator.requests(), strict=False):
            if number % 1000 == 0:
                print(f"{number:8} {time.monotonic() - began:6.0f} s {dict(statuses)}", flush=True)
            try:
                reply = client.request(
                    request.method, request.url, params=request.params, headers=request.headers, content=request.content
                )
            except httpx.TimeoutException:
                failures += 1
                print(f"no answer in 10 s: {request.method} {request.url} {request.params} {request.content!r}")
                continue
            except httpx.ConnectError:
                failures += 1
                print(f"no one there after {number} requests; a setting of delivery may have let it run empty")
                break
            statuses[reply.status_code] += 1
            if problem := generator.problem(request, reply):
                failures += 1
                print(tell(request, reply, problem))
    print(f"{options.count} requests, {failures} failures, {dict(statuses)}")
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
