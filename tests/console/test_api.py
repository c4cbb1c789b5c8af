"""The console's interface for scripts, over HTTP."""

from __future__ import annotations

import asyncio
import io
import json
import socket
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from websockets.asyncio.client import connect

from roboglot.config import AccessConfig, ConsoleConfig, RobotConfig, load_config
from roboglot.console.resend import resend
from roboglot.console.thumbnails import ROBOT, UNKNOWN, thumbnail
from roboglot.console.verbs.clock import CLOCK_VERBS
from roboglot.console.verbs.robots import VERBS
from roboglot.console.verbs.world import WORLD_VERBS
from roboglot.model.clock import LockstepClock, RealClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary, StoredMap
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.components.system.lease import Lease
from roboglot.model.errors import Unconnected
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.tap import Direction, Exchange
from roboglot.operations import BadParameters, OperationTable
from roboglot.protocols.door import Endpoint
from roboglot.runtime import Runtime
from roboglot.simulation.world.world_files import load_world
from tests.console.conftest import ADDRESS, ServedConsole
from tests.protocols.held_fairness import held, until


async def test_a_new_map_is_more_than_the_marker() -> None:
    """Draw no marker where it would cover all."""
    for cells, marked in ((2, False), (40, True)):
        grid = OccupancyGrid(np.zeros((cells, cells), np.int8), 0.05, Point(0.0, 0.0))
        pixels = np.asarray(Image.open(io.BytesIO(thumbnail(grid, Pose(0.05, 0.05)))))
        assert [bool((pixels == colour).all(axis=2).any()) for colour in (ROBOT, UNKNOWN)] == [marked, True]


async def test_request_beyond_its_share_waits_but_to_stop(served: ServedConsole) -> None:
    fairness = held(served.robot)
    fairness.on = True
    asking = asyncio.ensure_future(served.ask("/api/robots"))
    await until(lambda: len(fairness.waited) > 3)
    for verb in ("stop", "pause", "cancel"):
        await served.ask(f"/api/robots/a/{verb}", {})
    assert not asking.done()
    fairness.on = False
    assert (await asking)[0] == 200
    assert set(fairness.counted) == set(fairness.waited)


async def test_one_robot_is_driven_mapped_and_refused(served: ServedConsole) -> None:
    status, robots = await served.ask("/api/robots")
    assert (status, [robot["name"] for robot in robots]) == (200, ["a"])
    status, accepted = await served.ask("/api/robots/a/go_to", {"points": [[1.0, 0.5]], "yaw": 1.57})
    assert status == 200, accepted
    await served.clock.advance(20.0)
    _, state = await served.ask("/api/robots/a")
    assert state["history"][0]["id"] == accepted["result"]["action"]
    assert state["history"][0]["status"] == "SUCCEEDED"
    assert state["history"][0]["client"] == "console 127.0.0.1"
    assert [round(value, 1) for value in state["pose"]] == [1.0, 0.5, 1.6]

    status, id = await served.ask("/api/robots/a/add_place", {"name": "Kitchen", "x": 2, "y": 1})
    assert served.robot[Places].get(id["result"]).pose.x == 2.0
    assert (await served.ask("/api/robots/a"))[1]["drawings"]["places"][0]["name"] == "Kitchen"

    for path, values, expected, words in (
        ("/api/robots/b/stop", {}, 404, "there is no robot 'b'"),
        ("/api/robots/a/dance", {}, 404, "no verb 'dance'"),
        ("/api/robots/a/go_to", {"points": []}, 400, "points must have at least 1 entries"),
        ("/api/robots/a/go_to", [1], 400, "not a JSON object"),
        ("/api/robots/a/go_to", {"points": [[9000, 9000]]}, 400, "not a place on this map: (9000, 9000)"),
        ("/api/robots/a/cancel", {"action": 999}, 404, "no action 999"),
        ("/api/robots/a/pause", {"action": accepted["result"]["action"]}, 409, "navigate to has ended"),
        ("/api/world/inject_fault", {"kind": "low_batery"}, 400, "low_battery"),
        ("/api/world/inject_fault", {"kind": "low_battery", "options": {"charge": "much"}}, 400, "low_battery"),
        ("/api/world/move_thing", {"thing": "x", "x": 0, "y": 0}, 400, "no thing"),
        ("/api/world/add_box", {"x": 3, "y": 2, "floor": 7}, 400, "floor 7 of this world has no place (3, 2, 0)"),
        ("/api/robots/a/stop", {"": 0}, 400, "is unknown"),
    ):
        status, answer = await served.ask(path, values)
        assert (status, words in answer["error"]) == (expected, True), answer


