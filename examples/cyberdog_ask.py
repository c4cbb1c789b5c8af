"""Ask the CyberDog door for something by number and print what it answers.

    .venv/bin/roboglot certs --export phone
    .venv/bin/python examples/cyberdog_ask.py 10001
    .venv/bin/python examples/cyberdog_ask.py 6004 '{"type": 7}'

Certificates come from the folder ``phone``; ROBOT=127.0.0.2 asks another robot.
"""

import os
import sys
from pathlib import Path

import grpc

from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2_grpc as service


def ask(code: int, params: str = "{}") -> None:
    """Print every answer to one request as it comes."""
    ca, certificate, key = (
        Path("phone", f"{name}.pem").read_bytes() for name in ("ca-cert", "client-cert", "client-key")
    )
    credentials = grpc.ssl_channel_credentials(ca, key, certificate)
    options = [("grpc.ssl_target_name_override", "cyberdog2.server")]  # at any address
    with grpc.secure_channel(f"{os.environ.get('ROBOT', '127.0.0.1')}:50052", credentials, options) as channel:
        for answer in service.GrpcAppStub(channel).sendMsg(pb.SendRequest(nameCode=code, params=params)):
            print(answer.data, flush=True)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3) or not sys.argv[1].isdecimal():
        sys.exit(__doc__)
    try:
        ask(int(sys.argv[1]), *sys.argv[2:])
    except FileNotFoundError as missing:
        sys.exit(f"{missing.filename} is missing: .venv/bin/roboglot certs --export phone")
    except grpc.RpcError as error:
        sys.exit(f"the robot did not answer: {error.details()}")
