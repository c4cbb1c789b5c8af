"""Requests of a page to its class."""

from __future__ import annotations

import unicodedata
from typing import Annotated, Literal

import msgspec

NAME_MAX, WORDS_MAX, STYLE_MAX = 40, 300, 400_000  # characters
Words = Annotated[str, msgspec.Meta(max_length=WORDS_MAX)]


def plain_name(name: str) -> str:
    """Return a name without blanks around it and without format characters: joiners of emoji, marks of direction."""
    return "".join(letter for letter in name if unicodedata.category(letter) != "Cf").strip()


class PupilState(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """State of a pupil's page."""

    phase: Words = "idle"
    lit: Words = ""
    program: Words = ""
    error: Words = ""
    mission: Words = ""
    stars: Annotated[int, msgspec.Meta(ge=0, le=1000)] = 0


class Member(msgspec.Struct, tag="class", tag_field="type", forbid_unknown_fields=True):
    """Request of a page to its class."""

    do: Literal["open", "join", "leave", "doing", "hand_in", "stop_all", "look", "close"]
    id: int = 0
    code: Annotated[str, msgspec.Meta(max_length=12)] = ""
    name: Annotated[str, msgspec.Meta(max_length=NAME_MAX)] = ""
    doing: PupilState = PupilState()
    style: Annotated[str, msgspec.Meta(max_length=STYLE_MAX)] = ""
    carry: bool = False  # a page that comes from another world brings the program seen last
