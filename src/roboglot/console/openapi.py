"""The description of the console's interface (OpenAPI 3.1), made from the verbs' own signatures."""

from __future__ import annotations

from functools import lru_cache

import msgspec

from roboglot.console.desk import TAKE
from roboglot.console.verbs import maps as map_verbs
from roboglot.console.verbs.clock import CLOCK_VERBS
from roboglot.console.verbs.robots import VERBS
from roboglot.console.verbs.world import WORLD_VERBS
from roboglot.operations import Operation

assert map_verbs  # importing it registers its verbs
NAME = {"name": "name", "in": "path", "required": True, "schema": {"type": "string"}}
NUMBER = NAME | {"name": "number"}
READS = {
    "/api/me": "The caller, and whether this program has access control",
    "/api/class": "The class that is open, for its teacher; POST {do: open, lock, unlock, reset, give_back, close}",
    "/api/recording": "State of the recording of all robots; POST {do: start, stop, mark, delete}",
    "/api/recordings": "The recordings in the data folder",
    "/api/recordings/{file}": "A file of a recording",
    "/api/recordings/{file}/compared/{other}": "A page that compares two recordings; with /{name}, of one robot",
    "/api/recordings/{file}/watch": "Length, robots and marks of a recording",
    "/api/recordings/{file}/watch/{name}/{since}/camera.jpg": "What a robot's camera saw then, if it was recorded; ms",
    "/api/recordings/{file}/watch/{name}/{since}/{length}": "What a robot saw and did then; both times in ms",
    "/api/blocks": "Every function of robot programs for an editor: names, types, ranges, choices",
    "/api/lessons": "The missions of the studio",
    "/api/robots": "All robots with their poses",
    "/api/robots/{name}": "Everything the page shows of one robot",
    "/api/robots/{name}/camera.jpg": "A picture of this moment",
    "/api/robots/{name}/camera.mjpeg": "Pictures, one after the other",
    "/api/robots/{name}/sound.wav": "What the microphone hears, without an end",
    "/api/robots/{name}/map.zip": "The map as map_server of ROS reads it: a yaml file and a pgm image",
    "/api/robots/{name}/rehearse": "POST {steps} tries a plan in a copy of the world: how it ends, what it would touch",
    "/api/robots/{name}/program": "The script's program: its state and its log; POST {source} saves and runs another",
    "/api/robots/{name}/wire/{number}": "One exchange of a door, as long as it is kept",
    "/api/robots/{name}/wire/{number}/{form}": "That request as curl, nc, grpcurl, websocat or python",
    "/api/robots/{name}/map.png": "The map as a small picture with the robot on it",
    "/api/world.toml": "The simulated world as it stands now, as a world file",
    "/api/world": "Where everything in the simulated world really is",
}


@lru_cache(1)
def document(version: str) -> dict[str, object]:
    """Return the whole description."""
    paths: dict[str, object] = {path: {"get": _read(path, summary)} for path, summary in READS.items()}
    for operation in VERBS:
        paths[f"/api/robots/{{name}}/{operation.key}"] = {"post": _verb(operation, [NAME])}
    taking = {"operationId": TAKE, "summary": "Let only this client move the robot.", "parameters": [NAME]}
    paths[f"/api/robots/{{name}}/{TAKE}"] = {"post": taking | {"responses": _answers()}}
    again = {"operationId": "resend", "summary": "Send a request to its door again.", "parameters": [NAME, NUMBER]}
    paths["/api/robots/{name}/wire/{number}/resend"] = {"post": again | {"responses": _answers()}}
    for operation in (*WORLD_VERBS, *CLOCK_VERBS):
        paths[f"/api/world/{operation.key}"] = {"post": _verb(operation, [])}
    return {"openapi": "3.1.0", "info": {"title": "roboglot console", "version": version}, "paths": paths}


def _read(path: str, summary: str) -> dict[str, object]:
    names = [part[1:-1] for part in path.split("/") if part.startswith("{")]
    return {"summary": summary, "parameters": [NAME | {"name": name} for name in names], "responses": _answers()}


def _verb(operation: Operation[str], parameters: list[dict[str, object]]) -> dict[str, object]:
    (schema,), components = msgspec.json.schema_components([operation.parameters])
    schema = components.get(str(schema.get("$ref", "")).rpartition("/")[2], schema)
    return {
        "operationId": operation.key,
        "summary": operation.summary,
        "parameters": parameters,
        "requestBody": {"content": {"application/json": {"schema": _inlined(schema, components)}}},
        "responses": _answers(),
    }


def _inlined(schema: object, components: dict[str, object]) -> object:
    """Return the schema with its references inlined."""
    if isinstance(schema, dict):
        if "$ref" in schema:
            return _inlined(components[schema["$ref"].rpartition("/")[2]], components)
        return {key: _inlined(value, components) for key, value in schema.items()}
    return [_inlined(entry, components) for entry in schema] if isinstance(schema, list) else schema


def _answers() -> dict[str, object]:
    return {
        "200": {"description": "Done, or accepted"},
        "default": {"description": "Not done; `error` says why in plain words"},
    }
