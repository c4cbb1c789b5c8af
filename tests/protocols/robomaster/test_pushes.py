"""Chassis pushes over UDP."""

import asyncio
from collections.abc import AsyncIterator

import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link, LinkState
from roboglot.protocols.robomaster.pushes import Pushes
from roboglot.wire.robomaster.replies import FW70
from tests.protocols.robomaster.text_client import ADDRESS


@pytest.mark.parametrize("rate", [1, 30, 50, *(pytest.param(rate, marks=pytest.mark.slow) for rate in (5, 10, 20))])
async def test_each_rate_is_kept_to_the_datagram(client, pushes, forward, rate: int) -> None:
    await client.ask(f"chassis push attitude on afreq {rate};")
    await forward(seconds=10.001)
    assert len(pushes.texts()) == 10 * rate


async def test_form_and_sender(client, pushes, forward) -> None:
    await client.ask("chassis push position on attitude on status on freq 1;")
    await forward(seconds=1.001)
    got = pushes.drain()
    assert {host for _, host in got} == {ADDRESS}
    texts = sorted(text for text, _ in got)
    assert [text.split()[2] for text in texts] == ["attitude", "position", "status"]
    assert all(text.startswith("chassis push ") and text.endswith(";") and text.count(";") == 1 for text in texts)
    assert [len(text.rstrip(";").split()) - 3 for text in texts] == [3, 2, 11]


async def test_default_is_five_hertz_each_attribute_its_own(client, pushes, forward) -> None:
    await client.ask("chassis push position on pfreq 1 attitude on;")
    await forward(seconds=4.001)
    texts = pushes.texts()
    assert sum("position" in text for text in texts) == 4
    assert sum("attitude" in text for text in texts) == 20


async def test_freq_overrides_and_switches_nothing_on(client, pushes, forward) -> None:
    await client.ask("chassis push freq 10;")
    await forward(seconds=1.001)
    assert pushes.texts() == []
    await client.ask("chassis push position on pfreq 1 freq 20;")
    await client.ask("chassis push attitude on;")
    await forward(seconds=1.001)
    texts = pushes.texts()
    assert sum("position" in text for text in texts) == 20
    assert sum("attitude" in text for text in texts) == 20, "freq means every attribute"
    await client.ask("chassis push position pfreq 5;")
    pushes.drain()
    await forward(seconds=1.001)
    assert sum("position" in text for text in pushes.texts()) == 5


async def test_off_forgets_the_rate(client, pushes, forward) -> None:
    await client.ask("chassis push attitude on afreq 50;")
    await client.ask("chassis push attitude off;")
    await forward(seconds=1)
    assert pushes.texts() == []
    await client.ask("chassis push attitude on;")
    await forward(seconds=1.001)
    assert len(pushes.texts()) == 5


async def test_on_twice_keeps_the_beat(client, pushes, forward) -> None:
    await client.ask("chassis push attitude on afreq 1;")
    for _ in range(8):
        await client.ask("chassis push attitude on;")
        await forward(seconds=0.5)
    assert len(pushes.texts()) == pytest.approx(4, abs=1)


async def test_a_wrong_rate_changes_nothing(client, pushes, forward) -> None:
    assert await client.ask("chassis push position on pfreq 7;") == "fail;"
    await forward(seconds=1)
    assert pushes.texts() == []


async def test_quit_and_disconnect_end_them(client, connect, pushes, forward) -> None:
    await client.ask("chassis push attitude on;")
    await client.ask("quit;")
    await forward(seconds=1)
    assert pushes.texts() == []
    await client.ask("command;")
    await client.ask("chassis push attitude on;")
    await client.close()
    await forward(seconds=1)
    assert pushes.texts() == []
    again = await connect()
    await again.ask("command;")
    await forward(seconds=1)
    assert pushes.texts() == [], "a new session begins without them"


async def test_pushes_go_on_after_a_lost_link(client, robot, pushes, forward) -> None:
    """The first unreadable value ended them for good."""
    await client.ask("chassis push status on sfreq 10;")
    link = robot.add(Link, Link("robomaster://ep", robot.clock, robot.events, robot[Health]))
    link.move_to(LinkState.LOST, "no answer")
    await forward(seconds=1.001)
    assert pushes.texts() == [], "the motion of a lost robot is unknown"
    link.move_to(LinkState.UP)
    await forward(seconds=1)
    assert len(pushes.texts()) == 10


async def test_two_clients_on_one_host_get_one_datagram(client, connect, pushes, forward) -> None:
    other = await connect()
    await other.ask("command;")
    await client.ask("chassis push attitude on afreq 10;")
    await forward(seconds=1.001)
    assert len(pushes.texts()) == 10


async def test_every_client_gets_them_at_its_own_address(client, connect, pushes, inbox_at, forward) -> None:
    elsewhere = inbox_at("127.0.0.5", pushes.port)
    other = await connect("127.0.0.5")
    await other.ask("command;")
    await other.ask("chassis push position on pfreq 10;")
    await forward(seconds=1.001)
    assert (len(elsewhere.texts()), len(pushes.texts())) == (10, 10)
    await other.close()
    await forward(seconds=1)
    assert (len(elsewhere.texts()), len(pushes.texts())) == (0, 10), "who is gone gets no more, who stays does"


class BusyClock(LockstepClock):
    """Skips every fifth beat, as a busy machine may."""

    async def every(self, period: float) -> AsyncIterator[float]:
        for beat in range(1, 52):
            await asyncio.sleep(0)
            if beat % 5:
                yield beat * period


async def test_pushes_of_skipped_beats_are_sent_late() -> None:
    sent = list[bytes]()
    pushes = Pushes(BusyClock(), FW70, sent.append)
    pushes.offer("chassis", [("position", lambda: (0.0, 0.0))])
    pushes.switch("chassis", "position", True, 10)
    await asyncio.gather(*(asyncio.all_tasks() - {asyncio.current_task()}))
    assert len(sent) == 10
