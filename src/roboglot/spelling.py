"""Finds the known name that a mistyped one stands for; bounds quoted text. Knows no command, key or robot."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import SequenceMatcher

WORD_MAX = 64  # characters that are compared
LIKE = 0.75  # share of common letters: one wrong letter in four
STEM_MIN = 3  # letters of an abbreviation


def brief(text: str, most: int) -> str:
    """Return the first ``most`` characters of a text, and then its length if it is longer."""
    return text if len(text) <= most else f"{text[:most]} … ({len(text)} characters)"


def nearest(word: str, known: Iterable[str]) -> str:
    """Return the name that ``word`` is a misspelling or an abbreviation of; empty if there is none.

    Names are compared part by part (``cyberdog.motion.turn``, ``--max-speed``), as a common beginning says nothing
    about the rest. Names with different numbers (``dog1``, ``dog2``) are different names.
    """
    rated = [(_likeness(word[:WORD_MAX].casefold(), name.casefold()), name) for name in sorted(set(known))]
    best = max((likeness for likeness, _ in rated), default=0.0)
    return next((name for likeness, name in rated if likeness == best), "") if best else ""


def meant(word: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"``; empty if no known name is near."""
    near = nearest(word, known)
    return f"; did you mean {near!r}?" if near else ""


def instead(word: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"``, or all known names if none is near."""
    names = list(known)
    return meant(word, names) or f"; there are {', '.join(names)}"


def _likeness(word: str, name: str) -> float:
    parts, others = _parts(word), _parts(name)
    if len(parts) == len(others):
        each = [_alike(part, other) for part, other in zip(parts, others, strict=True)]
        return sum(each) / len(each) if each and all(each) else 0.0
    return _alike("".join(parts), "".join(others))  # a missing or needless mark between parts


def _parts(word: str) -> list[str]:
    return [part for part in re.split(r"[\W_]+", word) if part]


def _alike(word: str, name: str) -> float:
    """Return the share of common letters if it is enough, else 0."""
    numbers, others = re.findall(r"\d+", word), re.findall(r"\d+", name)
    if word == name:
        return 1.0
    if numbers and others and numbers != others:
        return 0.0
    ratio = SequenceMatcher(None, word, name).ratio()
    if ratio >= LIKE:
        return ratio
    swapped = len(word) > 1 and sorted(word) == sorted(name)
    return LIKE if swapped or (len(word) >= STEM_MIN and name.startswith(word)) else 0.0
