"""Comparing sessions: what was changed is found, and nothing is found where nothing was changed."""

from __future__ import annotations

import random
import xml.etree.ElementTree as ET

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.tap import Direction, Exchange
from roboglot.recording.comparing import reports
from roboglot.recording.comparing.comparison import Comparison, Row, compare
from roboglot.recording.comparing.masks import STRICT, ComparisonMode, Mask, Rule
from roboglot.recording.matching import normal, rewritten
from roboglot.recording.reader import pair

MUTATIONS, FOUND_MIN, ROUNDS = 500, 0.95, 7


def session() -> list[Exchange]:
    """Return a session of three protocols: polls, commands, pushes."""
    found: list[Exchange] = []

    def ask(at: float, door: str, operation: str, request: str, reply: str, status: str, after: float) -> None:
        rest = (door, f"127.0.0.1:{len(door)}", door)
        found.append(Exchange(at, "a", *rest, Direction.REQUEST, operation, request.encode()))
        found.append(Exchange(at + after, "a", *rest, Direction.REPLY, operation, reply.encode(), status, "", after))

    for n in range(ROUNDS):
        pose = f'{{"x": {n * 0.5:.2f}, "y": 1.5, "yaw": 0.25}}'
        key = "GET /api/core/slam/v1/localization/pose"
        ask(3.0 * n, "slamware", key, f"{key}\n\n", pose, "200", 0.01)
        ask(3.0 * n + 0.5, "robomaster", "chassis position", "chassis position ?", f"{n * 0.5} 1.0 90.0;", "ok", 0.02)
        ask(3.0 * n + 0.7, "robomaster", "chassis move", f"chassis move x {n};", "ok;", "ok", 2.0)
        ask(3.0 * n + 1.0, "cyberdog", "2002", f'{{"cmd": "go", "n": {n}}}', '{"state": "done"}', "ok", 0.1)
        push = f"chassis push attitude {n} 0.5 1;".encode()
        found.append(Exchange(3.0 * n + 1.5, "a", "robomaster", "x", "", Direction.PUSH, "> chassis push", push))
    return sorted(found, key=lambda exchange: exchange.stamp)


def _alter_reply(chance: random.Random, exchanges: list[Exchange]) -> None:
    where = chance.choice([n for n, e in enumerate(exchanges) if e.direction is Direction.REPLY])
    old = exchanges[where]
    match chance.randrange(4):
        case 0:
            exchanges[where] = old._replace(status="500" if old.door == "slamware" else "fail")
        case 1:
            exchanges[where] = old._replace(payload=b'{"other": true}')
        case 2:
            del exchanges[where]
        case _:
            exchanges[where] = old._replace(payload=_one_more(chance, old.payload))


def _one_more(chance: random.Random, payload: bytes) -> bytes:
    """Another value somewhere: a number far off, another word, a field gone."""
    if payload[:1] == b"{":
        value = msgspec.json.decode(payload)
        key = chance.choice(sorted(value))
        if chance.random() < 0.3:
            del value[key]
        else:
            value[key] = value[key] * 1.5 + 1.0 if isinstance(value[key], float) else "something else"
        return msgspec.json.encode(value)
    words = payload.rstrip(b";").split()
    place = chance.randrange(len(words))
    words[place] = b"-77.5" if words[place] != b"-77.5" else b"0"
    return b" ".join(words) + b";"


def _alter_push(chance: random.Random, exchanges: list[Exchange]) -> None:
    where = chance.choice([n for n, e in enumerate(exchanges) if e.direction is Direction.PUSH])
    old = exchanges.pop(where)
    match chance.randrange(3):
        case 0:
            return
        case 1:
            exchanges.append(old._replace(stamp=old.stamp + chance.uniform(0.8, 2.0)))
        case _:
            exchanges.append(old._replace(payload=_one_more(chance, old.payload)))
    exchanges.sort(key=lambda exchange: exchange.stamp)


@pytest.mark.slow
def test_95_of_100_random_mutations_are_found() -> None:
    original, found = session(), 0
    for seed in range(MUTATIONS):
        chance, mutant = random.Random(seed), list(original)
        (_alter_reply if chance.random() < 0.7 else _alter_push)(chance, mutant)
        found += compare(original, mutant).differs
    assert found >= MUTATIONS * FOUND_MIN


def test_session_agrees_with_itself_to_the_last_bit() -> None:
    comparison = compare(session(), session(), STRICT)
    assert comparison.fidelity == 1.0
    assert not comparison.differs
    assert sum(row.checks for row in comparison.rows) > 100
    assert "fidelity: 100 %" in reports.table(comparison)


def test_requests_of_one_session_only_count_against() -> None:
    original = session()
    comparison = compare(original, [e for e in original if e.operation != "chassis move"])
    (row,) = [row for row in comparison.rows if row.operation == "chassis move"]
    assert (row.ones, row.others, row.agreed) == (ROUNDS, 0, 0)
    assert comparison.fidelity < 1.0


