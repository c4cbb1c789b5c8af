"""Reads body files: without its section, a part is missing from the robot."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from msgspec import Struct, defstruct

from roboglot.simulation.bodies.body import Body, HullSection
from roboglot.simulation.bodies.part import parts
from roboglot.simulation.bodies.realism import PRESETS, USUAL, with_realism
from roboglot.simulation.world.declarations import BadFile, read_toml
from roboglot.spelling import instead
from roboglot.text_files import tables_in

BODIES = Path(__file__).parent


def load_body(name: str) -> Body:
    """Return a shipped body by its name, or a user's by the path of its TOML file; the suffix ``+hard`` or ``+clean``
    sets the realism of its sensors. Raises BadFile.
    """
    path, (name, preset) = body_source(name), split_realism(name)
    if not name.endswith(".toml") and name not in (known := [file.stem for file in tables_in(BODIES)]):
        raise BadFile(f"no body is named {name!r}, and it is not a .toml file{instead(name, known)}")
    content: Any = read_toml(path, _file_type())
    sections = {part.name: getattr(content, part.name) for part in parts() if part.section is not None}
    for part in parts():
        for needed in part.needs if sections.get(part.name) else ():
            if not sections[needed]:
                raise BadFile(f"{path}: [{part.name}] works with a [{needed}], which is missing")
    if preset not in PRESETS:
        raise BadFile(f"{name}+{preset}: no preset is named {preset!r}; there are: {', '.join(PRESETS)}")
    given = with_realism({type(section): section for section in sections.values() if section is not None}, preset)
    return Body(content.maker, content.model, content.hardware_version, content.hull, given)


def body_source(name: str) -> Path:
    """Return the file of a body by its name or path; it may not exist."""
    name, _ = split_realism(name)
    return Path(name) if name.endswith(".toml") else BODIES / f"{name}.toml"


def split_realism(name: str) -> tuple[str, str]:
    """Return name or path of a body, and its preset."""
    body, plus, preset = name.rpartition("+")
    return (body, preset) if plus and preset.isalpha() else (name, USUAL)


@cache
def _file_type() -> type[Struct]:
    """Return the type of a whole file: name plate, hull, and the sections of all parts."""
    plate: list[tuple[str, object]] = [("maker", str), ("model", str), ("hardware_version", str), ("hull", HullSection)]
    sections = [(part.name, part.section) for part in parts() if part.section is not None]
    plate += [(name, section) for name, section in sections if name == "base"]
    optional: list[tuple[str, object, None]] = [
        (name, section | None, None) for name, section in sections if name != "base"
    ]
    return defstruct("BodyFile", [*plate, *optional], frozen=True, forbid_unknown_fields=True)