async def test_a_robot_that_restarts_takes_what_holds_only(served: ServedConsole) -> None:
    served.robot[Firmware].reboot()
    await served.clock.advance(1.0)
    for verb, values in (("set_pose", {"x": 1.0, "y": 1.0}), ("clear_map", {}), ("relocalize", {})):
        assert await served.ask(f"/api/robots/a/{verb}", values) == (409, {"error": "the robot restarts"})
    assert (await served.ask("/api/robots/a/emergency_stop", {"engage": True}))[0] == 200
    await served.clock.advance(40.0)
    assert served.robot[EmergencyStop].engaged
    assert (await served.ask("/api/robots/a/set_pose", {"x": 1.0, "y": 1.0}))[0] == 200


async def test_control_taken_by_others_refuses_the_console(served: ServedConsole) -> None:
    await served.robot[Lease].take("robomaster 10.0.0.7")
    status, answer = await served.ask("/api/robots/a/go_to", {"points": [[1, 0]]})
    assert (status, "robomaster 10.0.0.7" in answer["error"]) == (409, True)
    await served.ask("/api/robots/a/take_control", {})
    assert served.robot[Lease].taken_by == "console 127.0.0.1"
    assert (await served.ask("/api/robots/a/go_to", {"points": [[1, 0]]}))[0] == 200


async def test_pages_of_strangers_may_ask_nothing(served: ServedConsole) -> None:
    assert (await served.ask("/api/robots", Origin="http://evil.example"))[0] == 403
    assert (await served.ask("/api/robots/a/stop", {}, Origin="http://evil.example"))[0] == 403
    assert (await served.ask("/", Host="evil.example"))[0] == 403


async def test_the_world_is_changed_by_hand(served: ServedConsole) -> None:
    _, box = await served.ask("/api/world/add_box", {"x": 3, "y": 2, "width": 0.5})
    status, world = await served.ask("/api/world")
    assert status == 200
    assert world["boxes"][str(box["result"])][:2] == [3.0, 2.0]
    assert world["floors"][0]["walls"]
    await served.ask("/api/world/move_box", {"number": box["result"], "x": 2, "y": 2})
    _, tag = await served.ask("/api/world/add_tag", {"text": "5", "x": 3, "y": 1, "yaw": 1.5})
    await served.ask("/api/world/move_tag", {"number": tag["result"], "x": 2, "y": 1})
    _, world = await served.ask("/api/world")
    assert world["boxes"][str(box["result"])][:2] == [2.0, 2.0]
    assert world["tags"][str(tag["result"])] == [2.0, 1.0, 1.5, 0, "5"]
    assert (await served.ask("/api/world/move_box", {"number": 15, "x": 2, "y": 2}))[0] == 404
    await served.ask("/api/world/remove_tag", {"number": tag["result"]})
    await served.ask("/api/world/remove_box", {"number": box["result"]})
    await served.ask("/api/world/place_robot", {"robot": "a", "x": 4, "y": 3})
    _, fault = await served.ask("/api/world/inject_fault", {"kind": "low_battery", "robot": "a"})
    await served.clock.advance(1.0)
    _, world = await served.ask("/api/world")
    assert (world["boxes"], world["tags"]) == ({}, {})
    assert world["robots"]["a"][:2] == [4.0, 3.0]
    assert [f["number"] for f in world["faults"]] == fault["result"]
    _, state = await served.ask("/api/robots/a")
    assert "battery low" in [f["name"] for f in state["faults"]]


async def test_the_description_lists_every_verb(served: ServedConsole) -> None:
    _, described = await served.ask("/api/openapi.json")
    for operation in VERBS:
        entry = described["paths"][f"/api/robots/{{name}}/{operation.key}"]["post"]
        assert entry["summary"].endswith(".")
        assert set(entry["requestBody"]["content"]["application/json"]["schema"].get("properties", {})) == set(
            operation.names
        )
    assert {f"/api/world/{operation.key}" for operation in WORLD_VERBS} <= set(described["paths"])


