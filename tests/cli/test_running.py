"""Tests of requests to a running `roboglot up`, over its socket."""

from __future__ import annotations

import asyncio
from pathlib import Path

import msgspec
import pytest

from roboglot.cli.control import running, stop
from roboglot.cli.control.lease import send
from roboglot.control import lease_server
from roboglot.control.record_server import Answer, Request
from roboglot.hosting.local_socket import LocalServer


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b'{"error": "nothing is being recorded"}', "roboglot record: nothing is being recorded"),
        (b'{"error": 5}', "roboglot record: the program in .* is of another version"),
        (b"[" * 20, "roboglot record: the program in .* is of another version"),
    ],
)
async def test_command_ends_with_a_sentence(line: bytes, reason: str, tmp_path: Path) -> None:
    async def answer(request: bytes) -> bytes:
        return line

    server = LocalServer(tmp_path / "s", "record", answer)
    await server.open()
    try:
        with pytest.raises(SystemExit, match=reason):
            await asyncio.to_thread(running.request, "record", tmp_path / "s", Request("stop"), Answer, 10.0)
    finally:
        await server.close()


async def test_commands_reach_the_worlds_of_a_fleet(tmp_path: Path) -> None:
    """`stop`, `lease` and `reset` with a fleet's folder ask all its worlds, or the one with that robot."""
    asked: list[tuple[str, str]] = []
    servers: list[LocalServer] = []
    for world, robot in {"w1": "a1", "w2": "a2", "w10": "a10"}.items():

        async def answer(line: bytes, robot: str = robot) -> bytes:
            request = msgspec.json.decode(line, type=lease_server.Request)
            asked.append((request.do, robot))
            return msgspec.json.encode(lease_server.Answer([lease_server.Control(robot, "", "", 0.0, "", "", "")]))

        (tmp_path / "shards" / world / "data").mkdir(parents=True)
        servers.append(LocalServer(tmp_path / "shards" / world / "data" / lease_server.NAME, "lease", answer))
        await servers[-1].open()
    try:
        stopped = await asyncio.to_thread(send, "stop", lease_server.Request("stop", all=True), tmp_path)
        assert [control.robot for control in stopped.robots] == ["a1", "a2", "a10"]
        assert sorted(asked) == [("stop", "a1"), ("stop", "a10"), ("stop", "a2")]
        asked.clear()
        await asyncio.to_thread(send, "reset", lease_server.Request("reset", "a2"), tmp_path)
        assert [(verb, robot) for verb, robot in asked if verb != "look"] == [("reset", "a2")]
        with pytest.raises(SystemExit, match=r"roboglot stop: there is no robot 'b'; there are a1, a2, a10"):
            await asyncio.to_thread(send, "stop", lease_server.Request("stop", "b"), tmp_path)
    finally:
        for server in servers:
            await server.close()


async def test_every_world_that_refuses_is_named(tmp_path: Path) -> None:
    """A refusing world, or one that is gone, hides neither another's refusal nor its robots."""
    servers: list[LocalServer] = []
    for world, error in {"w1": "robot a1: no link", "w2": "", "w3": "robot a3: no link", "w4": ""}.items():

        async def answer(line: bytes, robot: str = f"a{world[1:]}", error: str = error) -> bytes:
            verb = msgspec.json.decode(line, type=lease_server.Request).do
            controls = [lease_server.Control(robot, "", "", 0.0, "", "", "")]
            return msgspec.json.encode(lease_server.Answer(controls, "" if verb == "look" else error))

        (tmp_path / "shards" / world / "data").mkdir(parents=True)
        servers.append(LocalServer(tmp_path / "shards" / world / "data" / lease_server.NAME, "lease", answer))
        await servers[-1].open()
    gone = tmp_path / "shards/w4/data" / lease_server.NAME
    await servers.pop().close()
    gone.touch()  # as a killed world leaves it
    try:
        with pytest.raises(SystemExit) as ended:
            await asyncio.to_thread(send, "stop", lease_server.Request("stop", all=True), tmp_path)
        assert str(ended.value).splitlines() == [
            "roboglot stop: robot a1: no link",
            "roboglot stop: robot a3: no link",
            f"roboglot stop: no `roboglot up` answers in {gone.parent}",
        ]
        stopped = await asyncio.to_thread(send, "stop", lease_server.Request("stop", "a2"), tmp_path)
        assert [control.robot for control in stopped.robots] == ["a2"]
    finally:
        for server in servers:
            await server.close()


@pytest.mark.parametrize(
    ("taken_by", "hint"), [("", "may move it again: `roboglot lease a --take`"), ("a person", None)]
)
def test_stop_names_what_keeps_robots_standing(
    taken_by: str, hint: str | None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A program that runs drives on half a second later."""
    control = lease_server.Control("a", "", "", 0.0, taken_by, "", "")
    monkeypatch.setattr(stop, "send", lambda *_: lease_server.Answer([control]))
    stop.command("a")
    shown = capsys.readouterr().out
    assert shown.startswith("a stands\n")
    assert (hint in shown) if hint else shown == "a stands\n"
