"""Random walks that end with a restart: what clients of three doors wrote has to be there afterwards, of every body.

The map in memory is saved before. The program is closed, or its data are copied while it runs, as a power cut leaves
them.
"""

from __future__ import annotations

import random
import shutil
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from roboglot.model.components.mapping.mapping import Mapping
from tests.protocols.cyberdog.phone import Messages
from tests.protocols.life import ADDRESS, BODIES, Life
from tests.protocols.lockstep import lockstep_runtime
from tests.protocols.slamware.generated import SILENCING, Generator
from tests.protocols.witness import Diary, seeds

STEPS = 60
# They change what a restart resets, or leave no map to be saved.
LEFT_OUT = SILENCING | {
    "PUT /api/core/slam/v1/mapping/:enable",
    "PUT /api/core/slam/v1/loopclosure/:enable",
    "PUT /api/core/sensors/v1/depth/:enable",
    "PUT /api/core/sensors/v1/masks",
    "PUT /api/core/system/v1/parameter",  # a restart resets the limit of the speed, which caps that of lines
    "POST /api/core/system/v1/aeb/control",
    "POST /api/core/system/v1/jack/status",
    "POST /api/core/system/v1/power/:hibernate",
    "PUT /api/core/system/v1/network/route",
    "POST /api/core/firmware/v1/update/:start",
    "POST /api/core/firmware/v1/autoupdate/:start",
    "DELETE /api/multi-floor/map/v1/stcm",
}
MEASURED = (  # begins of paths whose answers are measured, counted since the start, or a log of it
    "/api/core/motion",
    "/api/core/slam/v1/imu",
    "/api/core/slam/v1/knownarea",
    "/api/core/slam/v1/localization",
    "/api/core/slam/v1/maps",
    "/api/core/statistics",
    "/api/core/system/v1/battery",
    "/api/core/system/v1/laserscan",
    "/api/core/system/v1/network",
    "/api/core/system/v1/power",
    "/api/core/system/v1/raw",
    "/api/core/system/v1/robot/health",
    "/api/delivery/v1/events",
    "/api/platform/v1/events",
    "/api/platform/v1/timestamp",
)
PARAMETERS = ["docking.docked_register_strategy"]
FLAGS = ["is_sn", "is_version", "is_nick_name", "is_volume", "is_voice_control", "is_device_model", "uid", "is_uid"]
QUERIES: list[tuple[int, dict[str, Any]]] = [
    (1001, dict.fromkeys(FLAGS, True)),
    (1021, {}),
    (6003, {"mapName": "home"}),
    (6003, {"mapName": "hall"}),
    (8004, {}),
    (8013, {}),
]
Request = tuple[int, dict[str, Any]]


def dog_request(draw: random.Random) -> Request:
    """A request of the dog's app that writes."""
    people, places = ["eva", "adam", "li"], ["home", "hall"]
    label = {"labelName": draw.choice("pqr"), "physicX": draw.randint(0, 5), "physicY": 1.5}
    requests: list[Request] = [
        (1011, {"nick_name": draw.choice(["Rex", "小白", "a" * 9]), "wake_name": draw.choice(["", "ho"])}),
        (1012, {"volume": draw.randint(0, 100)}),
        (1014, {"enable": draw.random() < 0.5}),
        (1020, {"member": draw.choice(people)}),
        (1022, {"member": draw.choice(people)}),
        (1024, {"pre_name": draw.choice(people), "new_name": draw.choice(people)}),
        (3002, {"uid": "7", "token_access": "a", "token_fresh": "b", "token_expires_in": "99999"}),
        (6002, {"mapName": draw.choice(places), "is_outdoor": False, "locationLabelInfo": [label]}),
        (6002, {"mapName": draw.choice(places), "only_delete": True, "locationLabelInfo": [label]}),
        (8011, {"data": draw.randint(0, 2)}),
    ]
    return draw.choice(requests)


def program_request(draw: random.Random) -> dict[str, Any]:
    """An operation on a task or module that writes."""
    if draw.random() < 0.3:
        return {"operate": "delete", "type": draw.choice(["task", "module"]), "target_id": [draw.choice("abc")]}
    id, words = draw.choice("abc"), {"describe": draw.choice(["", "d"]), "style": draw.choice(["", "<s>"])}
    if draw.random() < 0.3:
        words |= {"type": "module", "mode": "common", "condition": f"{id}()", "body": f"def {id}():\n    return 1\n"}
    else:
        words |= {"type": "task", "mode": "cycle", "condition": "0 3 * * *", "body": "print('x')\n"}
    return {"operate": "save", "target_id": [id], **words}


