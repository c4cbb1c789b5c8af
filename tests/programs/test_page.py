"""The shared memory as a hostile worker would fill it."""

from __future__ import annotations

import mmap
import os
import time
from collections.abc import Iterator

import pytest

from roboglot.programs.engine.engine import _shared_memory
from roboglot.programs.engine.shared_page import SEARCHED_MAX, Page
from roboglot.programs.language.places import WORD, Places

LINES = 200_000


@pytest.fixture
def pair() -> Iterator[tuple[Page, mmap.mmap]]:
    """The server's end, and the worker's."""
    places = Places(["pass\n" * LINES])
    descriptor = _shared_memory(places.memory())
    page, worker = Page(descriptor, places), mmap.mmap(descriptor, places.memory())
    os.close(descriptor)
    yield page, worker
    worker.close()
    page.close()


def test_a_place_is_where_the_word_is(pair: tuple[Page, mmap.mmap]) -> None:
    page, worker = pair
    assert page.place == (0, 0)
    worker[:WORD] = b"\x07" * WORD
    assert page.place == (0, 0)
    worker[WORD * 4321 : WORD * 4322] = b"\x07" * WORD
    assert page.place == (0, 4319)
    page.close()
    assert page.place == (0, 4319)


def test_place_that_was_known_is_looked_at_again(pair: tuple[Page, mmap.mmap]) -> None:
    page, worker = pair
    worker[:WORD] = b"\x07" * WORD
    for number in (5, 3, 9):
        worker[WORD * (1 + number) : WORD * (2 + number)] = b"\x07" * WORD
        assert page.place == (0, number - 1)
        worker[WORD * (1 + number) : WORD * (2 + number)] = bytes(WORD)
    assert page.place == (0, 0)


@pytest.mark.parametrize(
    ("word", "filling"), [(b"AB" * 4, b"BA" * 4), (b"\1" * 8, b"\1" * 7 + b"\2"), (b"\0" * 7 + b"\1", b"\0" * 8)]
)
def test_no_filling_keeps_the_server(pair: tuple[Page, mmap.mmap], word: bytes, filling: bytes) -> None:
    """A search by bytes instead of words would take half a second."""
    page, worker = pair
    worker[:WORD] = word
    worker[WORD : WORD * (LINES + 1)] = filling * LINES
    began = time.process_time()
    for _ in range(10):
        assert page.place == (0, 0)
    assert time.process_time() - began < 0.2


def test_only_so_many_places_are_looked_through() -> None:
    places = Places(["\n" * (SEARCHED_MAX + 100)])
    descriptor = _shared_memory(places.memory())
    page, worker = Page(descriptor, places), mmap.mmap(descriptor, places.memory())
    os.close(descriptor)
    worker[:WORD] = b"\x07" * WORD
    worker[WORD * (SEARCHED_MAX + 50) : WORD * (SEARCHED_MAX + 51)] = b"\x07" * WORD
    assert page.place == (0, 0)
    worker.close()
    page.close()
