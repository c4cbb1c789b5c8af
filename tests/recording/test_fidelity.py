"""The page about fidelity says what this version's doors answer."""

from __future__ import annotations

from pathlib import Path

import pytest

from roboglot.cli.recordings.fidelity import BODY, SessionRequest, _facts, page, published
from roboglot.testing.addresses import free_addresses

PAGE = Path(__file__).parents[2] / "docs" / "fidelity.md"


@pytest.mark.slow
async def test_the_page_is_up_to_date() -> None:
    shown = await page(free_addresses(len(set(BODY.values()))))
    assert PAGE.read_text(encoding="utf-8") == shown, "run: roboglot fidelity --write"


def test_every_published_answer_says_something() -> None:
    for session in published():
        assert session.source
        assert all(a.status or a.pattern or a.fields or a.silent for a in session.asked)


def test_facts_that_do_not_hold_are_named() -> None:
    answers = [(b'{"a": {"b": 1}, "c": "x"}', "200")]
    asked = SessionRequest(
        "GET /", status="404", pattern="no", fields={"$.a": "object", "$.a.b": "string", "$.d": "number"}
    )
    found = _facts(asked, answers)
    assert [good for good, _ in found] == [False, False, True, False, False]
    assert _facts(asked, []) == [(False, "no answer")]
    assert _facts(SessionRequest("x", silent=True), answers) == [(False, "1 answers")]
