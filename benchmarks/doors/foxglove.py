"""Cost of viewers: share of a core for robots whose topics a viewer follows at the Foxglove door.

scripts/bench foxglove [robots] [seconds]
"""

from __future__ import annotations

import asyncio
import resource
import statistics
import sys
import tempfile
import time
from dataclasses import replace

from _claim import Claims

from roboglot.config import ConsoleConfig, RobotConfig, load_config, with_addresses
from roboglot.runtime import Runtime

FOLLOWED = ("pose", "battery", "body", "faults", "actions")  # and /tf: 10 Hz poses and what changes
VIEWER = """
import asyncio, json, sys
from websockets.asyncio.client import connect

async def look(address):
    async with connect(f"ws://{address}:8765", subprotocols=["foxglove.sdk.v1"], max_size=None) as socket:
        number = 0
        async for message in socket:
            if isinstance(message, str) and json.loads(message)["op"] == "advertise":
                for channel in json.loads(message)["channels"]:
                    if channel["topic"].rpartition("/")[2] in sys.argv[1].split(",") + ["tf"]:
                        number += 1
                        wish = {"op": "subscribe", "subscriptions": [{"id": number, "channelId": channel["id"]}]}
                        await socket.send(json.dumps(wish))

async def main():
    await asyncio.gather(*(look(address) for address in sys.argv[2:]))

asyncio.run(main())
"""


def processor() -> float:
    """Seconds that this program has used."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


async def share(seconds: float) -> float:
    """Return the share of a core that is used now."""
    before, began = processor(), time.monotonic()
    await asyncio.sleep(seconds)
    return (processor() - before) / (time.monotonic() - began)


async def main(robots: int, seconds: float) -> None:
    """Measure with and without viewers in turns, so that both see the same machine."""
    claims = Claims()
    with tempfile.TemporaryDirectory() as folder:
        base = load_config(None, {"data": folder, "world": "office"})
        placed = with_addresses(tuple(RobotConfig(f"r{number}", "robomaster_ep") for number in range(robots)))
        runtime = Runtime(replace(base, robots=placed, console=ConsoleConfig(enabled=False)))
        await runtime.start()
        await asyncio.sleep(5.0)
        differences = []
        for _ in range(5):
            without = await share(seconds)
            command = [sys.executable, "-c", VIEWER, ",".join(FOLLOWED), *(robot.address for robot in placed)]
            viewer = await asyncio.create_subprocess_exec(*command)
            await asyncio.sleep(3.0)
            differences.append(await share(seconds) - without)
            viewer.kill()
            await viewer.wait()
            await asyncio.sleep(1.0)
        await runtime.close()
    claims.at_most(f"core for {robots} robots at 10 Hz", statistics.median(differences) * 100, 5.0, "%")
    claims.finish()


if __name__ == "__main__":
    numbers = [float(word) for word in sys.argv[1:]]
    asyncio.run(main(int(numbers[0]) if numbers else 25, numbers[1] if len(numbers) > 1 else 5.0))
