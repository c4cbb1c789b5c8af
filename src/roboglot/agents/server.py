"""The tools of an agent. Each is bounded, and refused with a reason like every client's request."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from importlib.metadata import version
from typing import Annotated, Literal, TypeVar

import msgspec
from mcp.server import MCPServer
from mcp.server.mcpserver import Context, Image
from mcp.server.mcpserver.exceptions import ToolError
from mcp.server.mcpserver.tools import Tool
from mcp.shared.exceptions import MCPError
from mcp.types import INVALID_PARAMS, CallToolResult, GetPromptResult, InputRequiredResult
from pydantic import BaseModel, Field, ValidationError

from roboglot.agents.console import ConsoleClient, Refused
from roboglot.agents.refusals import why_refused
from roboglot.spelling import WORD_MAX, instead

T = TypeVar("T")
SECONDS_MAX = 120.0  # a tool's longest wait for an action or a program
LOOK = 0.1  # s between two checks of a running action

# no slash: it would become a path to something else of the console
NAME = Annotated[str, Field(min_length=1, max_length=80, pattern="^[^/]+$")]
Robot = Annotated[NAME | None, Field(description="A name that `robots` lists; needed if there are several.")]
# strict: else the library reads true as 1
Meters = Annotated[float, Field(ge=-10_000, le=10_000, strict=True)]
Speed = Annotated[float, Field(ge=-10, le=10, strict=True)]
Moment = Annotated[float, Field(gt=0, le=2, strict=True)]
Wait = Annotated[
    float, Field(ge=0, le=SECONDS_MAX, strict=True, description="Seconds to wait for its end; 0 returns at once.")
]


class GoTo(BaseModel, extra="forbid"):
    """Drive to a point of the map, around obstacles."""

    do: Literal["go_to"]
    x: Meters
    y: Meters


class Drive(BaseModel, extra="forbid"):
    """Drive with a velocity (m/s ahead, m/s left, rad/s), around nothing, then brake."""

    do: Literal["drive"]
    x: Speed = 0.0
    y: Speed = 0.0
    yaw: Speed = 0.0
    seconds: Moment = 1.0


Plan = Annotated[list[Annotated[GoTo | Drive, Field(discriminator="do")]], Field(min_length=1, max_length=20)]
INSTRUCTIONS = """Robots of roboglot. Positions are metres in the robot's map (x forward, y left where it woke up),
angles radians counter-clockwise. Look first, rehearse, then act. Refusals say why."""


class _Action(msgspec.Struct):
    action: int


class _Begun(msgspec.Struct):
    """The answer to a verb that begins an action."""

    result: _Action


class _Named(msgspec.Struct):
    """One of the listed robots."""

    name: str


class _Faults(msgspec.Struct):
    """The numbers of the faults that were injected."""

    result: list[int]


class _State(msgspec.Struct):
    """State of a robot; the numbers of the pose are None while it is unknown."""

    pose: list[float | None]
    actions: list[dict[str, object]]
    history: list[dict[str, object]]


def make_server(console: ConsoleClient) -> MCPServer:
    """Return the server with all tools over one console."""
    tools = Tools(console)
    listed = (
        tools.robots,
        tools.where_am_i,
        tools.look,
        tools.map_picture,
        tools.go_to,
        tools.drive,
        tools.stop,
        tools.rehearse,
        tools.run_program,
        tools.inject_fault,
        tools.clear_faults,
    )
    exact = [_exact(tool) for tool in listed]
    return ToolServer("roboglot", version=version("roboglot"), instructions=INSTRUCTIONS, tools=exact)


class ToolServer(MCPServer):
    """The library's server with refusals in plain words: it has tools, and no prompts."""

    async def call_tool(
        self, name: str, arguments: dict[str, object], context: Context | None = None
    ) -> CallToolResult | InputRequiredResult:
        """Run a tool. Raises ToolError with the reason."""
        schemas = {tool.name: tool.input_schema for tool in await self.list_tools()}
        if name not in schemas:
            raise ToolError(f"there is no tool {name[:WORD_MAX]!r}{instead(name, schemas)}")
        try:
            return await super().call_tool(name, arguments, context)
        except ToolError as error:
            if isinstance(error.__cause__, ValidationError):
                raise ToolError(why_refused(error.__cause__, arguments, schemas[name])) from None
            raise

    async def get_prompt(self, name: str, *_: object) -> GetPromptResult | InputRequiredResult:
        """Refuse any prompt, as the protocol does for unknown ones; the library would log a traceback."""
        message = f"there is no prompt {name[:WORD_MAX]!r}; this server has tools only"
        raise MCPError(code=INVALID_PARAMS, message=message)


def _exact(function: Callable[..., object]) -> Tool:
    """Return a tool that refuses unknown arguments, which the library ignores."""
    tool = Tool.from_function(function)
    arguments = tool.fn_metadata.arg_model
    arguments.model_config["extra"] = "forbid"
    arguments.model_rebuild(force=True)
    tool.parameters = arguments.model_json_schema()
    return tool


async def _answer_of(answer: Awaitable[T]) -> T:
    """Return the console's answer; its refusal becomes the tool's error."""
    try:
        return await answer
    except Refused as refused:
        raise ToolError(str(refused)) from None


