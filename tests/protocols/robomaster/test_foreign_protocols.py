"""Browsers, TLS and SSH on the door's plain-text ports: nothing of theirs is run."""

import asyncio

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.components.interaction.input_device import InputDevice
from roboglot.protocols.robomaster.foreign_protocols import Greeting, StrangerError
from roboglot.protocols.robomaster.table import TABLE
from tests.protocols.robomaster.text_client import ADDRESS, port_of

pytestmark = pytest.mark.world("empty", body="robomaster_ep")
COMMANDS = b"command;chassis speed x 0.5;\r\npress w\r\n"
STRANGERS = {
    "form": b"POST / HTTP/1.1\r\nHost: 127.0.0.1:40923\r\nContent-Length: 44\r\n\r\n" + COMMANDS,
    "path": b"GET /;command;chassis%20speed%20x%201; HTTP/1.1\r\nHost: a\r\n\r\n" + COMMANDS,
    "short": b"GET /\n" + COMMANDS,
    "lower": b"get /;" + COMMANDS,
    "h2": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + COMMANDS,
    "method of its own": b"SMUGGLE / HTTP/1.1\r\n\r\n" + COMMANDS,
    "TLS": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + COMMANDS,
    "SSH": b"SSH-2.0-OpenSSH_9.2\r\n" + COMMANDS,
}
PORTS = ("text SDK", "events", "video", "audio", "explanations", "pilot")


async def cut_off(reader: asyncio.StreamReader) -> bool:
    try:
        return await asyncio.wait_for(reader.read(), 5) == b""
    except ConnectionError:
        return True


@pytest.mark.parametrize("door", [{"pilot_port": 0}], indirect=True)
@pytest.mark.parametrize("port", PORTS)
async def test_strangers_are_cut_off_on_every_port(door, robot, caplog, port: str) -> None:
    for name, sent in STRANGERS.items():
        for pieces in ([sent], [sent[:1], sent[1:3], sent[3:40], sent[40:]]):
            caplog.clear()
            reader, writer = await asyncio.open_connection(ADDRESS, port_of(door, port))
            for piece in pieces:
                writer.write(piece)
                await asyncio.sleep(0.001)
            assert await cut_off(reader), name
            writer.transport.abort()
            spoken = name if name in ("TLS", "SSH") else "HTTP"
            assert f"speaks {spoken} on port {port_of(door, port)}: no command was run" in caplog.text
    assert not door.context.active
    assert robot.actions.running() == []
    assert robot[InputDevice].state.keys == ()


@pytest.mark.parametrize("door", [{"lenient": True}], indirect=True)
async def test_text_without_its_end_is_run_at_once(client) -> None:
    assert await client.ask("robot mode ?") == "chassis_lead;"


def hear(greeting: Greeting, sent: bytes, cuts: list[int]) -> bytes:
    """Return the readable part of ``sent``, which comes in pieces; a stranger's is refused before any of it is read."""
    ends, read = [*sorted(set(cuts)), len(sent)], b""
    for start, end in zip([0, *ends], ends, strict=False):
        if piece := sent[start:end]:
            read += greeting.check(piece)
            assert not (sent in STRANGERS.values() and read)
    return read


@given(st.sampled_from([operation.key for operation in TABLE]), st.lists(st.integers(1, 30), max_size=4))
def test_no_command_is_taken_for_a_stranger(command: str, cuts: list[int]) -> None:
    text = f"{command};".encode()
    assert hear(Greeting(), text, cuts) == text


@given(st.sampled_from(list(STRANGERS.values())), st.lists(st.integers(1, 30), max_size=6))
def test_a_stranger_in_pieces_has_nothing_read(sent: bytes, cuts: list[int]) -> None:
    greeting = Greeting()
    with pytest.raises(StrangerError):
        hear(greeting, sent, cuts)
