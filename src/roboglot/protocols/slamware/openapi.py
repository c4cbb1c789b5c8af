"""OpenAPI 3.1 document of the served operations, made from the handlers' signatures and docstrings."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from roboglot.model.components.logistics.delivery import OrderStatus
from roboglot.operations import Operation
from roboglot.protocols.slamware.chapters import industry
from roboglot.protocols.slamware.chapters.delivery import vocabulary as delivery
from roboglot.protocols.slamware.chapters.firmware.uploads import Upload
from roboglot.protocols.slamware.chapters.motion.actions import FACTORIES
from roboglot.protocols.slamware.chapters.system.system import SLEEP_MODES
from roboglot.protocols.slamware.routes import ALIASES, BEYOND, SHORTHANDS
from roboglot.protocols.slamware.table import TABLE, NoContent, Text
from roboglot.protocols.slamware.vocabulary import RIDE_STAGES
from roboglot.text_files import content_of
from roboglot.wire.contracts import contract

BODIES = (bytes, Upload)  # not JSON
REFERENCE = "#/components/schemas/{name}"
BINARY = {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}}
Schema = dict[str, Any]
_RIDES = [word for word in RIDE_STAGES.values() if word]
_STATUSES = [status.upper() for status in OrderStatus]
# Values of fields whose types are plain text, as other firmware has further ones.
WORDS: Mapping[str, Iterable[str]] = {
    "Box.door_status": delivery.DOORS.values(),
    "Box.lock_status": ("LOCKED", "UNLOCKED"),
    "Box.stock_status": delivery.STOCKS.values(),
    "Box.status": ("EMPTY", "NOT_EMPTY", "ERROR"),
    "DeliveryTask.status": _STATUSES,
    "DeliveryTaskRequest.type": delivery.KIND_WORDS.values(),
    "IndustryResult.stage": (*_RIDES, *industry.STAGES.values(), "WAIT_OPERATION"),
    "IndustryTask.status": _STATUSES,
    "PowerStatus.powerStage": ("running", "restarting", "shutingdown"),
    "PowerStatus.sleepMode": SLEEP_MODES.values(),
    "TaskResult.stage": (*_RIDES, *delivery.STAGES.values()),
}


def document() -> Schema:
    """Return the document; partial operations have ``x-partial``, aliases are ``deprecated``."""
    schemas = _Schemas()
    chinese = summaries()
    paths: Schema = {}
    for row in (*contract("slamware"), *BEYOND):
        if (operation := TABLE.get(row.key)) is not None:
            method, _, path = row.key.partition(" ")
            described = schemas.describe(operation, path)
            described |= {"operationId": row.name, "tags": [row.chapter], "x-summary-zh": chinese.get(row.name, "")}
            paths.setdefault(path, {})[method.lower()] = described
    for key, meant in ALIASES.items():
        method, _, path = key.partition(" ")
        described = {**paths[meant.partition(" ")[2]][method.lower()], "deprecated": True}
        described["operationId"] += path.title().replace("/", "")
        if action := SHORTHANDS.get(path):
            either = {"anyOf": [schemas.of(FACTORIES[action].options), {"type": "null"}]}
            options = {"application/json": {"schema": either}}
            described["requestBody"] = {"required": False, "content": options}
        paths.setdefault(path, {})[method.lower()] = described
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "Slamware REST",
            "version": "1.1.0",
            "description": "What this robot serves of the API. Lengths in m, angles in rad, counter-clockwise.",
        },
        "paths": paths,
        "components": {"schemas": schemas.components()},
    }


def summaries() -> Mapping[str, str]:
    """Return the Chinese summaries by the operation's name."""
    data = content_of(Path(__file__).with_name("page") / "summaries.zh.json")
    return msgspec.json.decode(data, type=dict[str, str])


