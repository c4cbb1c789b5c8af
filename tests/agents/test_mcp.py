"""The tools by the protocol's own client: over standard input, over streamable HTTP, and in one process."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import sys
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import typer
from typer.testing import CliRunner

from roboglot.agents.console import ConsoleClient
from roboglot.cli.mcp import command
from roboglot.config import ConsoleConfig, RobotConfig, load_config
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.geometry import Pose
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses, free_port
from tests.console.conftest import ADDRESS, ServedConsole
from tests.narrowing import known, of_kind

if TYPE_CHECKING:
    from mcp import Client

# mcp is imported where it is used: it takes every worker of the suite a second otherwise.
TOOLS = {"robots", "where_am_i", "look", "map_picture", "go_to", "drive", "stop", "run_program", "rehearse"}
PNG, JPEG = "iVBORw0KGgo", "/9j/"


@contextlib.asynccontextmanager
async def passing(served: ServedConsole) -> AsyncIterator[None]:
    """Robot time passes as fast as it goes while someone waits for the robot."""

    async def pass_time() -> None:
        while True:
            await served.clock.advance(0.05)
            await asyncio.sleep(0)

    task = asyncio.create_task(pass_time())
    try:
        yield
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


async def call(client: Client, tool: str, **values: Any) -> Any:
    """Return the tool's answer as plain values."""
    from mcp.types import TextContent

    answer = await client.call_tool(tool, values)
    assert not answer.is_error, answer.content
    if answer.structured_content is not None:
        return answer.structured_content.get("result", answer.structured_content)
    return json.loads(of_kind(answer.content[0], TextContent).text)


async def refusal(client: Client, tool: str, **values: Any) -> str:
    answer = await client.call_tool(tool, values)
    assert answer.is_error
    return " ".join(getattr(part, "text", "") for part in answer.content)


def tools(served: ServedConsole) -> Client:
    """Return the protocol's own client of the tools over this console."""
    return tools_of(served.url)


def tools_of(console: str) -> Client:
    from mcp import Client

    from roboglot.agents.server import make_server

    return Client(make_server(ConsoleClient(console)))


@pytest.mark.slow  # in short: test_over_streamable_http
async def test_over_standard_input(served: ServedConsole) -> None:
    from mcp import Client, StdioServerParameters

    command = StdioServerParameters(command=sys.executable, args=["-m", "roboglot", "mcp", "--console", served.url])
    async with Client(command) as client:
        assert {tool.name for tool in (await client.list_tools()).tools} >= TOOLS
        assert [robot["name"] for robot in await call(client, "robots")] == ["a"]


async def test_over_streamable_http(served: ServedConsole) -> None:
    from mcp import Client
    from uvicorn import Config, Server

    from roboglot.agents.server import make_server

    app = make_server(ConsoleClient(served.url)).streamable_http_app()
    server = Server(Config(app, log_config=None))
    with socket.create_server(("127.0.0.1", 0)) as listening:
        serving = asyncio.create_task(server.serve([listening]))
        async with Client(f"http://127.0.0.1:{listening.getsockname()[1]}/mcp") as client:
            assert {tool.name for tool in (await client.list_tools()).tools} >= TOOLS
            assert (await call(client, "where_am_i"))["name"] == "a"
        server.should_exit = True
        await serving


@pytest.mark.slow  # a separate process: the same server as above, the same process as test_over_standard_input
async def test_the_command_serves_streamable_http(served: ServedConsole) -> None:
    from mcp import Client

    port = free_port()
    arguments = ("-m", "roboglot", "mcp", "--console", served.url, "--http", str(port))
    process = await asyncio.create_subprocess_exec(sys.executable, *arguments, stderr=asyncio.subprocess.PIPE)
    try:
        assert process.stderr is not None
        async for line in process.stderr:
            if b"running on" in line:
                break
        async with Client(f"http://127.0.0.1:{port}/mcp") as client:
            assert (await call(client, "where_am_i"))["name"] == "a"
    finally:
        process.terminate()
        await process.communicate()


def test_a_taken_port_is_named_in_words() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(SystemExit, match=f"^roboglot mcp: port {port} of 127.0.0.1: Address already in use; "):
            command(http=port)


@pytest.mark.parametrize("port", ["-1", "65536"])
def test_a_port_that_cannot_be_is_refused(port: str) -> None:
    app = typer.Typer()
    app.command()(command)
    done = CliRunner().invoke(app, ["--http", port])
    assert done.exit_code == 2
    assert "is not in the range" in done.output


async def test_go_to_drives_there_and_reports_the_end(served: ServedConsole) -> None:
    async with tools(served) as client:
        async with passing(served):
            result = await call(client, "go_to", x=1.0, y=0.5)
        assert result["status"] == "SUCCEEDED"
        assert result["pose"][:2] == pytest.approx([1.0, 0.5], abs=0.15)
        assert served.robot[Localization].pose.distance_to(Pose(1.0, 0.5, 0.0)) < 0.15


async def test_drive_brakes_by_itself_and_is_bounded(served: ServedConsole) -> None:
    async with tools(served) as client:
        async with passing(served):
            result = await call(client, "drive", x=0.3, seconds=1.0)
        assert result["status"] == "SUCCEEDED"
        assert 0.1 < result["pose"][0] < 0.4
        assert "seconds must be at most 2" in await refusal(client, "drive", x=0.3, seconds=3.0)


async def test_stop_ends_what_moves(served: ServedConsole) -> None:
    async with tools(served) as client:
        await call(client, "go_to", x=3.0, y=0.0, wait=0)
        async with passing(served):
            await client.call_tool("stop", {})
        assert not served.robot.actions.running("base")


