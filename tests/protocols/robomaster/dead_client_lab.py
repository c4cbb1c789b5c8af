"""Run by test_client_watch.py as root of a network of its own: a robot, a client on a cable, the cable cut.

argv[1]: the groups that may send echo requests ("0 0": ours; empty: no one). Prints how long the robot moved on.
"""

import asyncio
import json
import os
import subprocess
import sys
import time
from pathlib import Path

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import RealClock
from roboglot.model.components.motion.base import Base
from roboglot.protocols.robomaster.config import RoboMasterConfig
from roboglot.protocols.robomaster.server import RoboMasterDoor
from roboglot.storage.database import Database

ROBOT, CLIENT = "10.9.0.1", "10.9.0.2"
DRIVE = f"""
import socket, time
robot = socket.create_connection(("{ROBOT}", 40923))
for command in (b"command;", b"chassis speed x 0.4;"):
    robot.sendall(command)
    assert robot.recv(64) == b"ok;"
print("drives", flush=True)
time.sleep(60)
"""


def run(*words: str) -> None:
    subprocess.run(words, check=True)


async def until(reached, seconds: float) -> float:
    """Return the seconds until ``reached``."""
    began = time.monotonic()
    while not reached():
        if time.monotonic() - began > seconds:
            raise TimeoutError
        await asyncio.sleep(0.005)
    return time.monotonic() - began


async def main(cable: str) -> None:
    database = Database(":memory:")
    fleet = build_fleet("empty", [RobotConfig(body="robomaster_ep")], clock=RealClock(), seed=1, database=database)
    await fleet.start(wait=True)
    robot = fleet.robots["a"]
    door = RoboMasterDoor(robot, ROBOT, RoboMasterConfig())
    await door.start()
    client = await asyncio.create_subprocess_exec(
        "nsenter", "-t", cable, "-n", sys.executable, "-c", DRIVE, stdout=asyncio.subprocess.PIPE
    )
    reported = {}
    try:
        assert client.stdout
        assert await client.stdout.readline() == b"drives\n"
        await until(lambda: robot[Base].velocity.x > 0.35, 5)
        await asyncio.sleep(1.5)
        reported["alive"] = robot[Base].velocity.x
        run("nsenter", "-t", cable, "-n", "ip", "link", "set", "vb", "down")
        reported["ordered"] = await until(lambda: not robot.actions.running() or robot[Base].velocity.x < 0.3, 6)
        reported["stopped"] = reported["ordered"] + await until(lambda: robot[Base].velocity.speed < 0.02, 2)
        reported["forgotten"] = reported["stopped"] + await until(lambda: not door.context.active, 8)
    finally:
        client.kill()
        await client.wait()
        await door.close()
        await fleet.close()
        database.close()
    print(json.dumps(reported))


if sys.argv[1]:
    Path("/proc/sys/net/ipv4/ping_group_range").write_text(sys.argv[1])
with subprocess.Popen(["unshare", "-n", "sleep", "60"]) as holder:
    try:
        while os.readlink(f"/proc/{holder.pid}/ns/net") == os.readlink("/proc/self/ns/net"):
            time.sleep(0.01)
        run("ip", "link", "set", "lo", "up")
        run("ip", "link", "add", "va", "type", "veth", "peer", "name", "vb", "netns", str(holder.pid))
        run("ip", "addr", "add", f"{ROBOT}/24", "dev", "va")
        run("ip", "link", "set", "va", "up")
        run("nsenter", "-t", str(holder.pid), "-n", "ip", "addr", "add", f"{CLIENT}/24", "dev", "vb")
        run("nsenter", "-t", str(holder.pid), "-n", "ip", "link", "set", "vb", "up")
        asyncio.run(main(str(holder.pid)))
    finally:
        holder.kill()
