"""Messages fit the standard's JSON schemas: 2.1's as the vda5050-sdk carries them, ours of 3.0.

`schemas/` holds the messages of 3.0, written from the standard's tables: names, required fields, types, words.
"""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings

from tests.protocols.vda5050.conftest import Opened
from tests.protocols.vda5050.orders import action, encoded, instant, order, valid_orders

FOLDER = Path(__file__).with_name("schemas")


@functools.cache
def validators() -> tuple[Any, dict[str, Any]]:
    """Return those of 2.1 and 3.0, made at their use: other workers of the suite only collect this file."""
    import jsonschema
    from vda5050.validation import SchemaValidator

    checker = jsonschema.FormatChecker()
    schemas = {file.stem: json.loads(file.read_text()) for file in FOLDER.glob("*.json")}
    ours = {name: jsonschema.Draft202012Validator(schema, format_checker=checker) for name, schema in schemas.items()}
    return SchemaValidator(), ours


def complaints(version: str, name: str, message: dict[str, Any]) -> list[str]:
    """Return the schema's complaints about a message."""
    official, ours = validators()
    if version == "2.1":
        found: list[str] = official.errors(name, message)
        return found
    return [f"{error.json_path}: {error.message}" for error in ours[name].iter_errors(message)]


@pytest.mark.parametrize(
    ("version", "number"), [pytest.param("2.1", "2.1.0", marks=pytest.mark.slow), ("3.0", "3.0.0")]
)
async def test_all_that_a_robot_says_fits_the_schemas(yard: Opened, version: str, number: str) -> None:
    one = await yard(version)
    made = order("one", [(0, 0), (0.6, 0), (1.2, 0)], released=2, version=number)
    made["nodes"][0]["actions"] = [action("detectObject", "look", objectType="tag")]
    one.control.send("order", made)
    one.control.send("instantActions", instant(action("nonsense", "n"), action("stateRequest", "s"), version=number))
    one.control.send("order", b"{}")
    await one.until(lambda: one.control.state["lastNodeId"] == "n1" and not one.control.state["driving"])
    await one.close()
    await one.until(lambda: one.control.heard["connection"][-1]["connectionState"] == "OFFLINE", 0)
    assert {"state", "visualization", "connection", "factsheet"} <= one.control.heard.keys()
    assert any(state["errors"] for state in one.control.heard["state"])
    for name in ("state", "visualization", "connection", "factsheet"):
        for message in one.control.heard[name]:
            assert complaints(version, name, message) == []
    assert complaints(version, "state", one.control.state | {"driving": "no"})  # they are able to refuse


@settings(max_examples=50)
@given(valid_orders())
def test_the_orders_of_the_other_tests_are_valid(made: dict[str, Any]) -> None:
    made = json.loads(encoded(made))
    assert complaints("3.0", "order", made) == []
    for node in made["nodes"]:
        if isinstance(node["nodePosition"].get("allowedDeviationXY"), dict):
            del node["nodePosition"]["allowedDeviationXY"]  # ellipses are new in 3.0
    assert complaints("2.1", "order", made) == []
