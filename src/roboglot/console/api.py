"""The console's interface for scripts and agents: robots, their verbs, the world's verbs, the wire, the camera."""

from __future__ import annotations

import asyncio

import msgspec

from roboglot.console import drawings, program_runs
from roboglot.console.as_code import FORMS, LABELS, copy
from roboglot.console.camera import Calls, send_film, send_photo, send_sound
from roboglot.console.desk import CLIENT, Desk
from roboglot.console.http import Problem, Receive, Scope, Send, answer, answer_json, read_as, read_json
from roboglot.console.openapi import document
from roboglot.console.people.classes import Classes, ClassRequest
from roboglot.console.recordings.running import RecordingRequest, Recordings
from roboglot.console.resend import resend
from roboglot.console.state import link_of
from roboglot.console.studio import blocks, lessons, plans
from roboglot.console.thumbnails import thumbnail
from roboglot.console.verbs.maps import map_archive
from roboglot.console.wire_log import readable
from roboglot.model.admission import Right, Unknown
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import (
    Busy,
    ComponentMissing,
    Forbidden,
    InvalidGoal,
    NotFound,
    NotReady,
    Refused,
    RobotError,
    Unconnected,
)
from roboglot.model.robot import Robot
from roboglot.operations import BadParameters
from roboglot.programs.errors import ProgramError
from roboglot.protocols.door import Endpoint

STATUSES: list[tuple[type[Exception], int]] = [
    (BadParameters, 400),
    (InvalidGoal, 400),
    (NotFound, 404),
    (ComponentMissing, 404),
    (NotReady, 503),
    (Unconnected, 503),
    (Forbidden, 403),
    (Busy, 409),
    (Refused, 409),
    (RobotError, 409),
    (ProgramError, 409),
    (ValueError, 400),
]


class _Program(msgspec.Struct, forbid_unknown_fields=True):
    source: str = ""


class _Call(msgspec.Struct, forbid_unknown_fields=True):
    offer: str


