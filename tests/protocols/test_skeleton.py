"""Every vendor's door has the same skeleton: who knows one package finds the way in the others."""

from __future__ import annotations

import importlib
import inspect
from pathlib import Path
from types import ModuleType

import pytest

import roboglot.protocols
from roboglot.operations import OperationTable
from roboglot.protocols import DOORS
from roboglot.protocols.door import DoorType

FILES = ("server", "context", "table", "dispatch", "errors", "vocabulary", "config")
DOOR = pytest.mark.parametrize("door", DOORS, ids=lambda door: door.name)


def module(door: DoorType, name: str) -> ModuleType:
    """Return one module of a door's package."""
    return importlib.import_module(f"roboglot.protocols.{door.name}.{name}")


@DOOR
def test_files_have_the_same_names(door: DoorType) -> None:
    folder = Path(roboglot.protocols.__file__).parent / door.name
    assert [name for name in FILES if not (folder / f"{name}.py").is_file()] == []
    assert (folder / "chapters" / "__init__.py").is_file()


@DOOR
def test_things_have_the_same_names(door: DoorType) -> None:
    module(door, "dispatch")  # imports the chapters, which fill the table
    table = module(door, "table")
    assert isinstance(table.TABLE, OperationTable)
    assert len(table.TABLE) > 0
    assert table.implemented()
    assert isinstance(table.partly(), dict)
    assert inspect.isclass(module(door, "context").Context)


@DOOR
def test_handlers_live_in_chapters_and_get_the_context(door: DoorType) -> None:
    module(door, "dispatch")
    chapters = f"roboglot.protocols.{door.name}.chapters."
    for operation in module(door, "table").TABLE:
        handler = inspect.unwrap(operation.handler)
        assert handler.__module__.startswith(chapters), operation.key
