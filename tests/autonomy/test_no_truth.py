"""Estimates know sensors alone: from the autonomy package no import, however indirect, leads to the world."""

from __future__ import annotations

import ast
import functools
import subprocess
import sys
from pathlib import Path

import pytest

import roboglot

ROOT = Path(roboglot.__file__).parent
WORLD = ("roboglot.simulation", "roboglot.fleet", "roboglot.testing", "mujoco")


def imported_by(source: str) -> set[str]:
    """Return the modules that ``source`` names in imports, wherever they stand; ``importlib`` counts as the world's."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Name) and node.id in ("__import__", "importlib"):
            names.add(WORLD[0])
    return names


@functools.cache
def imported_in(file: Path) -> set[str]:
    return imported_by(file.read_text(encoding="utf-8"))


def file_of(module: str) -> Path | None:
    path = ROOT.joinpath(*module.split(".")[1:])
    candidates = (path.with_suffix(".py"), path / "__init__.py")
    return next((file for file in candidates if module.startswith("roboglot") and file.is_file()), None)


def way_to_the_world(*sources: str) -> str | None:
    """Return the first module of the world that is met from ``sources`` by imports of imports."""
    waiting, known = set().union(*map(imported_by, sources)), set[str]()
    while waiting:
        module = waiting.pop()
        if module.startswith(WORLD):
            return module
        known.add(module)
        if (file := file_of(module)) is not None and file != ROOT / "__init__.py":
            waiting |= imported_in(file) - known
    return None


def test_no_import_leads_to_the_world() -> None:
    sources = [file.read_text(encoding="utf-8") for file in (ROOT / "autonomy").rglob("*.py")]
    assert len(sources) > 40
    assert way_to_the_world(*sources) is None


@pytest.mark.parametrize(
    "source",
    [
        "import roboglot.simulation.world.world",
        "from roboglot.fleet import build_fleet",
        "def sly():\n    from roboglot import simulation",
        "def sly():\n    return __import__('roboglot.simulation')",
        "from roboglot.drivers import urls\nimport mujoco",
    ],
)
def test_such_an_import_would_be_found(source: str) -> None:
    assert way_to_the_world(source)


def test_nothing_private_of_a_component_is_touched() -> None:
    """The simulated parts know the truth: autonomy may read only what their interfaces provide."""
    for file in (ROOT / "autonomy").rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute) and node.attr.startswith("_") and not node.attr.startswith("__"):
                owner = node.value
                assert isinstance(owner, ast.Name), f"{file.name}:{node.lineno}"
                assert owner.id in ("self", "cls") or owner.id[0].isupper(), f"{file.name}:{node.lineno}"


def test_it_runs_where_there_is_no_world() -> None:
    code = (
        "import sys; sys.modules['mujoco'] = sys.modules['roboglot.simulation'] = None; import roboglot.autonomy.skills"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=180, env={"PYTHONPATH": str(ROOT.parent)})
