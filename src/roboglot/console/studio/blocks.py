"""Describes every function of robot programs for an editor: names, types, ranges, choices, in two languages.

Made from the functions' declarations, so that an editor has a block for each function without handwritten ones.
"""

from __future__ import annotations

import hashlib
import inspect
import re
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import msgspec

from roboglot.console.studio.ranges import choices_of, limit_of
from roboglot.operations import Operation
from roboglot.programs.functions.enums import ENUMS
from roboglot.programs.functions.prelude import ability_set
from roboglot.programs.functions.records import RECORDS
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.language.names import BUILTINS, MODULES
from roboglot.text_files import content_of
from roboglot.values import dataclass

LABELS = Path(__file__).with_name("labels.toml")
DANCE = "dance"  # the group of the choreographer and the dancer


@dataclass(frozen=True, slots=True)
class Described:
    """The description as JSON, and a tag that changes with it."""

    body: bytes
    tag: str


@cache
def described() -> Described:
    """Return the description of all blocks, made once."""
    body = msgspec.json.encode(table())
    return Described(body, f'"{hashlib.sha256(body).hexdigest()[:24]}"')


def table() -> dict[str, Any]:
    """Return groups, functions in the manual's order of groups, enumerations, and completions for a text editor.

    Within a group come those first that beginners need, and those last that few programs need.
    """
    labels = _labels()
    functions = [_function(operation, labels) for operation in ABILITIES]
    parameters = [parameter for function in functions for parameter in function["parameters"]]
    shown = {*ENUMS["StateCode"], *(name for parameter in parameters for name in parameter.get("choices", ()))}
    order, first, last = list(labels["groups"]), labels["first"], labels["last"]
    functions.sort(key=lambda function: (order.index(function["group"]), _rank(function["key"], first, last)))
    return {
        "groups": [{"id": id, **group} for id, group in labels["groups"].items()],
        "functions": functions,
        "members": {name: _member(name, labels["members"]) for name in sorted(shown)},
        "enums": {name: dict(members) for name, members in ENUMS.items()},
        "records": {name: list(kind.fields) for name, kind in RECORDS.items()},
        "builtins": sorted(BUILTINS),
        "modules": sorted(MODULES),
    }


def _rank(key: str, first: list[str], last: list[str]) -> int:
    """Return a function's rank within its group: below 0 for the first, above for the last, else 0."""
    path, name = key.removeprefix("cyberdog."), key.rpartition(".")[2]
    if path in first:
        return first.index(path) - len(first)
    return 1 + last.index(name) if name in last else 0


@cache
def _labels() -> dict[str, Any]:
    return tomllib.loads(content_of(LABELS).decode())


def label_of(key: str) -> dict[str, str]:
    """Return the label of a function's block, the first with this key's ending; else the key's own words."""
    name = key.rpartition(".")[2].replace("_", " ")
    chinese = next((words for known, words in _labels()["chinese"].items() if known.endswith(f".{key}")), name)
    return {"en": name, "zh": chinese}


def _function(operation: Operation[str], labels: dict[str, Any]) -> dict[str, Any]:
    key = operation.key
    name = key.rpartition(".")[2]
    parameters = list(inspect.signature(operation.handler).parameters.values())[1:]
    return {
        "key": key,
        "group": _group(key),
        "en": labels["english"].get(key) or name.replace("_", " "),
        "zh": labels["chinese"][key],
        "about": {
            "en": operation.summary.replace("``", ""),
            "zh": _about(operation, labels),
        },
        "attribute": key in ability_set().attributes,
        "answers": operation.answer != "None" and operation.answer is not None,
        "parameters": [_parameter(key, parameter, labels) for parameter in parameters],
    }


def _about(operation: Operation[str], labels: Mapping[str, Mapping[str, str]]) -> str:
    about, key = labels["about"], operation.key
    general = "perform" if operation.summary.startswith("Perform the motion") else key.rpartition(".")[2]
    return about.get(key) or about[general].format(name=labels["chinese"][key])


def _member(name: str, words: dict[str, dict[str, str]]) -> dict[str, str]:
    """Return the label of a drop-down's entry: a colour and an effect, or a plain name."""
    found = re.sub("^(system_)?effect_(line_)?", "", name)
    colour, _, effect = found.partition("_")
    if found in words:
        return words[found]
    return {language: words[colour][language] + words[effect][language] for language in ("en", "zh")}


def _group(key: str) -> str:
    root, _, rest = key.partition(".")
    if root != "cyberdog":
        return DANCE
    group, dot, _ = rest.partition(".")
    return group if dot else root


def _parameter(key: str, parameter: inspect.Parameter, labels: dict[str, Any]) -> dict[str, Any]:
    words = labels["parameters"][parameter.name]
    kind, name = _kind(str(parameter.annotation)), key.rpartition(".")[2]
    described: dict[str, object] = {"name": parameter.name, "kind": kind, **words}
    path = f"{key.removeprefix('cyberdog.')}.{parameter.name}"
    if (start := labels["start"].get(path)) is not None:
        described["start"] = start
    if (unit := labels["units"].get(path)) is not None:
        described["unit"] = unit
    default = None if parameter.default is inspect.Parameter.empty else parameter.default
    if (choices := choices_of(name, parameter.name)) is not None:
        enum, members = choices
        return described | {"kind": "choice", "enum": enum, "choices": members, "default": _chosen(choices, default)}
    if kind in ("float", "int") and (limit := limit_of(name, parameter.name)) is not None:
        described |= {"minimum": limit.minimum, "maximum": limit.maximum}
        default = limit.start if default is None else default
    return described | {"default": default}


def _kind(annotation: str) -> str:
    return "list" if annotation.startswith("list") else annotation.lower()


def _chosen(choices: tuple[str, tuple[str, ...]], default: object) -> str:
    enum, members = choices
    numbers = ENUMS.get(enum, {})
    return next((member for member in members if default in (numbers.get(member), member, _whole(member))), members[0])


def _whole(text: str) -> int | None:
    return int(text) if text.isdecimal() else None
