"""A phone's app: calls the robot over mutual TLS and is called back. Knows only the service's .proto."""

from __future__ import annotations

import asyncio
import json
import math
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import grpc

from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2_grpc as service

PATIENCE = 300.0  # s: the machine may be busy
TASK, STOP, POSE, FRAME_DOWN, FRAME_UP = 6004, 6009, 6005, 2002, 2001
NAVIGATE, RELOCALISE = 1, 7


class Phone(service.GrpcAppServicer):
    """``certificates`` is a folder with ca-cert.pem, client-cert.pem and client-key.pem."""

    def __init__(self, address: str, certificates: Path, port: int = 50052) -> None:
        ca, certificate, key = (
            (certificates / f"{n}.pem").read_bytes() for n in ("ca-cert", "client-cert", "client-key")
        )
        self._server_credentials = grpc.ssl_server_credentials([(key, certificate)], ca, require_client_auth=True)
        options = [("grpc.ssl_target_name_override", "cyberdog2.server")]
        credentials = grpc.ssl_channel_credentials(ca, key, certificate)
        self._channel = grpc.aio.secure_channel(f"{address}:{port}", credentials, options=options)
        self._robot = service.GrpcAppStub(self._channel)
        self._server = grpc.aio.server()
        self._pushed: dict[int, object] = {}
        self._arrived = asyncio.Condition()
        self._frames: asyncio.Queue[Any] = asyncio.Queue()
        self.port = 0

    async def open(self) -> None:
        """Serve the app's side on a free port."""
        service.add_GrpcAppServicer_to_server(self, self._server)
        self.port = self._server.add_secure_port("127.0.0.1:0", self._server_credentials)
        await self._server.start()

    async def close(self) -> None:
        """Hang up and stop serving."""
        await self._channel.close()
        await self._server.stop(None)

    async def heartbeat(self, _request: object, _context: object) -> object:
        """Receive the heartbeat of the robot, twice a second."""
        return pb.Result(result="ok")

    async def sendMsg(  # noqa: N802 - the service's name
        self, request: pb.SendRequest, _context: grpc.aio.ServicerContext
    ) -> AsyncIterator[pb.RecResponse]:
        """Receive a report that the robot pushes."""
        async with self._arrived:
            self._pushed[request.nameCode] = json.loads(request.params)
            self._arrived.notify_all()
        if request.nameCode == FRAME_UP:
            self._frames.put_nowait(json.loads(request.params))
        yield pb.RecResponse(nameCode=request.nameCode, data="{}")

    async def ask(self, code: int, parameters: object) -> list[object]:
        """Send a message down; all its answers."""
        request = pb.SendRequest(nameCode=code, params=json.dumps(parameters))
        async with asyncio.timeout(PATIENCE):
            return [json.loads(answer.data or "{}") async for answer in self._robot.sendMsg(request)]

    async def next_push(self, code: int) -> Any:
        """Return the next push of ``code``."""
        async with self._arrived, asyncio.timeout(PATIENCE):
            self._pushed.pop(code, None)
            await self._arrived.wait_for(lambda: code in self._pushed)
            return self._pushed[code]

    async def relocalise(self) -> None:
        """Make the dog find itself in its map; its reports begin."""
        self._check(await self.ask(TASK, {"type": RELOCALISE, "outdoor": False}), "relocalisation")

    async def navigate(self, x: float, y: float, yaw: float) -> None:
        """AB navigation to a point of the map."""
        answers = await self.ask(TASK, {"type": NAVIGATE, "goalX": x, "goalY": y, "theta": yaw})
        self._check(answers, "navigation")

    async def leave_navigation(self) -> None:
        """Stop localisation and its reports."""
        await self.ask(STOP, {"type": 0})

    async def pose(self) -> tuple[float, float, float]:
        """x, y in m and yaw in rad, from the dog's own report."""
        push = await self.next_push(POSE)
        return push["px"], push["py"], 2 * math.atan2(push["qz"], push["qw"])

    async def run(self, body: str) -> list[str]:
        """Save and run a block program as the app does; the ids of the blocks that it went through."""
        task = {
            "type": "task",
            "target_id": ["tour"],
            "mode": "single",
            "condition": "now",
            "style": "",
            "describe": "",
        }
        await self._frame({**task, "id": "1", "operate": "save", "body": body})
        await self._frame({**task, "id": "2", "operate": "run", "body": ""})
        blocks = []
        async with asyncio.timeout(PATIENCE):
            while (frame := await self._frames.get())["feedback"]["operate"] != "stop":
                if frame.get("block", {}).get("type") == "begin":
                    blocks.append(frame["block"]["id"])
        return blocks

    async def _frame(self, frame: dict[str, object]) -> None:
        """Send a frame and wait for the feedback that carries its id."""
        await self.ask(FRAME_DOWN, frame)
        async with asyncio.timeout(PATIENCE):
            while (feedback := (await self._frames.get())["feedback"])["id"] != frame["id"]:
                pass
        if feedback["state"] != 0:
            raise RuntimeError(f"{frame['operate']} was refused: {feedback['state']} {feedback['describe']}")

    @staticmethod
    def _check(answers: list[Any], what: str) -> None:
        if not answers or answers[-1].get("result") != 0:
            raise RuntimeError(f"{what} failed: {answers}")
