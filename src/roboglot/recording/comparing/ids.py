"""Ids that a robot makes new in each session, such as those of actions: maps those of two recordings one to one.

An id is a UUID anywhere, or a number or a text with digits in a field whose name says id. UUIDs are unique; the others
are so among the fields of their name: action 1 is not wall 1.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

IDS_MAX = 10_000
DIGITS_MIN = 4  # of a text that is not a word
_uuid = re.compile(r"[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}", re.IGNORECASE)
_uuid_bytes = re.compile(rb"(?<![\w-])" + _uuid.pattern.encode() + rb"(?![\w-])", re.IGNORECASE)
_last = re.compile(r"([^.\[\]]+)$")
_id_key = re.compile(r"(?:.*[_a-z0-9])?(?:Id|ID)|(?:.*_)?id")  # neither "grid" nor "valid"
_in_path = re.compile(rb"(?<=/)([^/?\n]+)/([^/?\n]+)(?=[/?\n]|$)")
_in_query = re.compile(rb"(?<=[?&])(\w+)=([^&\n]+)")
_in_json = re.compile(rb'"([^"\\]+)"(\s*:\s*"?)([^"\\,}\]\s]+)(?=["\s,}])')
Id = tuple[str, str]  # the kind, "" for UUIDs, and the id
NO_ID: Id = ("", "")


def id_of(path: str, value: object) -> Id:
    """Return the id that a field at ``path`` ("$.actions[0].action_id") holds; NO_ID if it is none."""
    if isinstance(value, str) and _uuid.fullmatch(value):
        return "", value.lower()
    found = _last.search(path)
    if found is None or not _id_key.fullmatch(found[1]) or not _is_made(value):
        return NO_ID
    return found[1].lower(), str(value)


def _is_made(value: object) -> bool:
    if isinstance(value, str):
        return value.isdecimal() or sum(map(str.isdecimal, value)) >= DIGITS_MIN
    return isinstance(value, int) and not isinstance(value, bool)


class IdMap:
    """One-to-one map between the ids of two sessions, made as they are compared."""

    def __init__(self) -> None:
        self._theirs: dict[Id, Id] = {}
        self._ours: dict[Id, Id] = {}

    def agree(self, path: str, one: object, other: object) -> bool | None:
        """Return whether two values are ids of the same thing, from now on; None if they are not ids."""
        ours, theirs = id_of(path, one), id_of(path, other)
        if NO_ID in (ours, theirs) or type(one) is not type(other):
            return None
        if ours in self._theirs or theirs in self._ours:
            return self._theirs.get(ours) == theirs
        if len(self._theirs) < IDS_MAX:
            self._theirs[ours], self._ours[theirs] = theirs, ours
        return True


def with_ids(payload: bytes, ids: Mapping[Id, str], *, head: bool) -> bytes:
    """Return a request with other ids, by the old ones; with ``head`` also in the path, which comes first."""
    if not ids:
        return payload
    payload = _uuid_bytes.sub(lambda found: _other(ids, "", found[0].lower()) or found[0], payload)
    first, blank, body = payload.partition(b"\n\n") if head else (b"", b"", payload)

    def in_path(found: re.Match[bytes]) -> bytes:
        kinds = (kind for kind, id in ids if id.encode() == found[2] and _is_of(kind, found[1]))
        return b"%b/%b" % (found[1], next((_other(ids, kind, found[2]) for kind in kinds), b"") or found[2])

    def in_query(found: re.Match[bytes]) -> bytes:
        return b"%b=%b" % (found[1], _other(ids, found[1].decode().lower(), found[2]) or found[2])

    def in_json(found: re.Match[bytes]) -> bytes:
        key = found[1].decode("utf-8", "replace")
        new = _other(ids, key.lower(), found[3]) if _id_key.fullmatch(key) else b""
        return b'"%b"%b%b' % (found[1], found[2], new or found[3])

    return _in_query.sub(in_query, _in_path.sub(in_path, first)) + blank + _in_json.sub(in_json, body)


def _other(ids: Mapping[Id, str], kind: str, id: bytes) -> bytes:
    return ids.get((kind, id.decode("utf-8", "replace")), "").encode()


def _is_of(kind: str, segment: bytes) -> bool:
    """Return whether ids of this kind follow the segment of a path: ``action_id`` in ``/actions/1``."""
    return bool(kind) and segment.decode("utf-8", "replace").lower().startswith(kind.removesuffix("id").rstrip("_"))
