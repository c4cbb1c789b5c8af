"""Claims: >= 3000 short sendMsg/s of a core, >= 0.9 of a bare echo; WebRTC >= 25 pictures/s, first in 2 s, <= 0.5 core.

The bare grpc.aio echo is asked in turns with the robot: same messages and TLS, a handler that does nothing.
The video part needs Chromium, and says so where there is none. Processor time, not the clock, counts.
"""

from __future__ import annotations

import asyncio
import importlib.util
import multiprocessing
import shutil
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import grpc
from _claim import Claims
from _serving import cpu_seconds, idle_share

from roboglot.clients.cyberdog import Certificates, CyberDogClient
from roboglot.protocols.cyberdog.certificates import ensure_certificates
from roboglot.testing.process import ServedRobot, served
from roboglot.wire.cyberdog.channel import ROBOT_NAME, client_options, server_options
from roboglot.wire.cyberdog.chapters.motion.motion import Motion
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2_grpc as service

ADDRESS, ECHO = "127.0.0.176", "127.0.0.177:50052"
APP_PORT = 18983  # not the default, which another robot's app may use
WAIT_MAX, RUN_MAX = 60.0, 300.0  # s: for one step, for all
SECONDS = 6.0
ROUNDS, TURN = 25, 1.0  # s of one turn
AT_ONCE = 64  # requests under way
GEAR = 8013  # a request that reads one value
EXAMPLE = Path(__file__).parents[2] / "examples" / "cyberdog_video.py"
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
OPTIONS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--mute-audio", "--no-first-run")


class _Echo(service.GrpcAppServicer):  # type: ignore[misc]
    async def sendMsg(self, request: Any, context: Any) -> None:  # noqa: N802
        await context.write(pb.RecResponse(nameCode=request.nameCode, data=request.params))


def echo(folder: str) -> None:
    """A process that answers and does nothing else."""
    import uvloop

    async def run() -> None:
        proof = ensure_certificates(Path(folder))
        server = grpc.aio.server(options=server_options())
        service.add_GrpcAppServicer_to_server(_Echo(), server)
        pair = ((proof.key, proof.certificate),)
        server.add_secure_port(ECHO, grpc.ssl_server_credentials(pair, proof.ca, require_client_auth=True))
        await server.start()
        await server.wait_for_termination()

    uvloop.run(run())


def wait_until_idle(robot: ServedRobot) -> None:
    """Wait until the kernels are loaded."""
    for _ in range(40):
        before = robot.cpu_seconds
        time.sleep(1.0)
        if robot.cpu_seconds - before < 0.2:
            return


async def rate(proof: Certificates, target: str, pid: int, idle: float) -> float:
    """Requests a second of the server's processor time, with AT_ONCE under way."""
    credentials = grpc.ssl_channel_credentials(proof.ca, proof.key, proof.certificate)
    async with grpc.aio.secure_channel(target, credentials, options=client_options(ROBOT_NAME)) as channel:
        stub = service.GrpcAppStub(channel)
        count = 0

        async def ask() -> None:
            nonlocal count
            while time.perf_counter() < end:
                async for _ in stub.sendMsg(pb.SendRequest(nameCode=GEAR, params="{}")):
                    count += 1

        async with asyncio.timeout(WAIT_MAX):
            await ask_once(stub)
        began, spent = time.perf_counter(), cpu_seconds(pid)
        end = began + TURN
        async with asyncio.timeout(WAIT_MAX):
            await asyncio.gather(*(ask() for _ in range(AT_ONCE)))
        return count / (cpu_seconds(pid) - spent - idle * (time.perf_counter() - began))


async def ask_once(stub: Any) -> None:
    """Waits until the server is up."""
    async for _ in stub.sendMsg(pb.SendRequest(nameCode=GEAR, params="{}"), wait_for_ready=True):
        pass