class Keeper:
    """Clients that write at random, and ask what is stored."""

    def __init__(self, life: Life, diary: Diary) -> None:
        self._life, self._diary = life, diary

    async def walk(self, draw: random.Random) -> None:
        """Write at random, wait until all rests, and save the map."""
        generator = Generator(await self._document(), draw.getrandbits(32), exclude=frozenset(LEFT_OUT))
        generator.binaries[:] = [(await self._life.rest("GET", "/api/core/slam/v1/maps/stcm")).content]
        requests = generator.requests()
        for _ in range(STEPS):
            await self._step(draw, generator, requests)
            await self._life.forward(draw.choice([0, 0.1, 1]))
        await self._life.rest("DELETE", "/api/core/motion/v1/actions/:current")
        await self._life.forward(8.0)
        reply = await self._life.rest("POST", "/api/multi-floor/map/v1/stcm/:sync")
        maps = Mapping in self._life.runtime.fleet.robots["a"]
        assert reply.status_code == (200 if maps else 501), reply.text
        await self._life.forward(1.0)

    async def _step(self, draw: random.Random, generator: Generator, requests: Any) -> None:
        kind = draw.random()
        if kind < 0.6:
            request = next(found for found in requests if found.method != "GET" and not found.wrong)
            reply = await self._life.rest(
                request.method, request.url, params=request.params, headers=request.headers, content=request.content
            )
            if reply.status_code < 400:
                self._diary.append((request.key, request.url, request.content and request.content[:200]))
            if reply.headers.get("content-type", "").startswith("application/json"):
                generator.learn(reply.json())
        elif kind < 0.8:
            request = dog_request(draw)
            self._diary.append((*request, await self._life.dog(*request)))
        else:
            words = program_request(draw)
            self._diary.append((words, await self._life.visual(words)))

    async def _document(self) -> dict[str, Any]:
        document: dict[str, Any] = (await self._life.rest("GET", "/openapi.json")).json()
        return document

    async def state(self) -> dict[str, Any]:
        """Return what the three doors say is stored, by question."""
        found: dict[str, Any] = {}
        for path, methods in (await self._document())["paths"].items():
            if "get" in methods and "{" not in path and not path.startswith(MEASURED):
                params = {p["name"]: "1" for p in methods["get"].get("parameters", ()) if p["required"]}
                reply = await self._life.rest("GET", path, params=params)
                found[path] = reply.status_code, reply.content
        for name in PARAMETERS:
            found[name] = (
                await self._life.rest("GET", "/api/core/system/v1/parameter", params={"param": name})
            ).content
        for code, asked in QUERIES:
            found[f"{code} {asked}"] = await self._life.dog(code, asked)
        for kind in ("task", "module"):
            for id in ["", *"abc"]:
                words = {"operate": "inquiry", "type": kind, "target_id": [id]}
                found[f"{kind} {id}"] = await self._life.visual(words)
        return found


def _sockets(folder: str, names: list[str]) -> list[str]:
    return [name for name in names if (Path(folder) / name).is_socket()]


async def live(
    data: Path, body: str, messages: Messages, diary: Diary, use: Callable[[Keeper], Awaitable[None]]
) -> None:
    """Start the program, ``use`` it, and close it."""
    robots = [{"name": "a", "body": body, "address": ADDRESS}]
    runtime = await lockstep_runtime(data, ADDRESS, "slamware", "cyberdog", "visual", robots=robots)
    life = Life(runtime, data, messages)
    try:
        await life.forward(2.0)
        await use(Keeper(life, diary))
    finally:
        await life.close()


@pytest.mark.parametrize("seed", seeds(0, 4))
async def test_data_of_three_doors_outlive_a_restart(seed: int, tmp_path: Path) -> None:
    draw, diary, messages = random.Random(seed), Diary(), Messages(tmp_path)
    body, power_cut = BODIES[seed % len(BODIES)], draw.random() < 0.5
    data, copy = tmp_path / "data", tmp_path / "copy"
    before: dict[str, Any] = {}
    after: dict[str, Any] = {}

    async def write(keeper: Keeper) -> None:
        await keeper.walk(draw)
        before.update(await keeper.state())
        if power_cut:
            shutil.copytree(data, copy, ignore=_sockets)

    async def read(keeper: Keeper) -> None:
        after.update(await keeper.state())

    with diary.writing():
        await live(data, body, messages, diary, write)
        await live(copy if power_cut else data, body, messages, diary, read)
        lost = {key: (value, after[key]) for key, value in before.items() if after[key] != value}
        assert not lost, "\n".join(f"{key}: {was}\n    now {now}" for key, (was, now) in lost.items())