class Tools:
    """One agent's tools. Their docstrings are what the agent reads."""

    def __init__(self, console: ConsoleClient) -> None:
        self._console = console

    async def robots(self) -> list[dict[str, object]]:
        """List the robots with pose [x m, y m, yaw rad] and velocity."""
        found: list[dict[str, object]] = await _answer_of(self._console.get(list, "robots"))
        return found

    async def where_am_i(self, robot: Robot = None) -> dict[str, object]:
        """Return a robot's pose, actions, battery and faults, and who controls it."""
        state: dict[str, object] = await _answer_of(self._console.get(dict, "robots", await self._chosen(robot)))
        keys = ("name", "pose", "velocity", "actions", "control", "faults", "battery", "place", "safety", "body")
        return {key: state[key] for key in keys if key in state}

    async def look(self, robot: Robot = None) -> Image:
        """Take a picture with the robot's camera."""
        return Image(data=await self._picture(robot, "camera.jpg"), format="jpeg")

    async def map_picture(self, robot: Robot = None) -> Image:
        """Draw the robot's map from above, with the robot on it."""
        return Image(data=await self._picture(robot, "map.png"), format="png")

    async def go_to(self, x: Meters, y: Meters, robot: Robot = None, wait: Wait = 60.0) -> dict[str, object]:
        """Drive to a point of the map around obstacles; return the outcome."""
        return await self._act(robot, "go_to", {"points": [[x, y]]}, wait)

    async def drive(
        self,
        x: Speed = 0.0,
        y: Speed = 0.0,
        yaw: Speed = 0.0,
        seconds: Moment = 1.0,
        robot: Robot = None,
    ) -> dict[str, object]:
        """Drive with a velocity (m/s ahead, m/s left, rad/s) for at most 2 s, then brake."""
        values = {"x": x, "y": y, "yaw": yaw, "seconds": seconds}
        return await self._act(robot, "drive", values, seconds + 5.0)

    async def stop(self, robot: Robot = None) -> str:
        """Stop what moves the robot, no matter who began it, and its programs; delivery orders wait for a person."""
        await _answer_of(self._console.post(dict, "robots", await self._chosen(robot), "stop", values={}))
        return "it stands"

    async def rehearse(self, plan: Plan, robot: Robot = None) -> dict[str, object]:
        """Try a plan in a copy of the simulated world first: how each step ends, what the robot would hit, where it
        would go. The robot itself does not move. `safe` is true if all succeeds and nothing is touched."""
        steps = [step.model_dump() for step in plan]
        name = await self._chosen(robot)
        found: dict[str, object] = await _answer_of(
            self._console.post(dict, "robots", name, "rehearse", values={"steps": steps})
        )
        return found

    async def run_program(
        self,
        source: Annotated[str, Field(min_length=1, max_length=65_536)],
        robot: Robot = None,
        wait: Wait = 60.0,
    ) -> dict[str, object]:
        """Run a block program (restricted Python, docs/programs/language.md); its state and the lines it printed."""
        name = await self._chosen(robot)
        run: dict[str, object] = await _answer_of(
            self._console.post(dict, "robots", name, "program", values={"source": source})
        )
        async for _ in _beats(wait):
            run = await _answer_of(self._console.get(dict, "robots", name, "program"))
            if run["state"] not in ("run", "run_wait"):
                break
        return run

    async def inject_fault(
        self,
        kind: Annotated[str, Field(min_length=1, max_length=80)],
        robot: NAME | None = None,
        seconds: Annotated[float, Field(gt=0, le=86_400, strict=True)] | None = None,
    ) -> list[int]:
        """Break something of the simulation on purpose (needs the right to administer); the faults' numbers."""
        values = {"kind": kind, "robot": robot, "duration": seconds}
        return (await _answer_of(self._console.post(_Faults, "world", "inject_fault", values=values))).result

    async def clear_faults(self) -> str:
        """Mend everything that was broken on purpose."""
        await _answer_of(self._console.post(dict, "world", "clear_fault", values={}))
        return "mended"

    async def _chosen(self, robot: str | None) -> str:
        """Return the robot that was named, or the only one. Raises ToolError if there are several."""
        if robot is not None:
            return robot
        names = [one.name for one in await _answer_of(self._console.get(list[_Named], "robots"))]
        if len(names) != 1:
            raise ToolError(f"say which robot{instead('', names)}")
        return names[0]

    async def _picture(self, robot: str | None, file: str) -> bytes:
        return await _answer_of(self._console.fetch("robots", await self._chosen(robot), file))

    async def _act(self, robot: str | None, verb: str, values: Mapping[str, object], wait: float) -> dict[str, object]:
        """Start an action and wait for its end, at most ``wait`` s."""
        name = await self._chosen(robot)
        begun = await _answer_of(self._console.post(_Begun, "robots", name, verb, values=values))
        number = begun.result.action
        seen: dict[str, object] = {"id": number, "status": "ACCEPTED"}
        async for _ in _beats(wait):
            state = await _answer_of(self._console.get(_State, "robots", name))
            listed = [*state.actions, *state.history]
            seen = next((action for action in listed if action["id"] == number), seen)
            if seen["status"] in ("SUCCEEDED", "CANCELED", "ABORTED"):
                break
        pose = (await _answer_of(self._console.get(_State, "robots", name))).pose
        known = {key: seen[key] for key in ("id", "status", "reason") if key in seen}
        return known | {"pose": [None if value is None else round(value, 3) for value in pose]}


async def _beats(seconds: float) -> AsyncIterator[None]:
    """Yield every LOOK s, for ``seconds``; at least once."""
    loop = asyncio.get_running_loop()
    end = loop.time() + seconds
    while True:
        yield
        if loop.time() >= end:
            return
        await asyncio.sleep(LOOK)
