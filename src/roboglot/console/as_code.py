"""An exchange as a line for a terminal or as Python code that repeats it."""

from __future__ import annotations

import json
import shlex
from itertools import pairwise

from roboglot.console.wire_log import readable
from roboglot.model.errors import InvalidGoal
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols.door import Endpoint
from roboglot.values import dataclass

LABELS = {  # names of the endpoint for requests, by door
    "slamware": "Slamware REST",
    "robomaster": "RoboMaster text SDK",
    "cyberdog": "CyberDog 2 gRPC",
    "visual": "block programs",
}
FORMS = {
    "slamware": ("curl", "python"),
    "robomaster": ("nc", "python"),
    "cyberdog": ("grpcurl", "python"),
    "visual": ("websocat", "python"),
}


@dataclass(frozen=True, slots=True)
class Request:
    """A REST request from the tap: method, path with query, body."""

    method: str
    path: str
    body: bytes


def copy(exchange: Exchange, form: str, endpoint: Endpoint) -> str:
    """Return ``exchange`` in ``form`` for a client of the door at ``endpoint``.

    Raises InvalidGoal for an exchange that is not a request, and for a form that the door lacks.
    """
    if exchange.direction is not Direction.REQUEST:
        raise InvalidGoal("only a request can be sent again")
    if form not in FORMS.get(exchange.door, ()):
        raise InvalidGoal(f"the {exchange.door} door has no form {form!r}")
    address = endpoint.address.removeprefix("tcp ")
    match exchange.door, form:
        case "slamware", "curl":
            return _curl(rest(exchange.payload), address)
        case "slamware", _:
            return _rest_python(rest(exchange.payload), address)
        case "robomaster", "nc":
            return _netcat(exchange, address)
        case "robomaster", _:
            return _text_python(exchange, address)
        case "cyberdog", "grpcurl":
            return _grpcurl(exchange, endpoint)
        case "cyberdog", _:
            return _dog_python(exchange, endpoint)
        case _, "websocat":
            return f"printf '%s\\n' {shlex.quote(readable(exchange.payload))} | websocat -n1 {address}"
        case _:
            return _frame_python(exchange, address)


def rest(payload: bytes) -> Request:
    """Split a REST request."""
    head, _, body = payload.partition(b"\n\n")
    method, _, path = head.decode("utf-8", "replace").partition(" ")
    return Request(method, path, body)


def _curl(request: Request, address: str) -> str:
    parts = ["curl", "-sS"] if not set("[]{}") & set(request.path) else ["curl", "-sS", "--globoff"]
    if request.method != "GET":
        parts += ["-X", request.method]
    if request.body:
        parts += ["-H", "Content-Type: application/json", "--data-raw", readable(request.body)]
    return shlex.join([*parts, address + request.path])


def _rest_python(request: Request, address: str) -> str:
    body = f", data={request.body!r}, headers={{'Content-Type': 'application/json'}}" if request.body else ""
    return (
        "from urllib.error import HTTPError\nfrom urllib.request import Request, urlopen\n\n"
        f"request = Request({address + request.path!r}, method={request.method!r}{body})\n"
        "try:\n    answer = urlopen(request)\nexcept HTTPError as refusal:\n    answer = refusal\n"
        "with answer:\n    print(answer.status, answer.read().decode())\n"
    )


def _sdk(exchange: Exchange) -> str:
    """Return the command, preceded by ``command;``, which enters SDK mode."""
    text = readable(exchange.payload).strip().rstrip(";")
    return "command;" if text == "command" else f"command;{text};"


def _netcat(exchange: Exchange, address: str) -> str:
    host, _, port = address.rpartition(":")
    return f"printf '%s' {shlex.quote(_sdk(exchange))} | nc -w 5 {host} {port}"


def _text_python(exchange: Exchange, address: str) -> str:
    host, _, port = address.rpartition(":")
    command = _sdk(exchange)
    return (
        "import socket\n\n"
        f"with socket.create_connection(({host!r}, {port}), timeout=10) as robot:\n"
        f"    robot.sendall({command.encode()!r})\n"
        "    answers = b''\n"
        f"    while answers.count(b';') < {min(command.count(';'), 2)} and (more := robot.recv(4096)):\n"
        "        answers += more\n"
        "    print(answers.decode())\n"
    )


def _grpcurl(exchange: Exchange, endpoint: Endpoint) -> str:
    message = json.dumps({"nameCode": int(exchange.operation or 0), "params": readable(exchange.payload)})
    tool = endpoint.try_line.partition(" -d ")[0]  # with this robot's certificates
    return f"{tool} -d {shlex.quote(message)} {endpoint.address} grpcapi.GrpcApp/sendMsg"


def _dog_python(exchange: Exchange, endpoint: Endpoint) -> str:
    words = shlex.split(endpoint.try_line)
    proof = {word: value for word, value in pairwise(words) if word in ("-cacert", "-key", "-cert", "-authority")}
    opening = f"grpc.insecure_channel({endpoint.address!r})"
    keys = ""
    if "-authority" in proof:  # the robot's certificate contains its name, not its address
        files = [proof[word] for word in ("-cacert", "-key", "-cert")]
        keys = (
            f"pem = [pathlib.Path(file).read_bytes() for file in {files!r}]\n"
            f"options = [('grpc.ssl_target_name_override', {proof['-authority']!r})]\n"
        )
        opening = f"grpc.secure_channel({endpoint.address!r}, grpc.ssl_channel_credentials(*pem), options)"
    return (
        "import pathlib\n\nimport grpc\n\n"
        "from roboglot.wire.cyberdog.proto.cyberdog_app_pb2 import SendRequest\n"
        "from roboglot.wire.cyberdog.proto.cyberdog_app_pb2_grpc import GrpcAppStub\n\n"
        f"{keys}with {opening} as channel:\n"
        f"    request = SendRequest(nameCode={int(exchange.operation or 0)}, params={readable(exchange.payload)!r})\n"
        "    for answer in GrpcAppStub(channel).sendMsg(request):\n        print(answer.nameCode, answer.data)\n"
    )


def _frame_python(exchange: Exchange, address: str) -> str:
    return (
        "import asyncio\n\nfrom websockets.asyncio.client import connect  # pip install websockets\n\n\n"
        "async def main():\n"
        f"    async with connect({address!r}) as robot:\n"
        f"        await robot.send({readable(exchange.payload)!r})\n"
        "        print(await robot.recv())\n\n\nasyncio.run(main())\n"
    )
