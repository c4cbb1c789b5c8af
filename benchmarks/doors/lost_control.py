"""Claim: an EP that is driven by the driver stands within 0.5 s of any failure of program or network.

The robot is our text door in a network of its own, behind a router and, for one row, a relay; the program that drives
it is another process on the far side. It makes itself root of a network namespace of its own (`unshare`). Times are
from the fault until the wheels' speed has fallen by a tenth, and until they stand. `lost_control.py drive=speed` shows
the same for velocities, which a robot keeps until they are changed.
"""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from _claim import Claims

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import RealClock
from roboglot.model.components.motion.base import Base
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.storage.database import Database

ROBOT, NEAR, FAR, PROGRAM = "10.9.0.1", "10.9.0.254", "10.8.0.254", "10.8.0.2"
SPEED = 0.4  # m/s
STOPPED = 0.02  # m/s
PATIENCE = 8.0  # s
CLAIMED = 0.5  # s
ROW_SECONDS_MAX = 60.0
DRIVE = f"""
import asyncio, sys
from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import RealClock
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.geometry import Twist
from roboglot.storage.database import Database

async def main():
    database = Database(":memory:")
    robots = [RobotConfig("b", "robomaster://" + sys.argv[1])]
    fleet = build_fleet("empty", robots, clock=RealClock(), seed=1, database=database)
    await fleet.start(wait=True)
    robot = fleet.robots["b"]
    assert robot[Link].state is LinkState.UP, robot[Link].reason
    robot[Driving].drive(Twist(x={SPEED}), source="benchmark")
    print("drives", flush=True)
    await asyncio.sleep(60)

asyncio.run(main())
"""
RELAY = f"""
import asyncio

class Pushes(asyncio.DatagramProtocol):
    def connection_made(self, transport):
        self.transport = transport
    def datagram_received(self, data, address):
        out.sendto(data, ("{PROGRAM}", 40924))

async def relay(reader, writer):
    try:
        while data := await reader.read(65536):
            writer.write(data)
    finally:
        writer.close()

async def main():
    global out
    loop = asyncio.get_running_loop()
    await loop.create_datagram_endpoint(Pushes, local_addr=("{NEAR}", 40924))
    out, _ = await loop.create_datagram_endpoint(asyncio.DatagramProtocol, local_addr=("{FAR}", 0))
    for port in (40921, 40922, 40923, 40925):
        async def accept(reader, writer, port=port):
            far_reader, far_writer = await asyncio.open_connection("{ROBOT}", port, local_addr=("{NEAR}", 0))
            await asyncio.gather(relay(reader, far_writer), relay(far_reader, writer), return_exceptions=True)
        await asyncio.start_server(accept, "{FAR}", port)
    print("ready", flush=True)
    await asyncio.sleep(120)

asyncio.run(main())
"""


class Network:
    """Three namespaces: this one with the robot, a router, and the program's."""

    def __init__(self) -> None:
        self._holders = [subprocess.Popen(["unshare", "-n", "sleep", "300"]) for _ in range(2)]
        own = os.readlink("/proc/self/ns/net")
        for holder in self._holders:
            while os.readlink(f"/proc/{holder.pid}/ns/net") == own:
                time.sleep(0.01)
        self.router, self.program = (str(holder.pid) for holder in self._holders)
        _run("ip link set lo up")
        _run(f"ip link add va type veth peer name vb netns {self.router}")
        _run(f"ip addr add {ROBOT}/24 dev va")
        _run("ip link set va up")
        _run(f"ip route add default via {NEAR}")
        self.at_router(f"ip addr add {NEAR}/24 dev vb")
        self.at_router("ip link set vb up")
        self.at_router(f"ip link add vc type veth peer name vd netns {self.program}")
        self.at_router(f"ip addr add {FAR}/24 dev vc")
        self.at_router("ip link set vc up")
        self.at_router("sysctl -qw net.ipv4.ip_forward=1")
        for command in (f"ip addr add {PROGRAM}/24 dev vd", "ip link set lo up", "ip link set vd up"):
            self.at_program(command)
        self.at_program(f"ip route add default via {FAR}")

    def at_router(self, command: str) -> None:
        _run(f"nsenter -t {self.router} -n {command}")

    def at_program(self, command: str) -> None:
        _run(f"nsenter -t {self.program} -n {command}")

    def close(self) -> None:
        _run("ip link del va")  # namespaces without processes are removed later
        for holder in self._holders:
            holder.kill()
            holder.wait()


