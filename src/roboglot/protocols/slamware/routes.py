"""Routes: operations of the contract by method and path; literal segments take precedence over ``{parameters}``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cache
from urllib.parse import unquote

from roboglot.values import dataclass
from roboglot.wire.contracts import Row, contract

PATH_MAX = 1024  # characters
# Paths outside the manual that clients use, with their operations.
ALIASES = {
    "GET /api/delivery/v1/tasks/stage": "GET /api/delivery/v1/stage",  # of 2021
    "GET /api/delivery/v1/events": "GET /api/platform/v1/events",  # of 2021
    "POST /api/multi-floor/motion/v1/gohomeaction": "POST /api/core/motion/v1/actions",
    "POST /api/multi-floor/motion/v1/movetoaction": "POST /api/core/motion/v1/actions",
}
# Operations outside the manual that clients in the field use.
BEYOND = (Row("POST /api/industry/v1/generate_landing_pose", "industry", "generateLandingPose"),)
# For these the path names the action; the body contains its options, if any.
SHORTHANDS = {
    "/api/multi-floor/motion/v1/gohomeaction": "MultiFloorBackHomeAction",
    "/api/multi-floor/motion/v1/movetoaction": "MultiFloorMoveAction",
}


@dataclass(frozen=True, slots=True)
class Template:
    """One path of the contract and its operations by method."""

    segments: tuple[str, ...]
    methods: dict[str, Row] = field(default_factory=dict)

    @property
    def parameters(self) -> int:
        """Number of segments that are parameters."""
        return sum(segment.startswith("{") for segment in self.segments)

    def match(self, segments: Sequence[str]) -> dict[str, str] | None:
        """Return the parameters' values if ``segments`` (as many as the template's) match, else None."""
        values = {}
        for wanted, found in zip(self.segments, segments, strict=True):
            if wanted.startswith("{"):
                values[wanted[1:-1]] = found
            elif wanted != found:
                return None
        return values


@dataclass(frozen=True, slots=True)
class Match:
    """Operations by method at a path, and the values of its parameters."""

    methods: Mapping[str, Row]
    values: Mapping[str, str]


class Routes:
    """All paths of the contract."""

    def __init__(self, rows: Sequence[Row]) -> None:
        templates: dict[str, Template] = {}
        for row in rows:
            method, _, path = row.key.partition(" ")
            template = templates.setdefault(path, Template(tuple(path.split("/"))))
            template.methods[method] = row
        known = {row.key: row for row in rows}
        for alias, key in ALIASES.items():
            method, _, path = alias.partition(" ")
            templates.setdefault(path, Template(tuple(path.split("/")))).methods[method] = known[key]
        self._literal = {t.segments: Match(t.methods, {}) for t in templates.values() if not t.parameters}
        self._by_length: dict[int, list[Template]] = {}
        for template in sorted(templates.values(), key=lambda t: t.parameters):
            if template.parameters:
                self._by_length.setdefault(len(template.segments), []).append(template)

    def find(self, path: str) -> Match | None:
        """Return the match of an undecoded ``path``, or None. Each segment is percent-decoded by itself.

        So ``%3A`` is equivalent to a colon, and ``%2F`` is part of its segment.
        """
        if len(path) > PATH_MAX:
            return None
        segments = tuple(path.split("/"))
        if "%" in path:
            segments = tuple(map(unquote, segments))
        if match := self._literal.get(segments):
            return match
        for template in self._by_length.get(len(segments), ()):
            if (values := template.match(segments)) is not None:
                return Match(template.methods, values)
        return None


@cache
def all_routes() -> Routes:
    """Return the routes of the contract and beyond, which all robots share."""
    return Routes((*contract("slamware"), *BEYOND))