class Api:
    """Serves paths below ``/api/``; checks a client's right before it reads the body."""

    def __init__(self, desk: Desk, classes: Classes) -> None:
        self._desk, self._classes = desk, classes
        self.calls = Calls()

    async def serve(self, scope: Scope, receive: Receive, send: Send, client: str) -> None:
        """Answer one request. Raises Problem; Unknown if the client's proof was replaced meanwhile."""
        parts = [part for part in scope["path"].split("/") if part][1:]
        try:
            await self._route(scope["method"], parts, receive, send, client)
        except Unknown:
            raise
        except (RobotError, BadParameters, ProgramError, ValueError) as error:
            status = next(code for kind, code in STATUSES if isinstance(error, kind))
            raise Problem(status, str(error) or type(error).__name__) from None

    async def _route(self, method: str, parts: list[str], receive: Receive, send: Send, client: str) -> None:
        match method, parts:
            case "GET", ["openapi.json"]:
                await answer_json(send, document(self._desk.world.version))
            case "GET", ["blocks"]:
                described = blocks.described()
                await answer(send, 200, b"application/json", described.body, [(b"etag", described.tag.encode())])
            case "GET", ["lessons"]:
                found = await asyncio.to_thread(self._desk.studio.lessons)
                await answer_json(send, lessons.shown(found))
            case "GET", ["class"]:
                await answer_json(send, self._classes.look())
            case "POST", ["class"]:
                if not self._desk.may_teach:
                    with self._desk.noting("class"):
                        self._classes.check_teacher()
                await answer_json(send, await self._classes.do(await read_as(receive, ClassRequest)))
            case "GET" | "POST", ["recording" | "recordings", *_]:
                await self._route_recordings(method, parts, receive, send)
            case _, ["robots", *_]:
                await self._route_robot(method, parts, receive, send, client)
            case _, ["world" | "world.toml", *_]:
                await self._route_world(method, parts, receive, send)
            case _:
                raise _nothing_here()

    async def _route_robot(self, method: str, parts: list[str], receive: Receive, send: Send, client: str) -> None:
        match method, parts:
            case "GET", ["robots"]:
                await answer_json(send, [self._summary(name) for name in self._desk.visible])
            case "GET", ["robots", name]:
                await answer_json(send, self._summary(name) | self._desk.view(name).state())
            case "GET", ["robots", name, "camera.jpg" | "camera.mjpeg" | "sound.wav" | "map.png" | "map.zip" as file]:
                await self._send_file(self._desk.view(name).robot, file, receive, send)
            case "GET", ["robots", name, "wire", number]:
                await answer_json(send, self._exchange(name, number))
            case "GET", ["robots", name, "wire", number, form]:
                await answer(send, 200, b"text/plain; charset=utf-8", self._copied(name, number, form).encode())
            case "POST", ["robots", name, "wire", number, "resend"]:
                await answer_json(send, {"answers": await self._sent_again(name, number)})
            case "POST", ["robots", name, "camera", "call"]:
                robot = self._desk.view(name).robot
                answered = await self.calls.answer(robot, (await read_as(receive, _Call)).offer)
                await answer_json(send, {"answer": answered})
            case ("GET", ["robots", name, "program" as what]) | (
                "POST",
                ["robots", name, "program" | "rehearse" as what],
            ):
                await self._serve_program(method, name, what, receive, send)
            case "POST", ["robots", name, verb]:
                self._desk.admitted(name, verb)
                values = await read_json(receive)
                await answer_json(send, {"result": await self._desk.command(name, verb, values, client)})
            case _:
                raise _nothing_here()

    def _recordings(self) -> Recordings:
        if self._desk.recordings is None:
            raise NotFound("this program cannot record")
        return self._desk.recordings

    async def _route_recordings(self, method: str, parts: list[str], receive: Receive, send: Send) -> None:
        """Serve the recording under way, and those of the data folder, which have all robots in them."""
        recordings = self._recordings()
        if parts == ["recording"]:
            await answer_json(send, await self._serve_recording(recordings, method, receive))
            return
        self._desk.check_all("look at recordings", Right.ADMIN)
        match method, parts:
            case "GET", ["recordings"]:
                await answer_json(send, await recordings.all())
            case "GET", ["recordings", file]:
                await recordings.kept.send(file, send)
            case "GET", ["recordings", file, "watch"]:
                await answer_json(send, await recordings.watching.outline(file))
            case "GET", ["recordings", file, "watch", robot, at, "camera.jpg"]:
                picture = await recordings.watching.picture(file, robot, _seconds(at))
                await answer(send, 200, b"image/jpeg", picture, [(b"cache-control", b"no-store")])
            case "GET", ["recordings", file, "watch", robot, since, seconds]:
                excerpt = await recordings.watching.excerpt(file, robot, _seconds(since), _seconds(seconds))
                await answer(send, 200, b"application/octet-stream", excerpt, [(b"cache-control", b"no-store")])
            case "GET", ["recordings", one, "compared", other, *rest] if len(rest) < 2:
                await recordings.kept.send_comparison(one, other, "".join(rest), send)
            case _:
                raise _nothing_here()

    async def _serve_recording(self, recordings: Recordings, method: str, receive: Receive) -> dict[str, object]:
        for name in self._desk.views:
            self._desk.view(name, "look at the recording")
        if method == "GET":
            return recordings.look()
        self._desk.check_all("record", Right.ADMIN)
        request = await read_as(receive, RecordingRequest)
        with self._desk.noting(f"record {request.do}"):
            return await recordings.do(request)

    async def _serve_program(self, method: str, name: str, what: str, receive: Receive, send: Send) -> None:
        if method == "GET" and what == "program":
            await answer_json(send, await program_runs.program(self._desk, name))
            return
        if method == "GET":
            raise _nothing_here()
        if what == "rehearse":
            plans.admitted(self._desk, name)
            await answer_json(send, await plans.rehearse(self._desk, name, await read_as(receive, plans.Plan)))
        else:
            program_runs.programs_of(self._desk, name, Right.PROGRAM)
            source = (await read_as(receive, _Program)).source
            await answer_json(send, await program_runs.start(self._desk, name, source))

    async def _send_file(self, robot: Robot, file: str, receive: Receive, send: Send) -> None:
        match file:
            case "camera.jpg":
                await send_photo(robot, send)
            case "camera.mjpeg":
                await send_film(robot, receive, send)
            case "sound.wav":
                await send_sound(robot, receive, send)
            case "map.png":
                picture = await asyncio.to_thread(thumbnail, robot[Mapping].grid, robot[Localization].pose)
                await answer(send, 200, b"image/png", picture, [(b"cache-control", b"no-store")])
            case "map.zip":
                packed = await map_archive(robot)
                kept = (b"content-disposition", b'attachment; filename="map.zip"')
                await answer(send, 200, b"application/zip", packed, [kept])

    async def _route_world(self, method: str, parts: list[str], receive: Receive, send: Send) -> None:
        match method, parts:
            case "GET", ["world"]:
                for name in self._desk.views:
                    self._desk.view(name, "look at the world")
                stage = self._desk.stage
                await answer_json(
                    send, {"floors": drawings.plans_of(stage)} | drawings.truth_of(stage) | self._made_of()
                )
            case "GET", ["world.toml"]:
                kept = (b"content-disposition", b'attachment; filename="world.toml"')
                await answer(send, 200, b"application/toml", self._desk.world_file().encode(), [kept])
            case "POST", ["world", verb]:
                self._desk.world_operation(verb)
                values = await read_json(receive)
                await answer_json(send, {"result": await self._desk.change_world(verb, values)})
            case _:
                raise _nothing_here()

    def _made_of(self) -> dict[str, object]:
        """Return the world's name, seed and bodies, from which a copy can be built."""
        world = self._desk.world
        return {"world": world.name, "seed": world.seed, "bodies": dict(world.bodies)}

    def _summary(self, name: str) -> dict[str, object]:
        view = self._desk.view(name)
        x, y, yaw, *speed = view.motion
        return {"name": name, "pose": [x, y, yaw], "velocity": speed, "link": link_of(view.robot)}

    def _exchange(self, name: str, number: str) -> dict[str, object]:
        exchange = self._desk.view(name).wire.get(_whole(number))
        kept = exchange._asdict() | {"payload": readable(exchange.payload), "forms": FORMS.get(exchange.door, ())}
        return {key: str(value) if key == "direction" else value for key, value in kept.items()}

    def _copied(self, name: str, number: str, form: str) -> str:
        exchange = self._desk.view(name).wire.get(_whole(number))
        return copy(exchange, form, self._endpoint(name, exchange.door))

    async def _sent_again(self, name: str, number: str) -> object:
        view = self._desk.view(name)
        # The door sees a local client instead of the person at the page, so this requires ADMIN.
        view.robot.admission.check(CLIENT, "send a request again", Right.ADMIN)
        exchange = view.wire.get(_whole(number))
        with view.robot.admission.noting(CLIENT, "send a request again"):
            return await resend(exchange, self._endpoint(name, exchange.door))

    def _endpoint(self, name: str, door: str) -> Endpoint:
        listed = self._desk.doors().get(name, ())
        endpoint = next((e for e in listed if e.label == LABELS.get(door)), None)
        if endpoint is None:
            raise NotFound(f"the {door} door of robot {name} is closed")
        return endpoint


def _nothing_here() -> Problem:
    return Problem(404, "there is nothing here; /api/openapi.json lists what there is")


def _whole(text: str) -> int:
    if not text.isdecimal() or len(text) > 12:
        raise NotFound(f"{text!r} is not the number of an exchange")
    return int(text)


def _seconds(milliseconds: str) -> float:
    if not milliseconds.isdecimal() or len(milliseconds) > 12:
        raise BadParameters(f"{milliseconds!r} is not a time in whole milliseconds")
    return int(milliseconds) / 1000.0
