"""``robot ip``: how a robot is found."""

from roboglot.protocols.robomaster.datagrams import broadcast_address
from tests.protocols.robomaster.text_client import ADDRESS


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
