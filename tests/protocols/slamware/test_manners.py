"""Expectations of HTTP clients, and the manual's own examples, across chapters."""

from __future__ import annotations

import logging
import math

import httpx
import pytest

from roboglot.model.components.logistics.delivery import Delivery
from roboglot.model.components.logistics.jack import Jack, JackStage
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.events import BumperPressed, PathBlocked
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.testing import Forward

POSE = "/api/core/slam/v1/localization/pose"
HEALTH = "/api/core/system/v1/robot/health"
EVENTS = "/api/platform/v1/events"
LANDING = "/api/industry/v1/generate_landing_pose"
EXECUTION = "/api/delivery/v1/tasks/:task_execution"
AEB = "/api/core/system/v1/aeb/control"
MAPPING = "/api/core/slam/v1/mapping/:enable"


async def test_landing_pose_matches_the_vendors_example(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    robot[Localization].set_pose(Pose(-0.30318629170993627, -1.9481865254512498, -0.19952716930290038))
    reply = (await client.post(LANDING, json={"distance": 1, "reversed": True})).json()
    assert reply["robot_pose"]["x"] == pytest.approx(-0.30318629, abs=0.02)
    landing = reply["landing_pose"]
    assert (landing["x"], landing["y"]) == pytest.approx((0.676974, -2.146392), abs=0.02)
    assert landing["yaw"] == pytest.approx(2.942065, abs=0.02)
    ahead = (await client.post(LANDING, json={"distance": 1})).json()["landing_pose"]
    assert ahead["yaw"] == pytest.approx(landing["yaw"] - math.pi, abs=0.02)


@pytest.mark.parametrize("body", [{}, {"distance": "1"}, {"distance": 1, "reversed": 1}, {"distance": 1e9}])
async def test_landing_pose_refuses_what_is_no_distance(client: httpx.AsyncClient, body: dict[str, object]) -> None:
    assert (await client.post(LANDING, json=body)).status_code == 400


@pytest.mark.parametrize("body", [{}, {"enable_task_executoin": True}, {"enable_task_execution": "true"}])
async def test_a_misspelt_execution_starts_no_held_robot(
    robot: Robot, client: httpx.AsyncClient, body: dict[str, object]
) -> None:
    assert (await client.put(EXECUTION, json={"enable_task_execution": False})).status_code == 200
    assert (await client.put(EXECUTION, json=body)).status_code == 400
    assert robot[Delivery].executing is False
    assert (await client.put(EXECUTION)).json() == {"enable_task_execution": False}


@pytest.mark.parametrize("value", [1, 0, "true", "On", 1.0, None])
async def test_booleans_are_booleans(client: httpx.AsyncClient, value: object) -> None:
    before = (await client.get(MAPPING)).json()
    assert (await client.put(MAPPING, json={"enable": value})).status_code == 400
    assert (await client.get(MAPPING)).json() is before


async def test_a_whole_float_is_an_integer(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    move = {"action_name": "slamtec.agent.actions.MoveByAction", "options": {"direction": 0.0}}
    assert (await client.post("/api/core/motion/v1/actions", json=move)).status_code == 200


async def test_405_says_what_is_allowed(bare_client: httpx.AsyncClient) -> None:
    reply = await bare_client.post(POSE)
    assert reply.status_code == 405
    assert set(reply.headers["allow"].split(", ")) == {"GET", "PUT", "HEAD", "OPTIONS"}
    assert (await bare_client.get(AEB)).headers["allow"] == "POST, OPTIONS"
    assert (await bare_client.options(AEB)).headers["allow"] == "POST, OPTIONS"
    page = await bare_client.post("/")
    assert (page.status_code, page.headers["allow"]) == (405, "GET, HEAD, OPTIONS")


async def test_head_is_get_without_a_body(bare: Robot, bare_client: httpx.AsyncClient) -> None:
    bare.events.publish(BumperPressed(stamp=1.0, zone="front"))
    for path in (EVENTS, "/", "/openapi.json", "/api/core/system/v1/robot/info"):
        head = await bare_client.head(path)
        assert (head.status_code, head.content) == (200, b""), path
        again = await bare_client.get(path)  # the connection is still in step, and no event is lost
        assert head.headers["content-length"] == again.headers["content-length"] == str(len(again.content))
    assert (await bare_client.head(AEB)).status_code == 405
    assert (await bare_client.head("/nothing")).status_code == 404


async def test_verbose_logs_each_request(bare_client: httpx.AsyncClient, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG, "roboglot.protocols.slamware.dispatch"):
        await bare_client.get(HEALTH)
        await bare_client.get("/api/%1b[31m")
    asked, refused = (record.getMessage() for record in caplog.records if "slamware" in record.name)
    assert asked.startswith(f"robot bare: slamware 127.0.0.1 GET {HEALTH} -> 200, ")
    assert asked.endswith(" ms")
    assert "-> 404" in refused
    assert "Not Found" in refused
    assert refused.isprintable()


@pytest.mark.parametrize(("word", "stage"), [("On", JackStage.UP), ("Off", JackStage.DOWN)])
async def test_the_jack_takes_the_manuals_example(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, word: str, stage: JackStage
) -> None:
    await forward(seconds=1)
    if stage is JackStage.DOWN:
        assert (await client.post("/api/core/system/v1/jack/status", json="Up")).status_code == 200
        await forward(seconds=30)
    assert (await client.post("/api/core/system/v1/jack/status", json=word)).status_code == 200
    await forward(seconds=30)
    assert robot[Jack].stage is stage


async def test_the_stop_flag_and_its_error_change_together(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    stop = robot[EmergencyStop]
    for change in (stop.engage, stop.release, lambda: stop.release_brake(True), lambda: stop.release_brake(False)):
        change()  # no time passes from here to the answer
        health = (await client.get(HEALTH)).json()
        codes = {record["errorCode"] for record in health["baseError"]}
        assert health["hasSystemEmergencyStop"] is stop.engaged is (0x02010100 in codes)
        assert stop.brake_released is (0x02010700 in codes)
        assert health["hasError"] is bool(codes)


async def test_one_obstacle_is_reported_once(
    bare: Robot, bare_door: SlamwareDoor, bare_client: httpx.AsyncClient
) -> None:
    async def go(_: object) -> None:
        await bare.clock.sleep(100)

    action = bare.actions.start("navigate to", go, resources=())
    chair, box = Point(3, 1), Point(6, 1)
    for stamp, at in ((0.0, chair), (0.3, chair), (2.0, Point(3.2, 1.1)), (3.0, box), (4.9, box), (8.1, box)):
        bare.events.publish(PathBlocked(stamp=stamp, action=action, at=at))
    events = (await bare_client.get(EVENTS)).json()
    assert [event["timestamp"] for event in events if event["type"] == "PATH_OCCUPIED"] == ["0", "3000", "8100"]


BAD_REQUESTS = [
    ("DELETE /api/core/system/v1/robot/health/x", None, "Invalid Error Code"),
    ("DELETE /api/core/system/v1/robot/health/7", None, "Invalid Error Code"),
    ("GET /api/core/system/v1/parameter?param=gravity", None, "Parameter is required"),
    ("GET /api/delivery/v1/cargos/a/boxes/x", None, "Invalid BoxId"),
    ("GET /api/multi-floor/map/v1/pois?floor=99", None, "Invalid floor or building"),
    ("POST /api/core/motion/v1/actions", {"action_name": "Fly"}, "Can not create action"),
    ("POST /api/core/system/v1/aeb/control", "Perhaps", "Invalid JSON data"),
    ("POST /api/core/system/v1/jack/status", "Sideways", "Invalid JSON data"),
    ("POST /api/core/system/v1/light/control", {}, "Invalid JSON data"),
    ("PUT /api/core/slam/v1/localization/pose", {"x": 9e4, "y": 0}, "Invalid Argument"),
    ("PUT /api/core/system/v1/network/route", {"priority": "5g"}, "Invalid JSON data"),
    ("PUT /api/core/system/v1/parameter", {"param": "gravity", "value": "1"}, "Bad Request"),
    ("PUT /api/delivery/v1/cargos/a/boxes/0/:kick", None, "Invalid Operation"),
]


async def test_a_bad_request_has_the_manuals_reason(client: httpx.AsyncClient) -> None:
    for request_line, body, reason in BAD_REQUESTS:
        method, _, path = request_line.partition(" ")
        reply = await client.request(method, path, json=body)
        assert (reply.status_code, reply.reason_phrase) == (400, reason), reply.text
        assert reply.text.startswith(f"{reason}: "), request_line
