"""Finds a world: a shipped one by name, one's own TOML file, or any ROS map (yaml + pgm), imported."""

from __future__ import annotations

from pathlib import Path

from roboglot.simulation.checks import completed
from roboglot.simulation.declarations import BadFile, read_toml
from roboglot.simulation.description import WorldDescription

WORLDS = Path(__file__).parent / "worlds"


def load_world(name_or_path: str | Path) -> WorldDescription:
    """The world. Raises BadFile (a ValueError) that says what is wrong and where."""
    name = str(name_or_path)
    path = Path(name)
    if path.suffix == ".toml":
        return completed(read_toml(path, WorldDescription), name)
    known = sorted(file.stem for file in WORLDS.glob("*.toml"))
    if name in known:
        return completed(read_toml(WORLDS / f"{name}.toml", WorldDescription), name)
    raise BadFile(
        f"no world is named {name!r}; there are: {', '.join(known)}; or give the path of a .toml or .yaml file"
    )
