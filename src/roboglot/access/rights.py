"""Rights as people write them, and what each brings along."""

from __future__ import annotations

from collections.abc import Iterable

from roboglot.operations import Right

ALL_ROBOTS = "*"
# Driving includes seeing; programs may drive; administrators may do everything.
BRINGS = {
    Right.SEE: frozenset({Right.SEE}),
    Right.DRIVE: frozenset({Right.SEE, Right.DRIVE}),
    Right.PROGRAM: frozenset({Right.SEE, Right.DRIVE, Right.PROGRAM}),
    Right.EDIT: frozenset({Right.SEE, Right.EDIT}),
    Right.ADMIN: frozenset(Right),
}
EVERYTHING = BRINGS[Right.ADMIN]
NOTHING: frozenset[Right] = frozenset()


def whole(rights: Iterable[Right]) -> frozenset[Right]:
    """The rights with all that they bring along."""
    return frozenset().union(*(BRINGS[right] for right in rights))


def parse_rights(text: str) -> frozenset[Right]:
    """ "drive,edit". Raises ValueError."""
    try:
        return frozenset(Right(word.strip().lower()) for word in text.split(","))
    except ValueError:
        raise ValueError(f"rights are {', '.join(Right)}, with commas between, not {text!r}") from None


def write_rights(rights: Iterable[Right]) -> str:
    """Return the rights as ``parse_rights`` reads them, in their own order."""
    chosen = set(rights)
    return ",".join(right for right in Right if right in chosen)
