"""People and networks are not named in a recording, whichever operation of a dog's says who or which they are."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.clock import LockstepClock
from roboglot.model.components.system.network import Network
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.entries import Entry, encoded
from roboglot.recording.playback import Playback
from roboglot.recording.reader import read_messages, read_recording
from roboglot.recording.redaction import FIELDS, Redaction
from roboglot.recording.replaying import sendable
from roboglot.recording.secrets import KNOWN_MAX, ORDINARY
from roboglot.wire.cyberdog.codes import Code
from roboglot.wire.visual.replies import feedback, responses
from tests.recording.everything import Session, begun

NAMES = ("Xanthippe", "Aspasia")
SAID: Sequence[tuple[Code, dict[str, object]]] = (
    (Code.ADD_MEMBER, {"member": NAMES[0]}),
    (Code.FIND_MEMBERS, {}),
    (Code.FIND_MEMBERS, {"account": NAMES[0]}),
    (Code.RENAME_MEMBER, {"pre_name": NAMES[0], "new_name": NAMES[1]}),
    (Code.SYNCHRONISE_MEMBERS, {}),
    (Code.SET_NICKNAME, {"nick_name": NAMES[0], "wake_name": NAMES[0]}),
    (Code.DEVICE_INFO, {"is_nick_name": True, "is_wifi": True}),
    (Code.TRAIN_VOICE, {"nick_name": NAMES[1]}),
    (Code.VOICEPRINTS, {"voiceprints_data": NAMES[1]}),
    (Code.ENTER_FACE, {"command": 0, "username": NAMES[1]}),
    (Code.ENTER_FACE, {"command": 3, "username": NAMES[1], "oriname": NAMES[0]}),
    (Code.ENTER_FACE, {"command": 5}),
    (Code.RECOGNISE_FACES, {"command": 1, "username": NAMES[1]}),
    (Code.DELETE_MEMBER, {"member": NAMES[1]}),
)


async def say_all(session: Session) -> None:
    session.dog = session.new_app()
    await session.dog.open()
    for code, values in SAID:
        await session.dog_asks(code, **values)
        await session.clock.advance(0.5)
    await session.clock.advance(40.0)  # no face and no voice comes: that is pushed, with the name


async def test_no_name_stands_in_a_recording(tmp_path: Path) -> None:
    async with begun(tmp_path) as session:
        network = session.runtime.fleet.robots["a"][Network].state.ssid
        await say_all(session)
        assert network

        def named() -> bool:
            answers = str(session.answers)
            pushed = any(name in text for name in NAMES for _, text in session.pushed)
            return pushed and all(name in answers for name in (*NAMES, network))

        async with asyncio.timeout(120):  # a busy machine
            while not named():  # noqa: ASYNC110 - answers and pushes come by sockets
                await asyncio.sleep(0.0005)
        await session.dog.close()
    for message in read_messages(tmp_path / "r.mcap"):
        data = message.data
        if message.topic == "/log":  # a busy machine has warnings; their loggers are called as the network is
            data = re.sub(rb"roboglot(\.\w+)+", b"", data)
        for name in (*NAMES, network):
            assert name.encode() not in data, (message.topic, data)
    found = read_recording(tmp_path / "r.mcap").exchanges
    asked = [exchange for exchange in found if exchange.direction is Direction.REQUEST]
    assert {int(exchange.operation) for exchange in asked} == {int(code) for code, _ in SAID}


def exchanges(*texts: bytes) -> list[Exchange]:
    rest = ("a", "cyberdog", "127.0.0.1:5", "x")
    found = []
    for number, text in enumerate(texts):
        found.append(Exchange(float(number), *rest, Direction.REQUEST, "1020", text))
        found.append(Exchange(float(number), *rest, Direction.REPLY, "1020", b'{"success": true}', "ok"))
    return found


@pytest.mark.parametrize("field", ["member", "badge"])
async def test_redacted_requests_are_known_again(field: str) -> None:
    session = exchanges(b'{"%s": "[redacted]"}' % field.encode())
    clock = LockstepClock()
    playback = Playback(session, clock, 0.0, redact=("badge",))
    said = b'{"%s": "Xanthippe"}' % field.encode()

    async def ask() -> list[bytes]:
        return [reply.payload async for reply in playback.answer("cyberdog", "1020", said, reads=False)]

    asking = asyncio.create_task(ask())
    await clock.advance(1.0)
    assert await asking == [b'{"success": true}']
    assert not playback.missing


def test_redacted_requests_are_not_sent_again() -> None:
    session = exchanges(b'{"member": "[redacted]"}', b'{"member": ""}')
    assert sendable(session) == (session[2:], 1)


@pytest.mark.parametrize("kind", ["personnel", "face", "voiceprint"])
@pytest.mark.parametrize("name", ["Xanthippe", 'X "Y} Z', ""])
@pytest.mark.parametrize("backwards", [False, True])
def test_people_in_lists_of_programming_have_no_names(kind: str, name: str, backwards: bool) -> None:
    person = {"id": "1", "mode": kind, "style": "0", "condition": "1", "describe": name}
    if backwards:
        person = dict(reversed(person.items()))
    task = {"describe": "line 3", "mode": "single"}
    (frame,) = responses(kind="AI", id="x", items=[person, {**person, "id": "2"}])
    frame = json.dumps([task, *([person] * 2), task]) if backwards else frame
    for payload in (frame, json.dumps({"data": frame})):
        found = Redaction()(payload.encode()).decode()
        assert found.count("[redacted]") == 2
        assert found.replace("[redacted]", "") == payload.replace(_inside(name, payload != frame), "")


def _inside(text: str, nested: bool) -> str:
    inside = json.dumps(text)[1:-1]
    return json.dumps(inside)[1:-1] if nested else inside


def test_descriptions_of_programs_stay() -> None:
    frame = feedback(kind="task", id="x", target="t", operate="run", state=1, describe="line 3: face").encode()
    assert Redaction()(frame) == frame


@pytest.mark.parametrize("field", ["GRÖSSE", "größe"])
def test_fields_beyond_ascii_are_left_out(field: str) -> None:
    assert Redaction((field,))(json.dumps({field: "1 m"}, ensure_ascii=False).encode()).count(b"[redacted]") == 1


WORD = st.text(st.characters(categories=["L", "N"], max_codepoint=0x9FFF), min_size=3, max_size=12).filter(
    lambda word: word.lower() not in {*ORDINARY, *FIELDS} and not word.isnumeric()
)
WIFI = "PUT /api/core/system/v1/network/status"


def said(operation: str, payload: str, status: str = "", refusal: str = "") -> Exchange:
    direction = Direction.REPLY if status else Direction.REQUEST
    return Exchange(
        1.0, "a", "slamware", "127.0.0.1:5", "x", direction, operation, payload.encode(), status, refusal, 0.0
    )


@given(WORD, st.sampled_from(["ssid", "password", "username", "member"]), st.booleans())
def test_later_quotes_of_a_secret_are_redacted(word: str, field: str, ascii_only: bool) -> None:
    redact = Redaction()
    secret = f"{word} 7"
    asked = redact.exchange(said(WIFI, json.dumps({"options": {field: secret}}, ensure_ascii=ascii_only)))
    body = json.dumps({"message": f"no network {secret}, (-3)", "code": 3}, ensure_ascii=not ascii_only)
    refused = redact.exchange(said("GET /x", body, "404", f"no network {secret}, (-3)"))
    nested = redact.exchange(said("GET /y", json.dumps({"params": json.dumps({"text": secret})}), "200"))
    logged = encoded(Entry("/log", "log", 0, 0, (20, "roboglot", f"{secret} is away")), redact)
    event = encoded(Entry("/a/events", "event", 0, 0, {"event": "X", "text": f"hello {secret}!"}), redact)
    everything = (asked.payload, refused.payload, refused.refusal.encode(), nested.payload, logged, event)
    for form in (secret.encode(), json.dumps(secret)[1:-1].encode()):
        assert not [text for text in everything if form in text]
    assert refused.refusal == "no network [redacted], (-3)"
    assert json.loads(refused.payload) == {"message": "no network [redacted], (-3)", "code": 3}
    assert json.loads(json.loads(nested.payload)["params"]) == {"text": "[redacted]"}


def test_text_that_resembles_a_secret_stays() -> None:
    redact = Redaction()
    for secret in ("mode", "1234", "Tom", "ok"):
        redact(json.dumps({"password": secret}).encode())
    text = b'{"mode": 1, "stamp": 1234, "text": "Tomorrow, atom 12345", "status": "ok", "model": "modest"}'
    assert redact(text) == text
    assert redact(b'{"text": "Tom, \'1234\' is wrong\\nTom"}') == (
        b'{"text": "[redacted], \'[redacted]\' is wrong\\n[redacted]"}'
    )
    assert redact(b"\xff\xfe Tom ") == b"\xff\xfe Tom "  # no text: a map, a picture


@pytest.mark.parametrize("door", ["slamware", "driver/slamware"])
def test_refusals_of_real_robots_do_not_quote_networks(door: str) -> None:
    """A proxy knows their status alone; the network may be one that no field has named."""
    body = json.dumps({"error": "there is no network 'Home Net' here"})
    refused = said(WIFI, body, "400")._replace(door=door)
    assert Redaction().exchange(refused).payload == b'{"error": "there is no network [redacted] here"}'
    fine = refused._replace(status="200")
    assert Redaction().exchange(fine).payload == fine.payload


@given(st.permutations(["mode", "describe", "nested", "text", "list"]), WORD, st.integers(0, 2), st.booleans())
def test_names_of_people_are_always_removed(order: list[str], name: str, wrapped: int, is_person: bool) -> None:
    name = f"{name}."
    values: dict[str, object] = {
        "mode": "face" if is_person else "tag",
        "describe": name,
        "nested": {"mode": "tag", "a": {"describe": "a place"}},
        "text": "} {",
        "list": [{"b": 1}, {"mode": "voiceprint", "describe": "#1"}],
    }
    person: object = {key: values[key] for key in order}
    for _ in range(wrapped):
        person = {"data": json.dumps(person)}
    found = json.loads(Redaction()(json.dumps(person).encode()))
    for _ in range(wrapped):
        found = json.loads(found["data"])
    listed = [{"b": 1}, {"mode": "voiceprint", "describe": "[redacted]"}]
    assert found == values | {"list": listed, "describe": "[redacted]" if is_person else name}
    assert list(found) == order


def test_the_latest_of_many_secrets_are_redacted() -> None:
    """A client that sends one after the other cannot make a recording keep those of the others."""
    redaction = Redaction()
    for number in range(KNOWN_MAX + 5):
        redaction(b'{"password": "%d-hidden \xc3\xa4"}' % number)
    last = KNOWN_MAX + 4
    said = f"no 4-hidden ä, {last}-hidden ä, \\u00e4 {last - 1}-hidden \\u00e4 or 5-hidden ä".encode()
    assert redaction(said) == rb"no 4-hidden \xc3\xa4, [redacted], \u00e4 [redacted] or [redacted]".replace(
        rb"\xc3\xa4", b"\xc3\xa4"
    )
    assert redaction(b"nothing of theirs") == b"nothing of theirs"


def test_escapes_of_escapes_take_no_time() -> None:
    """Each of these quotes was looked for to the end, which took minutes."""
    parts = (b'x%b"password%b":%b"' % ((b"\\" * number,) * 3) for number in range(1000, 0, -1))
    payload = b'{"password":"hidden"}' + b"".join(parts)
    assert Redaction()(payload).startswith(b'{"password":"[redacted]"}x')
