"""Operation tables: the signature is the schema."""

from __future__ import annotations

from typing import Annotated

import msgspec
import pytest

from roboglot.operations import BadParameters, OperationTable

Metres = Annotated[float, msgspec.Meta(ge=-5, le=5)]


def table() -> OperationTable[str]:
    commands: OperationTable[str] = OperationTable("toy")

    @commands.on("move", "go", partial="cannot fly")
    async def move(robot: str, x: Metres = 0.0, count: int = 1) -> tuple[str, float, int]:
        """Move a bit.

        More words.
        """
        return robot, x, count

    return commands


async def test_words_from_the_wire_become_types() -> None:
    operation = table().get("move")
    assert operation is not None
    assert await operation.call("r2", {"x": "1.5", "count": "3", "unknown": "!"}) == ("r2", 1.5, 3)
    assert await operation.call("r2", {}) == ("r2", 0.0, 1)
    assert (operation.summary, operation.partial, operation.names) == ("Move a bit.", "cannot fly", ("x", "count"))


def test_exact_table_guesses_at_unknown_parameters() -> None:
    commands: OperationTable[str] = OperationTable("exact", exact=True)

    @commands.on("move")
    async def move(_: str, *, degrees: float = 0.0) -> float:
        return degrees

    assert commands["move"].parse({"degrees": "3"}) == {"degrees": 3.0}
    with pytest.raises(BadParameters, match=r"^degree is unknown; did you mean 'degrees'\?$"):
        commands["move"].parse({"degree": 3})


@pytest.mark.parametrize(
    ("given", "count"), [("000", 0), ("0", 0), ("007", 7), ("-03", -3), ("010", 10), ("00", 0), ("0x1", None)]
)
async def test_zeros_before_numbers_are_no_mistake(given: str, count: int | None) -> None:
    commands: OperationTable[str] = OperationTable("zeros")

    @commands.on("take")
    async def take(_: str, name: str, *, count: int | None = None) -> tuple[str, int | None]:
        return name, count

    operation = commands["take"]
    if count is None:
        with pytest.raises(BadParameters, match="count must be"):
            operation.parse({"name": "007", "count": given})
    else:
        assert await operation.call("r2", {"name": "007", "count": given}) == ("007", count), "an id stays as it is"


@pytest.mark.parametrize("values", [{"x": "5.01"}, {"x": "fast"}, {"count": "1.5"}, {"count": None}])
def test_misfits_name_the_parameter(values: dict[str, object]) -> None:
    operation = table().get("go")
    assert operation is not None
    with pytest.raises(BadParameters, match=rf"^{next(iter(values))} must be "):
        operation.parse(values)


def test_a_name_declared_twice_fails_at_once() -> None:
    commands = table()
    with pytest.raises(ValueError, match="'go' is declared twice"):

        @commands.on("go")
        async def again(robot: str) -> None: ...


def test_untyped_parameters_fail_at_once() -> None:
    with pytest.raises(TypeError, match="speed has no type"):

        @table().on("fly")
        async def fly(robot: str, speed) -> None: ...
