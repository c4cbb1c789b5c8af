"""Send a block program to the robot as the phone's app does, run it, and print the frames that come back.

    .venv/bin/roboglot certs --export phone
    .venv/bin/python examples/block_program.py                  # the program below
    .venv/bin/python examples/block_program.py my_program.py

The app is a gRPC server too: the robot calls it on port 8981 of the address that the request came from.
"""

import json
import os
import queue
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import grpc

from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2_grpc as service

TO_APP, TO_ROBOT, STATUS = 2001, 2002, 10001
PATIENCE = 120.0  # s
PROGRAM = """
cyberdog.task.block('walk');
cyberdog.motion.go_straight(0.3, 0.0, 1.0);
print(cyberdog.bms.data.batt_soc, '% left')
"""


class App(service.GrpcAppServicer):
    """The app's services for the robot: heartbeats show that it has found the app, pushes bring frames."""

    def __init__(self) -> None:
        self.found: queue.Queue[None] = queue.Queue()
        self.frames: queue.Queue[dict[str, Any]] = queue.Queue()

    def heartbeat(self, _request: Any, _context: Any) -> Any:
        self.found.put(None)
        return pb.Result()

    def sendMsg(self, request: Any, _context: Any) -> Any:  # noqa: N802 - the service's name
        if request.nameCode == TO_APP:
            self.frames.put(json.loads(request.params))
        yield pb.RecResponse(nameCode=request.nameCode)


def run(program: str) -> None:
    """Save ``program`` as task "example", run it, print frames until it has ended."""
    ca, certificate, key = (
        Path("phone", f"{name}.pem").read_bytes() for name in ("ca-cert", "client-cert", "client-key")
    )
    app, server = App(), grpc.server(ThreadPoolExecutor(1))  # one thread, so that events stay in order
    service.add_GrpcAppServicer_to_server(app, server)
    server.add_secure_port("127.0.0.1:8981", grpc.ssl_server_credentials([(key, certificate)], ca, True))
    server.start()
    credentials = grpc.ssl_channel_credentials(ca, key, certificate)
    options = [("grpc.ssl_target_name_override", "cyberdog2.server")]
    with grpc.secure_channel(f"{os.environ.get('ROBOT', '127.0.0.1')}:50052", credentials, options) as channel:
        robot = service.GrpcAppStub(channel)
        list(robot.sendMsg(pb.SendRequest(nameCode=STATUS, params="{}")))  # tells the robot our address
        app.found.get(timeout=PATIENCE)
        for operate in ("save", "run"):
            frame = {"type": "task", "id": operate, "operate": operate, "target_id": ["example"]}
            if operate == "save":
                frame |= {"mode": "single", "condition": "now", "body": program}
            list(robot.sendMsg(pb.SendRequest(nameCode=TO_ROBOT, params=json.dumps(frame))))
        while True:
            answer = app.frames.get(timeout=PATIENCE)
            print(json.dumps(answer, ensure_ascii=False), flush=True)
            feedback = answer["feedback"]
            if feedback["operate"] == "stop" or feedback["state"] != 0:
                break
    server.stop(None).wait()


if __name__ == "__main__":
    try:
        run(Path(sys.argv[1]).read_text() if len(sys.argv) > 1 else PROGRAM)
    except FileNotFoundError as missing:
        sys.exit(f"{missing.filename} is missing; certificates: .venv/bin/roboglot certs --export phone")
    except RuntimeError as error:  # another app has the port
        sys.exit(str(error))
    except queue.Empty:
        sys.exit(f"nothing came from the robot for {PATIENCE:.0f} s")
    except grpc.RpcError as error:
        sys.exit(f"the robot did not answer: {error.details()}")
