"""The robot's camera in a browser, by WebRTC: a page, and the few lines of signalling between it and the robot.

    .venv/bin/roboglot certs --export phone
    .venv/bin/python examples/cyberdog_video.py            # then open http://127.0.0.1:8090/

ROBOT=127.0.0.2 shows another robot. The pictures go from the robot to the browser directly; this program passes
offer and answer on, as the robot speaks gRPC and browsers do not.
"""

import asyncio
import contextlib
import json
import os
import sys
import threading
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from roboglot.clients.cyberdog import Certificates, CyberDogClient
from roboglot.clients.errors import ClientError

PAGE = Path(__file__).with_suffix(".html")
BODY_MAX = 100_000
PATIENCE = 30.0  # s


class Page(BaseHTTPRequestHandler):
    """GET / is the page; POST /offer answers an offer; POST /seen reports what the page saw so far."""

    def __init__(self, dog: CyberDogClient, loop: asyncio.AbstractEventLoop, seen: list[Any], *args: Any) -> None:
        self.dog, self.loop, self.seen = dog, loop, seen
        super().__init__(*args)

    def do_GET(self) -> None:
        if self.path == "/":
            self.reply(PAGE.read_bytes(), "text/html; charset=utf-8")
        else:
            self.send_error(404)

    def do_POST(self) -> None:
        try:
            length = max(0, min(BODY_MAX, int(self.headers["Content-Length"] or 0)))
            body = json.loads(self.rfile.read(length))
            if self.path == "/seen":
                self.seen.append(body)
                answer = {}
            else:
                uid, sdp = body["uid"], body["sdp"]
                asking = asyncio.run_coroutine_threadsafe(self.dog.negotiate(uid, sdp), self.loop)
                answer = {"sdp": asking.result(PATIENCE)}
        except (ValueError, KeyError, TypeError):
            self.send_error(400, "an offer is an object with uid and sdp")
        except Exception as error:  # noqa: BLE001 - the page shows it
            self.send_error(502, explain=str(error) or "the robot did not answer in time")
        else:
            self.reply(json.dumps(answer).encode(), "application/json")

    def reply(self, body: bytes, kind: str) -> None:
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        pass


def serve(dog: CyberDogClient, port: int, seen: list[Any]) -> ThreadingHTTPServer:
    """The page at 127.0.0.1, in threads of its own; ``shutdown`` ends it. ``seen`` gets the pages' reports."""
    server = ThreadingHTTPServer(("127.0.0.1", port), partial(Page, dog, asyncio.get_running_loop(), seen))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server


async def main() -> None:
    async with CyberDogClient(os.environ.get("ROBOT", "127.0.0.1"), Certificates.load(Path("phone"))) as dog:
        await dog.found()
        server = serve(dog, 8090, [])
        print(f"http://127.0.0.1:{server.server_port}/", flush=True)
        try:
            await asyncio.Event().wait()
        finally:
            server.shutdown()


if __name__ == "__main__":
    try:
        with contextlib.suppress(KeyboardInterrupt):
            asyncio.run(main())
    except FileNotFoundError as missing:
        sys.exit(f"{missing.filename} is missing: .venv/bin/roboglot certs --export phone")
    except (ClientError, OSError) as error:  # also the page's port in use
        sys.exit(str(error))