class _Schemas:
    """Schemas of all types, made together so that each type has one name."""

    def __init__(self) -> None:
        self._types: list[object] = []
        for operation in TABLE:
            self._types += [kind for kind in _members(operation.answer) if _is_json(kind)]
            self._types += [f.type for f in msgspec.structs.fields(operation.parameters) if f.type not in BODIES]
        self._types += [factory.options for factory in FACTORIES.values()]
        self._made, self._components = msgspec.json.schema_components(
            self._types, schema_hook=_anything, ref_template=REFERENCE
        )

    def components(self) -> Schema:
        """Return the schemas by name; an action's options are any of its kinds' options."""
        options = [self.of(kind) for kind in dict.fromkeys(factory.options for factory in FACTORIES.values())]
        request = self._components["ActionRequest"]["properties"]
        request["options"] = {"anyOf": [*options, {"type": "null"}]}
        request["action_name"]["examples"] = [f"slamtec.agent.actions.{name}" for name in FACTORIES]
        for place, words in WORDS.items():
            name, _, field = place.partition(".")
            listed = self._components[name]["properties"][field]
            listed["enum"] = sorted(set(words))
            listed.pop("default", None)  # an absent word is omitted
        return {name: _without_tuples(schema) for name, schema in self._components.items()}

    def describe(self, operation: Operation[str], path: str) -> Schema:
        """Return summary, parameters, body and answers of an operation."""
        described: Schema = {
            "summary": operation.summary.replace("``", "`"),
            "responses": self._responses(operation.answer),
        }
        if operation.partial:
            described["x-partial"] = operation.partial
        parameters = []
        for field in msgspec.structs.fields(operation.parameters):
            if field.name == "body":
                binary = field.type in BODIES
                content = BINARY if binary else {"application/json": {"schema": self.of(field.type)}}
                described["requestBody"] = {"required": field.required, "content": content}
                continue
            place = "path" if f"{{{field.name}}}" in path else "query"
            schema = self.of(field.type)
            if place == "query" and not field.required:  # an empty "?status=" counts as absent
                schema = {"anyOf": [schema, {"type": "string", "maxLength": 0}]}
            parameters.append({"name": field.name, "in": place, "required": field.required, "schema": schema})
        if parameters:
            described["parameters"] = parameters
        return described

    def _responses(self, answer: object) -> Schema:
        refused = {"description": "Refused; the text is in the reason phrase too.", "content": {"text/plain": {}}}
        if answer is NoContent:
            return {"204": {"description": "OK"}, "default": refused}
        done: Schema = {"description": "OK"}
        kinds = [self.of(kind) for kind in _members(answer) if _is_json(kind)]
        if kinds and type(None) in _members(answer):
            kinds.append({"type": "null"})
        if answer is bytes:
            done["content"] = BINARY
        elif answer is Text:
            done["content"] = {kind: {"schema": {"type": "string"}} for kind in ("application/json", "text/plain")}
        elif kinds:
            schema = kinds[0] if len(kinds) == 1 else {"oneOf": kinds}
            done["content"] = {"application/json": {"schema": schema}}
        return {"200": done, "default": refused}

    def of(self, kind: object) -> Schema:
        """Return the schema of a type."""
        return dict(self._made[self._types.index(kind)])


def _members(kind: object) -> tuple[object, ...]:
    """Return the members of a union, or the type itself."""
    return typing.get_args(kind) if isinstance(kind, types.UnionType) else (kind,)


def _is_json(kind: object) -> bool:
    return kind not in (None, type(None), bytes, Text, NoContent)


def _anything(_: type) -> Schema:
    return {"description": "anything"}


def _without_tuples(schema: object) -> object:
    """Return ``schema`` with homogeneous tuples as lists of fixed length, as many tools lack ``prefixItems``."""
    match schema:
        case {"prefixItems": [first, *others], **rest} if all(other == first for other in others):
            return {**rest, "items": first}
        case dict():
            return {key: _without_tuples(value) for key, value in schema.items()}
        case list():
            return [_without_tuples(value) for value in schema]
    return schema