@pytest.mark.slow
async def test_map_and_camera_are_pictures(served: ServedConsole) -> None:
    from mcp.types import ImageContent

    async with tools(served) as client, passing(served):
        for tool, start in (("map_picture", PNG), ("look", JPEG)):
            (picture,) = (await client.call_tool(tool, {})).content
            assert isinstance(picture, ImageContent)
            assert picture.data.startswith(start)


async def test_a_program_prints(served: ServedConsole) -> None:
    async with tools(served) as client:
        async with passing(served):
            run = await call(client, "run_program", source="print('hello from', 6 * 7)\n")
        assert "hello from 42" in " ".join(line["text"] for line in run["log"])
        assert run["state"] not in ("run", "run_wait")


async def test_a_fault_and_its_end(served: ServedConsole) -> None:
    async with tools(served) as client:
        kind = next(kind.name for kind in served.desk.stage.fault_kinds if kind.of_robot)
        assert await call(client, "inject_fault", kind=kind, robot="a")
        assert served.desk.stage.faults
        await client.call_tool("clear_faults", {})
        assert not served.desk.stage.faults


async def test_refusals_say_why(served: ServedConsole) -> None:
    async with tools(served) as client:
        assert "no robot 'b'" in await refusal(client, "where_am_i", robot="b")
        async with tools_of("http://127.0.0.1:1") as lost:
            assert "start it with `roboglot up`" in await refusal(lost, "robots")


async def test_one_of_several_robots_is_named(tmp_path: Path) -> None:
    """A tool without a name moved robot a, though the agent looked after another."""
    base = load_config(None, {"data": str(tmp_path), "world": "empty", "lockstep": True})
    robots = RobotConfig("a", "universal", ADDRESS), RobotConfig("b", "universal", free_addresses(1))
    runtime = Runtime(replace(base, robots=robots, console=ConsoleConfig(port=0)))
    await runtime.start()
    console = known(runtime.console)
    await console.ready()
    try:
        async with tools_of(console.address) as client:
            for tool in ("where_am_i", "drive", "stop", "map_picture"):
                assert "say which robot; there are a, b" in await refusal(client, tool)
            assert (await call(client, "where_am_i", robot="b"))["name"] == "b"
    finally:
        await runtime.close()


WRONG: list[tuple[str, dict[str, Any], str]] = [
    ("go_to", {}, "x is missing; y is missing"),
    ("go_to", {"x": True, "y": "1"}, "x must be a number, not true or false; y must be a number, not text"),
    ("go_to", {"x": 1e9, "y": None}, "x must be at most 10000; y must be a number, not null"),
    ("drive", {"seconds": 0, "robt": "a"}, "seconds must be above 0; robt is unknown; did you mean 'robot'?"),
    ("robots", {"x": 1}, "x is unknown"),
    ("where_am_i", {"robot": 7}, "robot must be text, not a whole number"),
    ("where_am_i", {"robot": "a/program"}, "robot must match ^[^/]+$"),
    ("run_program", {"source": ""}, "source must have at least 1 characters"),
    ("rehearse", {"plan": {}}, "plan must be a list, not an object"),
    ("rehearse", {"plan": [5]}, "plan[0] must be an object, not a whole number"),
    ("rehearse", {"plan": [{"x": 1}]}, "plan[0].do is missing"),
    ("rehearse", {"plan": [{"do": "fly"}]}, "plan[0].do cannot be 'fly'; use go_to or drive"),
    (
        "rehearse",
        {"plan": [{"do": "go_to", "x": 1}, {"do": "drive", "z": 1}]},
        "plan[0].y is missing; plan[1].z is unknown; there are do, seconds, x, y, yaw",
    ),
    ("go_too", {}, "there is no tool 'go_too'; did you mean 'go_to'?"),
]


async def test_wrong_arguments_are_named_in_words() -> None:
    async with tools_of("http://127.0.0.1:1") as client:
        for tool, values, why in WRONG:
            assert await refusal(client, tool, **values) == why, values


async def test_a_flood_of_arguments_has_a_short_refusal() -> None:
    async with tools_of("http://127.0.0.1:1") as client:
        why = await refusal(client, "go_to", **{f"{index}{'x' * 10_000}": 1 for index in range(1000)})
    assert len(why) < 2000
    assert why.endswith("994 more")


async def test_an_unknown_prompt_is_refused_without_traceback(caplog: pytest.LogCaptureFixture) -> None:
    from mcp.shared.exceptions import MCPError

    async with tools_of("http://127.0.0.1:1") as client:
        with pytest.raises(MCPError, match="there is no prompt 'greet'; this server has tools only"):
            await client.get_prompt("greet")
    assert not [record for record in caplog.records if record.exc_info]


async def test_a_plan_is_tried_before_the_robot_moves(served: ServedConsole) -> None:
    before = served.robot[Localization].pose
    free = [{"do": "go_to", "x": 1.0, "y": 0.5}, {"do": "drive", "yaw": 1.0, "seconds": 1.0}]
    async with tools(served) as client:
        result = await call(client, "rehearse", plan=free)
        assert result["safe"], result
        assert [step["status"] for step in result["steps"]] == ["SUCCEEDED", "SUCCEEDED"]
        assert result["path"][-1] == pytest.approx([1.0, 0.5], abs=0.15)
        (placed,) = served.desk.stage.robots
        served.desk.stage.add_obstacle(placed.pose.compose(Pose(0.9, 0.0)))
        result = await call(client, "rehearse", plan=[{"do": "drive", "x": 1.0, "seconds": 2.0}])
        assert not result["safe"]
        assert {hit["what"] for hit in result["hits"]} == {"a box"}
        assert result["hits"][0]["point"][0] < 0.7
        assert "at most 20" in await refusal(client, "rehearse", plan=free * 11)
    assert served.robot[Localization].pose == before