@pytest.mark.parametrize("table", [VERBS, WORLD_VERBS, CLOCK_VERBS], ids=lambda table: table.name)
def test_no_verb_takes_unknown_parameters(table: OperationTable[str]) -> None:
    """They were ignored: a person placed with ``yaw`` looked elsewhere."""
    for operation in table:
        with pytest.raises(BadParameters, match=r"^nonsense is unknown($|; there are )"):
            operation.parse({"nonsense": 1})


async def test_unknown_parameters_are_refused_with_a_guess(served: ServedConsole) -> None:
    person = {"person": "Ann", "x": 1, "y": 1}
    for path, values, why in (
        ("world/place_person", person | {"degree": 90}, "degree is unknown; did you mean 'degrees'?"),
        ("robots/a/take_control", {"robot": "a"}, "robot is unknown"),
        ("robots/a/stop", {"now": True}, "now is unknown"),
        ("world/place_person", person | {"yaw": 1}, "yaw is unknown; there are person, x, y, degrees"),
        ("world/make_sound", {"x": 1, "y": 1, "sound": "x"}, "sound cannot be 'x'; use one of claps, tone"),
        ("robots/a/program", {"source": "", "sources": "print(1)"}, "sources is unknown; did you mean 'source'?"),
        ("robots/a/rehearse", {"steps": [{"do": "drive"}], "step": []}, "step is unknown; did you mean 'steps'?"),
    ):
        assert await served.ask(f"/api/{path}", values) == (400, {"error": why})


async def test_a_robot_docks_by_the_console(served: ServedConsole) -> None:
    if served.robot[Docking].home is None:
        status, answer = await served.ask("/api/robots/a/dock", {})
        await served.clock.advance(1.0)
        _, state = await served.ask("/api/robots/a")
        assert status == 409 or state["history"][0]["status"] == "ABORTED", answer
        assert state["history"][0]["reason"]


async def test_with_access_the_console_asks_who_comes(tmp_path: Path) -> None:
    base = load_config(None, {"data": str(tmp_path), "world": "empty", "lockstep": True})
    robots = (RobotConfig("a", "universal", ADDRESS),)
    access, console = AccessConfig(on=True, local=False), ConsoleConfig(port=0)
    runtime = Runtime(replace(base, robots=robots, access=access, console=console))
    assert isinstance(runtime.clock, LockstepClock)
    assert runtime.console is not None
    await runtime.start()
    await runtime.console.ready()
    served = ServedConsole(runtime, runtime.fleet.robots["a"], runtime.clock, runtime.console.address)
    assert (await served.ask("/"))[0] == 200  # the log-in page
    assert (await served.ask("/api/robots"))[0] == 401
    assert (await served.ask("/api/robots/a/stop", {}, Authorization="Bearer nothing"))[0] == 401
    await runtime.close()


async def test_maps_are_kept_loaded_exported_and_forgotten(served: ServedConsole) -> None:
    assert (await served.ask("/api/robots/a/save_map", {"map": "x"}))[0] == 409  # nothing has been seen yet
    await served.clock.advance(3.0)
    assert (await served.ask("/api/robots/a/save_map", {"map": " hall "}))[0] == 200
    for unreadable in (" ", "a\nb", "a\0", "\u202ehall"):
        assert (await served.ask("/api/robots/a/save_map", {"map": unreadable}))[0] == 400
        assert (await served.ask("/api/robots/a/add_place", {"name": unreadable, "x": 0, "y": 0}))[0] == 400
        assert (await served.ask("/api/world/add_person", {"name": unreadable, "x": 0, "y": 0}))[0] == 400
    assert (await served.ask("/api/robots/a/maps", {}))[1]["result"] == ["hall"]
    packed = zipfile.ZipFile(io.BytesIO(await served.read("/api/robots/a/map.zip")))
    assert packed.namelist() == ["map.yaml", "map.pgm"]
    assert packed.read("map.pgm").startswith(b"P5\n")
    assert (await served.read("/api/robots/a/map.png")).startswith(b"\x89PNG")
    status, accepted = await served.ask("/api/robots/a/load_map", {"map": "hall"})
    assert status == 200, accepted
    await served.clock.advance(10.0)
    assert (await served.ask("/api/robots/a"))[1]["history"][0]["status"] == "SUCCEEDED"
    assert (await served.ask("/api/robots/a/load_map", {"map": "cellar"}))[0] == 404
    assert (await served.ask("/api/robots/a/remove_map", {"map": "hall"}))[0] == 200
    assert (await served.ask("/api/robots/a/maps", {}))[1]["result"] == []


