"""``robot ip``: how a robot is found."""

import asyncio

from roboglot.protocols.robomaster.datagrams import broadcast_address
from roboglot.protocols.robomaster.ports import discovery
from roboglot.testing.addresses import free_addresses
from roboglot.transport.own_addresses import own_addresses
from tests.protocols.robomaster.text_client import ADDRESS

OTHER = free_addresses(1)


async def test_every_two_seconds_from_address_in_the_text(door, broadcasts, forward) -> None:
    await forward(seconds=6.001)
    assert broadcasts.drain() == [(f"robot ip {ADDRESS}", ADDRESS)] * 3


async def test_silent_while_someone_is_in_sdk_mode(connect, broadcasts, forward) -> None:
    client = await connect()
    await forward(seconds=2.001)
    assert len(broadcasts.texts()) == 1, "a connection alone doesn't hold the robot"
    await client.ask("command;")
    await forward(seconds=6)
    assert broadcasts.texts() == []
    await client.ask("quit;")
    await forward(seconds=4)
    assert len(broadcasts.texts()) == 2
    await client.ask("command;")
    await client.close()
    await forward(seconds=4)
    assert len(broadcasts.texts()) == 2


def test_broadcasts_of_loopback_robots_stay_there() -> None:
    assert broadcast_address("127.0.0.9") == "127.255.255.255"
    assert broadcast_address("10.0.0.9") == "255.255.255.255"  # from its own address: only into its network


async def test_each_network_hears_its_own_address(door, broadcasts, forward, monkeypatch) -> None:
    """A robot at 0.0.0.0, as in the container's image, announced nothing."""
    monkeypatch.setattr(discovery, "own_addresses", lambda: ["127.0.0.1", OTHER])
    everywhere = asyncio.create_task(discovery.announce(door.context, "0.0.0.0", door._broadcast))
    await forward(seconds=2.001)
    everywhere.cancel()
    assert set(broadcasts.drain()) == {(f"robot ip {own}", own) for own in (ADDRESS, "127.0.0.1", OTHER)}


def test_own_addresses_are_of_this_machine() -> None:
    assert "127.0.0.1" in own_addresses()
    assert "0.0.0.0" not in own_addresses()
