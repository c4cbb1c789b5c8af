"""The kernel's tables of connections: each takes it milliseconds, so no more of them are read than say something."""

from __future__ import annotations

import asyncio
import io

import pytest

from roboglot.protocols.cyberdog import handshakes
from roboglot.protocols.cyberdog.handshakes import Handshakes
from tests.drivers.settling import settle

ROW = "0: {}:C384 {}:{} {} 00000000:00000000 00:00000000 00000000 0 0 1 2 0\n"
OURS, THEIRS = "0000000000000000FFFF00000100007F", "0000000000000000FFFF00000200007F"  # 127.0.0.1 and 127.0.0.2
LISTENER, PHONE = ROW.format(OURS, "0" * 32, "0000", "0A"), ROW.format(OURS, THEIRS, "1388", "01")
PEER = "ipv4:127.0.0.2:5000"


class Table:
    """A table of the kernel that notes how often it was read."""

    def __init__(self, *rows: str) -> None:
        self.rows, self.reads = rows, 0

    def open(self) -> io.StringIO:
        self.reads += 1
        return io.StringIO("".join(("heading\n", *self.rows)))


@pytest.mark.parametrize(("asks", "looks"), [(True, 1), (False, 2)])
async def test_peer_that_asked_costs_no_second_look(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, asks: bool, looks: int
) -> None:
    table, other = Table(LISTENER, PHONE), Table()
    monkeypatch.setattr(handshakes, "TABLES", (table, other))
    monkeypatch.setattr(handshakes, "LATER", 0.0)
    begun = Handshakes("127.0.0.1", 50052)
    begun.begun()
    await asyncio.sleep(0)
    assert begun._watched == {PEER}
    if asks:
        begun.note_request(PEER)
    table.rows = (LISTENER,)
    while begun._watched:
        await settle()
    assert (table.reads, other.reads) == (looks, 0)  # the port listens in the first
    assert ("127.0.0.2 was refused on port 50052" in caplog.text) is not asks


async def test_peers_soon_after_another_are_watched(monkeypatch: pytest.MonkeyPatch) -> None:
    table = Table(LISTENER)
    monkeypatch.setattr(handshakes, "TABLES", (table,))
    begun = Handshakes("127.0.0.1", 50052)
    begun.begun()
    table.rows = (LISTENER, PHONE)
    for _ in range(5):
        begun.begun()
    while not begun._watched:
        await settle()
    assert begun._watched == {PEER}
    assert table.reads == 2
    begun.close()


def test_port_of_the_second_table_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(handshakes, "TABLES", (Table(), Table(LISTENER, PHONE)))
    assert handshakes._peers(None, 50052) == {PEER: "01"}