async def test_a_sound_made_by_hand_is_heard(served: ServedConsole) -> None:
    with served.robot[Microphone].subscribe() as heard:
        x, y, *_ = (await served.ask("/api/world"))[1]["robots"]["a"]
        wish = {"x": x + 1, "y": y, "sound": "tone", "frequency": 440, "seconds": 1}
        assert (await served.ask("/api/world/make_sound", wish))[0] == 200
        await served.clock.advance(0.5)
        assert max(int(abs(block.samples).max()) for block in heard.drain()) > 1000
    assert (await served.ask("/api/world/make_sound", wish | {"seconds": 31}))[0] == 400


async def test_the_world_is_saved_as_it_stands(served: ServedConsole, tmp_path: Path) -> None:
    await served.ask("/api/world/add_box", {"x": 3, "y": 2, "width": 0.5})
    status, text = await served.ask("/api/world.toml")
    assert status == 200
    (tmp_path / "world.toml").write_text(text)
    assert load_world(str(tmp_path / "world.toml")).floors[0].furniture[-1].at == (3.0, 2.0)


async def test_a_lockstep_clock_is_not_steered(served: ServedConsole) -> None:
    status, answer = await served.ask("/api/world/pause_clock", {})
    assert (status, "lockstep" in answer["error"]) == (409, True)


async def test_world_clock_pauses_steps_and_speeds_up(tmp_path: Path) -> None:
    base = load_config(None, {"data": str(tmp_path), "world": "empty"})
    robots = (RobotConfig("a", "universal", ADDRESS),)
    runtime = Runtime(replace(base, robots=robots, doors={}, console=ConsoleConfig(port=0)))
    clock = runtime.clock
    assert isinstance(clock, RealClock)
    assert runtime.console is not None
    desk = runtime.console._desk
    await desk.change_world("pause_clock", {})
    now = clock.time()
    await desk.change_world("step_clock", {"seconds": 0.05})
    await clock.sleep_until(now + 0.05)
    assert clock.time() == now + 0.05
    assert desk.pace == {"lockstep": False, "speed": 1.0, "paused": True, "seed": 1, "behind": 0.0}
    await desk.change_world("resume_clock", {})
    await desk.change_world("set_clock_speed", {"speed": 5})
    assert desk.pace == {"lockstep": False, "speed": 5.0, "paused": False, "seed": 1, "behind": 0.0}
    with pytest.raises(BadParameters):
        await desk.change_world("set_clock_speed", {"speed": 0})
    await runtime.close()


@pytest.mark.parametrize(
    ("door", "operation", "payload", "status"),
    [
        ("slamware", "GET /x", b"GET /api/core/system/v1/power/status\n\n", "200"),
        ("robomaster", "version", b"version", "ok"),
        ("cyberdog", "10001", b"{}", "ok"),
        ("visual", "inquiry", b'{"type": "status", "id": "7", "target_id": [], "operate": "inquiry"}', None),
    ],
)
async def test_a_request_is_sent_again_as_it_was(
    served: ServedConsole, door: str, operation: str, payload: bytes, status: str | None
) -> None:
    wire = served.desk.view("a").wire
    wire.open()
    asked = Exchange(0.0, "a", door, "127.0.0.1:1", door, Direction.REQUEST, operation, payload)
    wire._note(asked)
    code, answer = await served.ask(f"/api/robots/a/wire/{wire.last}/resend", {})
    assert code == 200, answer
    assert status is None or answer["answers"][0][0] == status
    again = [entry.exchange for entry in wire.after(1, 50) if entry.exchange.direction is Direction.REQUEST]
    assert again[-1].payload.rstrip(b";") == payload
    wire.close()