def _run(command: str) -> None:
    subprocess.run(command.split(), check=True)


async def _until(reached: Callable[[], bool], begun: float) -> float:
    """s since ``begun``; inf: not in time."""
    while not reached():
        if time.monotonic() - begun > PATIENCE:
            return float("inf")
        await asyncio.sleep(0.005)
    return time.monotonic() - begun


async def _row(name: str, host: str, query: str) -> tuple[float, float]:
    network = Network()
    database = Database(":memory:")
    fleet = build_fleet("empty", [RobotConfig(body="robomaster_ep")], clock=RealClock(), seed=1, database=database)
    await fleet.start(wait=True)
    robot = fleet.robots["a"]
    door = RoboMasterDoor(robot, ROBOT, RoboMasterConfig())
    await door.start()
    relay, program = None, None
    try:
        if host == FAR:
            relay = await _in(network.router, RELAY)
        program = await _in(network.program, DRIVE, f"{host}{query}")
        await _until(lambda: robot[Base].velocity.x > 0.95 * SPEED, time.monotonic())
        await asyncio.sleep(1.2)
        assert robot[Base].velocity.x > 0.9 * SPEED, "it does not drive"
        begun = time.monotonic()
        match name:
            case "packets swallowed":
                network.at_router("sysctl -qw net.ipv4.ip_forward=0")
            case "relay stalls, TCP alive" if relay:
                relay.send_signal(signal.SIGSTOP)
            case "program frozen (SIGSTOP)":
                program.send_signal(signal.SIGSTOP)
            case "program killed":
                program.kill()
            case "cable pulled":
                network.at_program("ip link set vd down")
        ordered = await _until(lambda: robot[Base].velocity.x < 0.9 * SPEED, begun)
        stands = await _until(lambda: robot[Base].velocity.speed < STOPPED, begun)
        return ordered, stands
    finally:
        for process in (program, relay):
            if process and process.returncode is None:
                process.kill()
                await process.wait()
        await door.close()
        await fleet.close()
        database.close()
        network.close()


async def _in(network: str, script: str, *arguments: str) -> asyncio.subprocess.Process:
    """Start a process in that network; return it once it says that it is ready."""
    process = await asyncio.create_subprocess_exec(
        "nsenter", "-t", network, "-n", sys.executable, "-c", script, *arguments, stdout=asyncio.subprocess.PIPE
    )
    assert process.stdout
    assert await process.stdout.readline(), "it ended"
    return process


def main() -> None:
    if os.environ.get("ALONE") != "1":
        alone = ("unshare", "--user", "--map-root-user", "--net")
        sys.exit(subprocess.run([*alone, sys.executable, *sys.argv], env=os.environ | {"ALONE": "1"}).returncode)
    Path("/proc/sys/net/ipv4/ping_group_range").write_text("0 0")
    claims, query = Claims(), "?" + sys.argv[1] if len(sys.argv) > 1 else ""
    rows = {
        "packets swallowed": ROBOT,
        "relay stalls, TCP alive": FAR,
        "program frozen (SIGSTOP)": ROBOT,
        "program killed": ROBOT,
        "cable pulled": ROBOT,
    }
    for name, host in rows.items():
        ordered, stands = asyncio.run(asyncio.wait_for(_row(name, host, query), ROW_SECONDS_MAX))
        claims.at_most(f"{name} (brakes: {ordered:.2f})", stands, CLAIMED, "s")
    claims.finish()


main()
