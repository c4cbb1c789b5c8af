"""People and networks are not named in a recording, whichever operation of a dog's says who or which they are."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Sequence
from pathlib import Path

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.system.network import Network
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.playback import Playback
from roboglot.recording.reader import read_messages, read_recording
from roboglot.recording.redaction import Redaction
from roboglot.recording.replaying import sendable
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
