"""The pilot's port, and well-known addresses."""

import asyncio

import pytest

from roboglot.model.components.interaction.input_device import InputDevice, MouseButton
from roboglot.protocols.robomaster import server
from roboglot.protocols.robomaster.limits import PILOT_LINE_MAX, PILOTS_MAX
from tests.protocols.robomaster.text_client import ADDRESS, port_of

PILOT = pytest.mark.parametrize("door", [{"pilot_port": 0}], indirect=True)
pytestmark = pytest.mark.world("empty", body="robomaster_ep")


async def say(streams, text: str) -> str:
    streams[1].write(text.encode())
    return (await asyncio.wait_for(streams[0].readline(), 60)).decode()


@PILOT
async def test_keys_and_mouse_reach_the_client(client, door, robot, pushes, forward) -> None:
    pilot = await asyncio.open_connection(ADDRESS, port_of(door, "pilot"))
    assert await client.ask("game_msg on;") == "ok;"
    assert [await say(pilot, text) for text in ("press w shift\n", "click left\n", "mouse 0.5 -0.2\n")] == ["ok\n"] * 3
    await forward(seconds=0.11)
    assert any(text.startswith("game msg push [0, 7, 2, 50, -20,") and "2, 87, 16]" in text for text in pushes.texts())
    assert await say(pilot, "release w\n") == "ok\n"
    assert robot[InputDevice].state.keys == ("shift",)
    pilot[1].close()
    await asyncio.sleep(0.02)
    assert robot[InputDevice].state.keys == ()
    assert robot[InputDevice].state.buttons == frozenset[MouseButton]()


@PILOT
@pytest.mark.parametrize("text", ["press W", "jump", "", "click nose", "mouse 2 0", "mouse x", "mouse 1", "press \xff"])
async def test_invalid_input_is_reported(door, robot, text: str) -> None:
    pilot = await asyncio.open_connection(ADDRESS, port_of(door, "pilot"))
    assert (await say(pilot, f"{text}\n")).startswith("error: ")
    assert robot[InputDevice].state.keys == ()
    pilot[1].close()


@PILOT
async def test_pilots_are_bounded(door) -> None:
    pilots = [await asyncio.open_connection(ADDRESS, port_of(door, "pilot")) for _ in range(PILOTS_MAX + 1)]
    with pytest.raises((ConnectionError, AssertionError)):
        assert await say(pilots[-1], "click\n")
    pilots[0][1].write(b"x" * (PILOT_LINE_MAX + 1))
    with pytest.raises((ConnectionError, AssertionError)):
        assert await asyncio.wait_for(pilots[0][0].readline(), 60)
    assert await say(pilots[1], "click\n") == "ok\n"
    for _, writer in pilots:
        writer.transport.abort()


async def test_it_is_closed_unless_asked_for(door) -> None:
    with pytest.raises(StopIteration):
        port_of(door, "pilot")


async def test_fixed_addresses_are_not_announced(robot, forward, door, broadcasts, monkeypatch) -> None:
    """The robot's own Wi-Fi and its USB cable have fixed addresses."""
    assert {"192.168.2.1", "192.168.42.2"} == server.KNOWN_ADDRESSES
    await door.close()
    monkeypatch.setattr(server, "KNOWN_ADDRESSES", {ADDRESS})
    await door.start()
    broadcasts.drain()
    await forward(seconds=5)
    assert broadcasts.texts() == []
