"""Rights as text, and the rights that each includes."""

from __future__ import annotations

from collections.abc import Iterable

from roboglot.operations import Right

ALL_ROBOTS = "*"
# Driving includes seeing; programs may drive; administrators may do everything.
IMPLIED = {
    Right.SEE: frozenset({Right.SEE}),
    Right.DRIVE: frozenset({Right.SEE, Right.DRIVE}),
    Right.PROGRAM: frozenset({Right.SEE, Right.DRIVE, Right.PROGRAM}),
    Right.EDIT: frozenset({Right.SEE, Right.EDIT}),
    Right.ADMIN: frozenset(Right),
}
EVERYTHING = IMPLIED[Right.ADMIN]
NOTHING: frozenset[Right] = frozenset()


def effective(rights: Iterable[Right]) -> frozenset[Right]:
    """Return these rights and all that they imply."""
    return frozenset().union(*(IMPLIED[right] for right in rights))


def parse_rights(text: str) -> frozenset[Right]:
    """Return the rights of a text such as "drive,edit". Raises ValueError."""
    try:
        return frozenset(Right(word.strip().lower()) for word in text.split(","))
    except ValueError:
        raise ValueError(f"rights are {', '.join(Right)}, separated by commas, not {text!r}") from None


def write_rights(rights: Iterable[Right]) -> str:
    """Return the rights as a text for ``parse_rights``, in the order of ``Right``."""
    chosen = set(rights)
    return ",".join(right for right in Right if right in chosen)