def test_a_mask_says_what_counts() -> None:
    original = session()
    changed = [e._replace(payload=e.payload.replace(b'"x": ', b'"x": 9')) for e in original]
    assert compare(original, changed).differs
    for how in (ComparisonMode.SHAPE, ComparisonMode.IGNORED):
        assert not compare(original, changed, Mask((Rule(how, "GET *", "$.x"),))).differs
    gone = [e._replace(payload=e.payload.replace(b', "y": 1.5', b"")) for e in original]
    assert compare(original, gone, Mask((Rule(ComparisonMode.SHAPE, "GET *", "$.y"),))).differs
    assert not compare(original, gone, Mask((Rule(ComparisonMode.IGNORED, "GET *", "$.y"),))).differs


def test_redacted_values_are_not_compared() -> None:
    asked = Exchange(0.0, "a", "slamware", "x:1", "x", Direction.REQUEST, "GET /wifi", b"GET /wifi\n\n")
    reply = asked._replace(direction=Direction.REPLY, payload=b'{"ssid": "[redacted]", "up": true}', status="200")
    live = reply._replace(payload=b'{"ssid": "roboglot", "up": true}')
    for one, other in ((reply, live), (live, reply), (reply, reply)):
        assert not compare([asked, one], [asked, other]).differs
    assert compare([asked, reply], [asked, live._replace(payload=b'{"up": true}')]).differs
    assert compare([asked, reply], [asked, live._replace(payload=b'{"ssid": "roboglot", "up": false}')]).differs


def test_reports_name_what_differs() -> None:
    original = session()
    changed = [e._replace(status="fail") if e.status == "ok" and e.door == "cyberdog" else e for e in original]
    comparison = compare(original, changed)
    assert "status: ok | fail" in reports.table(comparison)
    assert "<code>fail</code>" in reports.page(comparison, ("<one>", "two"))
    assert "&lt;one&gt;" in reports.page(comparison, ("<one>", "two"))
    suites = ET.fromstring(reports.junit(comparison))
    failed = [case.get("name") for case in suites.iter("testcase") if case.find("failure") is not None]
    assert failed == ["2002"]


def test_values_are_named_as_messages_have_them() -> None:
    row = Row("slamware", "GET /")
    row.check(False, "$.isCharging", True, None)
    assert reports.table(Comparison([row])).splitlines()[1].strip() == "$.isCharging: true | null"


UUIDS = st.uuids().map(str)


@given(UUIDS, UUIDS, st.integers(0, 10**6))
def test_requests_are_recognised_although_their_ids_differ(one: str, other: str, number: int) -> None:
    def request(id: str) -> bytes:
        return f'POST /tasks\n\n{{"task_id": "{id}", "n": {number}}}'.encode()

    first, second = normal("slamware", request(one)), normal("slamware", request(other))
    assert first.text == second.text
    answer = f'{{"accepted": "{one}"}}'.encode()
    assert rewritten(answer, first.fresh, second.fresh) == f'{{"accepted": "{other}"}}'.encode()


def test_ids_of_two_protocols_are_made_by_clients() -> None:
    first, second = (normal("robomaster", f"chassis move x 1 seq {n};".encode()) for n in (7, 12))
    assert first.text == second.text
    assert rewritten(b"ok seq 7;", first.fresh, second.fresh) == b"ok seq 12;"
    assert normal("robomaster", b"led r 7;").fresh == ()
    frames = [normal("visual", b'{"type":"task","id":"%s","target_id":["t"]}' % n) for n in (b"a1", b"b2")]
    assert frames[0].text == frames[1].text
    assert rewritten(b'{"feedback":{"id":"a1"}}', frames[0].fresh, frames[1].fresh) == b'{"feedback":{"id":"b2"}}'


@pytest.mark.parametrize("door", ["cyberdog", "driver/cyberdog"])
def test_a_dogs_several_answers_stay_with_their_request(door: str) -> None:
    """Two requests of one operation; the newer one is answered twice, and the older one never."""
    rest = ("a", door, "127.0.0.1:5", "x")
    asked = [Exchange(at, *rest, Direction.REQUEST, "1004", b"{}") for at in (1.0, 2.0)]
    answers = [Exchange(at, *rest, Direction.REPLY, "1004", b"{}", "ok", "", at - 2.0) for at in (3.0, 4.0)]
    older, newer = pair([*asked, *answers])[0]
    assert (older.replies, newer.replies) == ([], answers)


def test_differences_are_shown_in_one_line() -> None:
    (row,) = compare([session()[0]], [], Mask()).rows
    assert row.differences
    assert not any("\n" in part for found in row.differences for part in (found.one, found.other))


@pytest.mark.parametrize("row", [[], [Row("slamware", "GET /x")]])
def test_comparing_nothing_does_not_pass(row: list[Row]) -> None:
    nothing = Comparison(row)
    assert not nothing.passes(0.0)
    assert "100 %" not in reports.table(nothing).splitlines()[-1]
    assert "Nothing was compared" in reports.page(nothing, ("one", "other"))


def test_reports_say_what_could_not_be_read() -> None:
    found = compare(session(), session())
    found.robot, found.notes = "a", ["<x> is cut off"]
    page = reports.page(found, ("one", "other"))
    assert "<p class=bad>&lt;x&gt; is cut off</p>" in page
    assert "<p>robot a</p>" in page


def test_equal_sessions_pass() -> None:
    assert compare(session(), session()).passes(100.0)