async def video(robot: ServedRobot, proof: Certificates, claims: Claims) -> None:
    """Chromium looks at the page of the example while the robot turns."""
    if CHROMIUM is None:
        print("no chromium: the video's claims are not tried")
        return
    spec = importlib.util.spec_from_file_location("cyberdog_video", EXAMPLE)
    assert spec
    assert spec.loader
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    seen: list[Any] = []
    async with CyberDogClient(ADDRESS, proof, app_port=APP_PORT) as dog:
        await dog.found()
        await dog.stand()
        page = example.serve(dog, 0, seen)
        before = cpu_seconds(robot.process.pid)
        await asyncio.sleep(SECONDS)
        idle = (cpu_seconds(robot.process.pid) - before) / SECONDS
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
            command = [CHROMIUM, *OPTIONS, f"--user-data-dir={profile}", f"http://127.0.0.1:{page.server_port}/"]
            quiet = asyncio.subprocess.DEVNULL
            browser = await asyncio.create_subprocess_exec(*command, stdout=quiet, stderr=quiet)
            try:
                async with dog.servo(Motion.TROT_SLOW) as joystick:
                    joystick.set(0.0, 0.0, 0.4)
                    async with asyncio.timeout(WAIT_MAX):
                        while not (seen and seen[-1]["frames"] > 60):  # noqa: ASYNC110
                            await asyncio.sleep(0.2)
                    first, began, spent = seen[-1], time.perf_counter(), cpu_seconds(robot.process.pid)
                    await asyncio.sleep(2 * SECONDS)
                    used = (cpu_seconds(robot.process.pid) - spent) / (time.perf_counter() - began)
            finally:
                browser.kill()
                await asyncio.wait_for(browser.wait(), WAIT_MAX)
                page.shutdown()
    last = seen[-1]
    claims.at_least("pictures a second in Chromium", (last["frames"] - first["frames"]) / (last["seconds"] - first["seconds"]), 25, "/s")  # fmt: skip  # noqa: E501
    claims.at_most("first picture", last["first"] / 1000, 2.0, "s")
    print(f"robot without viewers {idle:.2f} core, walking and filmed {used:.2f}")
    claims.at_most("core for film and walk", used - idle, 0.5, "core")


async def run(robot: ServedRobot, folder: Path, claims: Claims) -> None:
    """Run all parts, one after the other."""
    proof = Certificates.load(folder / "cyberdog" / "tls")
    process = multiprocessing.get_context("spawn").Process(target=echo, args=(str(folder / "cyberdog"),), daemon=True)
    process.start()
    own, idle, pairs = robot.process.pid, await asyncio.to_thread(idle_share, robot.process.pid), []
    try:
        servers = {"bare": (ECHO, process.pid or 0, 0.0), "ours": (f"{ADDRESS}:50052", own, idle)}
        for number in range(ROUNDS):  # the machine's speed changes: short turns, each server first in every other round
            turn = {name: await rate(proof, *servers[name]) for name in sorted(servers, reverse=number % 2 == 1)}
            pairs.append((turn["bare"], turn["ours"]))
    finally:
        process.kill()
        process.join(WAIT_MAX)
    shares = sorted(ours / bare for bare, ours in pairs)
    print("shares of the bare echo, by round:", " ".join(f"{share:.2f}" for share in shares))
    claims.at_least("short sendMsg a core second", statistics.median(ours for _, ours in pairs), 3000, "/s")
    claims.at_least("share of the bare echo", statistics.median(shares), 0.9, "")
    await video(robot, proof, claims)


def main() -> None:
    claims = Claims()
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "data"
        arguments = ("--robot", "a=cyberdog2", "--world", "playground", "--app", f"127.0.0.1:{APP_PORT}")
        with served(data, *arguments, address=ADDRESS) as robot:
            wait_until_idle(robot)
            asyncio.run(asyncio.wait_for(run(robot, data, claims), RUN_MAX))
    claims.finish()


if __name__ == "__main__":
    main()