async def test_closed_door_and_excess_requests_are_refused(
    served: ServedConsole, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = Exchange(0.0, "a", "robomaster", "127.0.0.1:1", "x", Direction.REQUEST, "version", b"version")
    with pytest.raises(Unconnected, match="did not answer"):
        await resend(asked, Endpoint("RoboMaster text SDK", "tcp 127.0.0.1:9"))
    monkeypatch.setattr("roboglot.console.resend.RESENDS_MAX", 0)
    wire = served.desk.view("a").wire
    wire.open()
    wire._note(asked)
    status, answer = await served.ask(f"/api/robots/a/wire/{wire.last}/resend", {})
    assert (status, "a moment ago" in answer["error"]) == (409, True)
    wire.close()


async def test_kept_map_is_merged_where_its_walls_fit(served: ServedConsole) -> None:
    await served.clock.advance(2.0)
    whole = served.robot[Mapping].grid.trimmed()
    part = whole.window(whole.origin.x, whole.origin.y, 0.5, 50.0)  # the area behind the robot, and a bit more
    moved = OccupancyGrid(part.log_odds, part.resolution, Point(part.origin.x - 3.0, part.origin.y + 1.0))
    await served.robot[MapLibrary].put(StoredMap("west", moved, 0.0))
    east = whole.window(-0.5, whole.origin.y, 50.0, 50.0)
    served.robot[Mapping].load(east, served.robot[Localization].pose)
    status, answer = await served.ask("/api/robots/a/merge_map", {"map": "west", "x": 2.8, "y": -0.85, "yaw": 0.04})
    assert status == 200, answer
    placed = answer["result"]
    assert (placed["x"], placed["y"], placed["yaw"]) == pytest.approx((3.0, -1.0, 0.0), abs=0.06)
    assert served.robot[Mapping].grid.trimmed().width >= whole.width - 2
    assert (await served.ask("/api/robots/a/merge_map", {"map": "none"}))[0] == 404
    status, answer = await served.ask("/api/robots/a/merge_map", {"map": "west", "x": 9000})
    assert (status, "too far apart" in answer["error"]) == (409, True)


async def test_chance_begins_anew_from_seed_that_is_given(served: ServedConsole) -> None:
    async def scanned(seed: int) -> list[float]:
        status, words = await served.ask("/api/world/reseed", {"seed": seed})
        assert status == 200, words
        await served.clock.advance(0.2)
        scan = served.robot[Lidar].scan
        assert scan is not None
        ranges: list[float] = scan.ranges.tolist()
        return [*ranges, served.robot[Imu].reading.angular_velocity.x]  # drawn for many ticks at once

    served.runtime.fleet.world.stage.add_obstacle(Pose(2.0, 0.0), (0.5, 4.0, 1.0), 0)
    await served.clock.advance(0.2)
    first = await scanned(7)
    assert served.desk.pace["seed"] == 7
    assert await scanned(8) != first
    assert await scanned(7) == first
    status, words = await served.ask("/api/world/reseed", {"seed": -1})
    assert status == 400
    assert "seed" in words["error"]


async def test_answers_leave_at_once(served: ServedConsole) -> None:
    """Without TCP_NODELAY, which asyncio sets on sockets of this protocol only, an answer waits 40 ms for its rest."""
    assert served.runtime.console is not None
    server = served.runtime.console._server
    assert server is not None
    assert {listening.proto for listening in server.sockets} == {socket.IPPROTO_TCP}


async def test_late_page_sees_all_that_is_kept(served: ServedConsole) -> None:
    wire = served.desk.view("a").wire
    wire.open()
    first = wire.last + 1
    for number in range(450):  # more than fits into two messages
        wire._note(Exchange(0.0, "a", "slamware", "c", "x", Direction.REQUEST, f"GET /{number}", b""))
    seen: list[str] = []
    async with connect(served.url.replace("http", "ws") + "/live") as page, asyncio.timeout(60):
        await page.send(json.dumps({"type": "watch", "robot": "a", "wire": True}))
        while len(seen) < 450:
            text = await page.recv()
            message = json.loads(text) if isinstance(text, str) else {}
            if message.get("type") == "wire":
                assert message["skipped"] == 0
                seen += [row[6] for row in message["rows"] if row[0] >= first]
    assert seen == [f"GET /{number}" for number in range(450)]
    wire.close()
