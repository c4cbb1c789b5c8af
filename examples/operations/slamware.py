"""Uses every operation of the Slamware REST API once, as a client would: ``play`` asks, in an order that makes sense.

``scripts/operations.py`` plays it on a simulated hermes in the office, and writes what was asked and answered into
docs/reference/slamware.md.
"""

from __future__ import annotations

import contextlib
import io
import json
import zipfile
from collections.abc import Callable
from http.client import HTTPConnection
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import quote

HERE = Path(__file__).resolve().parent
MAP = HERE.parent / "maps" / "office.stcm"
START = {"x": 22.5, "y": 8.935, "yaw": 1.571}  # where `roboglot up --robot a=hermes` puts it, in that map
SYSTEM, SLAM, ARTIFACT = "/api/core/system/v1", "/api/core/slam/v1", "/api/core/artifact/v1"
MOTION, FLOORS, DELIVERY = "/api/core/motion/v1", "/api/multi-floor/map/v1", "/api/delivery/v1"
FIRMWARE, INDUSTRY, APPS = "/api/core/firmware/v1", "/api/industry/v1", "/api/core/application/v1/apps"
DOCK, PLACE = "0d0c0000-1f6e-4c43-8a5e-9b3d2f1c0a77", "4b8a7f2c-1f6e-4c43-8a5e-9b3d2f1c0a77"
SECONDS_MAX = 240  # s of robot time for anything awaited


class Stage(Protocol):
    """Events around the robot meanwhile."""

    def wait(self, seconds: float) -> None:
        """Let robot time pass."""

    def break_lidar(self) -> None:
        """Take the scans away, so that health has something to say."""

    def mend(self) -> None:
        """Give them back."""

    def press_call_button(self, place: str) -> None:
        """Call the robot to a place."""


class Client:
    """A client that opens a connection for each request: the robot restarts in between."""

    def __init__(self, address: str, hands: Stage) -> None:
        self.wait = hands.wait
        self._address = address

    def ask(self, method: str, path: str, body: object = None) -> Any:
        """Return the answer, decoded if it is JSON. Raises RuntimeError with the robot's reason."""
        data = body if isinstance(body, bytes) or body is None else json.dumps(body)
        kind = "application/octet-stream" if isinstance(body, bytes) else "application/json"
        link = HTTPConnection(self._address, 1448, timeout=60)
        link.request(method, path, data, {"content-type": kind} if data else {})
        reply = link.getresponse()
        text = reply.read()
        link.close()
        if reply.status >= 400:
            raise RuntimeError(f"{method} {path}: {reply.status} {text.decode()}")
        return json.loads(text) if text and reply.getheader("content-type") == "application/json" else text

    def get(self, path: str) -> Any:
        """Ask for something."""
        return self.ask("GET", path)

    def put(self, path: str, body: object = None) -> Any:
        """Set something."""
        return self.ask("PUT", path, body)

    def post(self, path: str, body: object = None) -> Any:
        """Add or do something."""
        return self.ask("POST", path, body)

    def delete(self, path: str) -> Any:
        """Remove or end something."""
        return self.ask("DELETE", path)

    def act(self, name: str, **options: object) -> int:
        """Begin an action; its id."""
        body = {"action_name": f"slamtec.agent.actions.{name}", "options": options}
        return int(self.post(f"{MOTION}/actions", body)["action_id"])

    def until(self, path: str, comes: Callable[[Any], bool]) -> Any:
        """Poll once a second until it is so; the last answer. A robot that restarts is out of reach meanwhile."""
        answer = None
        for _ in range(SECONDS_MAX):
            with contextlib.suppress(ConnectionError):
                answer = self.get(path)
                if comes(answer):
                    return answer
            self.wait(1)
        raise RuntimeError(f"{path}: {answer} after {SECONDS_MAX} s")

    def done(self, action: int) -> None:
        """Wait for the end of an action."""
        self.until(f"{MOTION}/actions/{action}", lambda found: found["state"]["status"] == 4)


def play(address: str, hands: Stage) -> None:
    """Use everything."""
    client = Client(address, hands)
    client.wait(2)
    floors(client)
    artifacts(client)
    docks(client)
    slam(client)
    motion(client)
    industry(client, hands)
    delivery(client)
    deliver(client)
    devices(client)
    health(client, hands)
    packages(client)
    last(client)


def floors(client: Client) -> None:
    """Save the robot's own map, load the one of the three floors, and ask what is on it."""
    client.post(f"{FLOORS}/stcm/:save")
    client.post(f"{FLOORS}/stcm/:sync")
    client.post(f"{FLOORS}/stcm", MAP.read_bytes())
    client.post(f"{FLOORS}/stcm/:reload", {"pose": START})
    client.wait(2)
    client.get("/api/multi-floor/status")
    ground = client.get(f"{FLOORS}/floors")[0]
    client.get(f"{FLOORS}/floors/:current")
    places = client.get(f"{FLOORS}/pois")
    here = [place["poi_name"] for place in places if place["floor"] == "ground"]
    client.post(f"{FLOORS}/pois/:search_nearby")
    client.post(f"{FLOORS}/pois/:dispatch", here)
    docks = client.get(f"{FLOORS}/homedocks")
    dock = next(dock["id"] for dock in docks if dock["floor"] == "ground")
    client.put(f"{FLOORS}/homedocks/:current", {"dock_id": dock})
    client.get(f"{FLOORS}/homedocks/:current")
    client.post(f"{FLOORS}/homedocks/:search_nearby")
    lift = client.get(f"{FLOORS}/elevators")[0]["elevator_id"]
    client.get(f"{FLOORS}/elevators/{lift}")
    client.get(f"{FLOORS}/elevators/{lift}/pose_relation")
    client.post(f"{ARTIFACT}/lines/tracks", [{"start": {"x": 22.5, "y": 9}, "end": {"x": 22.5, "y": 12}}])
    client.post(f"{FLOORS}/search_path_points", {"end_point": {"x": 22.5, "y": 12}})
    client.delete(f"{ARTIFACT}/lines/tracks")
    client.put("/api/multi-floor/localization/v1/homedock", {"dock_id": dock})
    client.put("/api/multi-floor/localization/v1/pose", {"poi_name": here[0]})
    client.put(f"{FLOORS}/floors/:current", {"building": ground["building"], "floor": "ground", "pose": START})
    client.put(f"{SLAM}/localization/pose", START)
    client.wait(1)


def artifacts(client: Client) -> None:
    """Draw places, lines and areas, change them, and wipe them again."""
    at = {"x": 23, "y": 9.5, "yaw": 0.3}
    client.post(f"{ARTIFACT}/pois", {"id": PLACE, "pose": at, "metadata": {"display_name": "101", "type": "ROOM"}})
    client.get(f"{ARTIFACT}/pois")
    client.get(f"{ARTIFACT}/pois/{PLACE}")
    client.put(f"{ARTIFACT}/pois/{PLACE}", {"metadata": {"display_name": "101b", "type": "ROOM"}})
    client.post(f"{ARTIFACT}/pois/:adjust")
    client.delete(f"{ARTIFACT}/pois/{PLACE}")
    walls = f"{ARTIFACT}/lines/walls"
    client.post(walls, [{"start": {"x": 21, "y": 12}, "end": {"x": 22, "y": 12}}])
    wall = client.get(walls)[0]
    client.put(walls, [wall | {"end": {"x": 21.5, "y": 12}}])
    client.delete(f"{walls}/{wall['id']}")
    client.delete(walls)
    areas = f"{ARTIFACT}/rectangle-areas/forbidden_area"
    box = {"start": {"x": 21, "y": 12}, "end": {"x": 22, "y": 12}, "half_width": 0.4}
    client.post(areas, {"area": box, "metadata": {}})
    area = client.get(areas)[0]["id"]
    client.put(f"{areas}/{area}", {"area": box | {"half_width": 0.3}})
    client.delete(f"{areas}/{area}")
    client.delete(areas)
    marks = f"{ARTIFACT}/laser-landmarks"
    client.put(f"{marks}/:update", {"enable": True})
    client.get(f"{marks}/:update")
    client.put(marks, [{"id": PLACE, "pose": at, "metadata": {}}])
    client.get(marks)
    client.post(f"{marks}/:remove", [PLACE])
    client.delete(marks)


def docks(client: Client) -> None:
    """Name docks, and the place that the robot calls home."""
    client.get(f"{SLAM}/homepose")
    client.put(f"{SLAM}/homepose", {"x": 22.5, "y": 8.3, "z": 0, "yaw": 1.571, "pitch": 0, "roll": 0})
    kept = client.get(f"{SLAM}/homedocks")
    entry = {"id": DOCK, "pose": {"x": 24, "y": 9, "yaw": 3.14}, "metadata": {"display_name": "spare"}}
    client.post(f"{SLAM}/homedocks", entry)
    client.put(f"{SLAM}/homedocks/{DOCK}", {"metadata": {"display_name": "spare dock"}})
    client.delete(f"{SLAM}/homedocks/{DOCK}")
    client.post(f"{SLAM}/homedocks/:register", {"metadata": {"display_name": "here"}})
    client.delete(f"{SLAM}/homedocks")
    client.put(f"{SLAM}/homedocks", kept)


def slam(client: Client) -> None:
    """Its place, its sensors and its map."""
    for path in ("localization/pose", "localization/odopose", "localization/quality", "imu", "knownarea"):
        client.get(f"{SLAM}/{path}")
    for switch in ("localization", "mapping", "loopclosure"):
        before = client.get(f"{SLAM}/{switch}/:enable")
        client.put(f"{SLAM}/{switch}/:enable", {"enable": before})
    client.post(f"{SLAM}/localization/status/:reset")
    client.get(f"{SLAM}/maps/explore?min_x=21&min_y=7&max_x=24&max_y=10")
    client.put(f"{SLAM}/maps/origin", {"new_origin": {"x": 0.05, "y": 0}})
    client.put(f"{SLAM}/maps/origin", {"new_origin": {"x": -0.05, "y": 0}})
    drawn = client.get(f"{SLAM}/maps/stcm")
    client.get(f"{SYSTEM}/laserscan")
    client.put(f"{SLAM}/maps/stcm", drawn)
    client.put(f"{SLAM}/localization/pose", START)
    client.wait(1)


def motion(client: Client) -> None:
    """Go to a point, look how far it is, and stop it."""
    client.get(f"{MOTION}/action-factories")
    client.get(f"{MOTION}/strategies")
    client.put(f"{MOTION}/strategies/:current", {"strategy": client.get(f"{MOTION}/strategies/:current")})
    client.post(f"{MOTION}/:search_path", {"target": {"x": 22.5, "y": 10.5}})
    going = client.act("MoveToAction", target={"x": 22.5, "y": 10.5}, move_options={})
    client.wait(2)
    for path in ("actions/:current", "path", "milestones", "speed", "time"):
        client.get(f"{MOTION}/{path}")
    client.done(going)
    back = client.act("MoveToAction", target={"x": 22.5, "y": 9}, move_options={})
    client.wait(1)
    client.delete(f"{MOTION}/actions/:current")
    client.done(back)


def industry(client: Client, hands: Stage) -> None:
    """A round, and a call that a client carries out."""
    client.post(f"{ARTIFACT}/pois", {"id": PLACE, "pose": {"x": 22.5, "y": 10.5, "yaw": 0}, "metadata": ROOM})
    stops = [{"display_name": "101", "action": "load", "wait_time": 5}]
    client.post(f"{INDUSTRY}/tasks/templates", {"name": "round", "key": "round-1", "action_list": stops})
    client.get(f"{INDUSTRY}/tasks/templates")
    client.post(f"{INDUSTRY}/generate_landing_pose", {"distance": 0.5})
    hands.press_call_button("101")
    call = client.get(f"{INDUSTRY}/tasks?type=carry_calling")[0]
    client.post(f"{INDUSTRY}/tasks/events", {"task_id": call["id"], "status": "RUNNING"})
    client.post(f"{INDUSTRY}/tasks/events", {"task_id": call["id"], "status": "SUCCEEDED"})


ROOM = {"display_name": "101", "type": "ROOM"}


def delivery(client: Client) -> None:
    """Settings of the delivery service."""
    client.put(f"{DELIVERY}/admin/password", {"enable": True, "password": "1234"})
    client.get(f"{DELIVERY}/admin/password")
    for name in ("mode", "language", "working_time", "move_options", "line_speed"):
        found = client.get(f"{DELIVERY}/admin/{name}")
        client.put(f"{DELIVERY}/admin/{name}", found)
    client.get(f"{DELIVERY}/configurations")
    client.get(f"{DELIVERY}/settings")
    client.put(f"{DELIVERY}/settings/timeout", {"food_pickup_timeout": 60})
    client.get(f"{DELIVERY}/voice_resources")


def deliver(client: Client) -> None:
    """A takeout from the door of its box to the hand of who ordered it, and a guest led to a room."""
    cargo = quote(client.get(f"{DELIVERY}/cargos")[0]["id"])
    box = client.get(f"{DELIVERY}/cargos/{cargo}/boxes")[0]["id"]
    client.put(f"{DELIVERY}/cargos/{cargo}/boxes/{box}/:open")
    client.wait(4)
    client.get(f"{DELIVERY}/cargos/{cargo}/boxes/{box}/operation_result")
    client.get(f"{DELIVERY}/cargos/{cargo}/boxes/{box}")
    client.put(f"{DELIVERY}/cargos/{cargo}/boxes/{box}/:close")
    client.wait(4)
    tasks = f"{DELIVERY}/tasks"
    order = {"location": {"poi_name": "101"}, "type": "TAKEOUT", "cargos": [{"cargo_id": cargo, "boxes": ["000"]}]}
    guide = {"location": {"poi_name": "101"}, "type": "GUIDE"}
    client.post(tasks, order)
    client.get(f"{DELIVERY}/cargos/assigned")
    client.get(tasks)
    client.until(f"{DELIVERY}/stage", lambda stage: stage["stage"] == "ARRIVED_AT_TARGET")
    client.put(f"{tasks}/:start_pickup")
    client.put(f"{DELIVERY}/cargos/{cargo}/boxes/{box}/:open")
    client.wait(4)
    client.put(f"{tasks}/:end_pickup")
    client.wait(10)
    client.put(f"{tasks}/:task_execution", {"enable_task_execution": False})
    first, second = client.post(f"{tasks}/:batch", [guide, guide])["order_ids"]
    waiting = client.get(f"{tasks}?status=all")
    client.delete(f"{tasks}/orders/{first}")
    client.delete(f"{tasks}/{next(task['id'] for task in waiting if task['task']['order_id'] == second)}")
    client.put(f"{tasks}/:task_execution", {"enable_task_execution": True})
    stop = {"location": {"poi_name": "101", "task_points": ["101"]}, "type": "RECYCLE"}
    client.post(tasks, stop)
    client.until(f"{DELIVERY}/stage", lambda stage: stage["stage"] == "ARRIVED_AT_TASK_POINT")
    client.put(f"{tasks}/:end_operation")
    client.wait(1)
    client.put(f"{tasks}/:task_finish")
    client.delete(tasks)
    client.wait(2)


def devices(client: Client) -> None:
    """Power, network, lights, jack, and parameters."""
    for path in ("capabilities", "power/status", "battery/pack", "robot/info", "rawimu", "rawadcimu"):
        client.get(f"{SYSTEM}/{path}")
    client.get(f"{SYSTEM}/parameter?param=base.max_moving_speed")
    client.put(f"{SYSTEM}/parameter", {"param": "base.max_moving_speed", "value": "0.5"})
    for path in ("status", "route", "apn"):
        client.get(f"{SYSTEM}/network/{path}")
    client.put(f"{SYSTEM}/network/status", {"networkmode": 4})
    client.put(f"{SYSTEM}/network/route", {"priority": "wifi"})
    client.put(f"{SYSTEM}/network/apn", {"apn": "cmhk"})
    settings = {"max_moving_speed": 0.7}
    client.put(f"{SYSTEM}/cube/config", json.dumps(settings).encode())
    light = {"channel": "One", "controlPart": "Left", "mode": "Blink", "color": {"red": 255, "green": 0, "blue": 0}}
    client.post(f"{SYSTEM}/light/control", light | {"brightMs": 500, "offMs": 500})
    client.post(f"{SYSTEM}/aeb/control", "On")
    client.get(f"{SYSTEM}/jack/status")
    client.post(f"{SYSTEM}/jack/status", "Up")
    client.put("/api/core/sensors/v1/depth/:enable", {"enable": True})
    client.get("/api/core/sensors/v1/masks")
    client.put("/api/core/sensors/v1/masks", [{"id": 1, "isEnabled": True}])
    client.get("/api/core/statistics/v1/odometry")
    client.get("/api/core/statistics/v1/runtime")
    client.get("/api/platform/v1/timestamp")
    client.get("/api/platform/v1/events")


def health(client: Client, hands: Stage) -> None:
    """A fault that comes, is seen and is dismissed."""
    hands.break_lidar()
    client.wait(5)
    code = client.get(f"{SYSTEM}/robot/health")["baseError"][0]["errorCode"]
    client.delete(f"{SYSTEM}/robot/health/{code}")
    hands.mend()
    client.wait(1)


def packages(client: Client) -> None:
    """Apps and firmware."""
    client.get(APPS)
    client.post(APPS, (HERE / "menu.apk").read_bytes())
    client.delete(f"{APPS}/com.example.menu")
    client.get(f"{FIRMWARE}/newversion")
    client.get(f"{FIRMWARE}/autoupdate/:enable")
    client.put(f"{FIRMWARE}/autoupdate/:enable", {"enable": True})
    client.post(f"{FIRMWARE}/autoupdate/:start")
    client.wait(10)
    client.get(f"{FIRMWARE}/progress")
    client.until(f"{FIRMWARE}/newversion", lambda found: not found)
    package = io.BytesIO()
    with zipfile.ZipFile(package, "w") as archive:
        archive.writestr("firmware.json", json.dumps({"version": "9.0.0", "model": "hermes"}))
    client.post(f"{FIRMWARE}/update/:start", package.getvalue())
    client.wait(2)
    client.until(f"{FIRMWARE}/progress", lambda found: found["status"] != 3)


def last(client: Client) -> None:
    """Requests that delete the map or switch the robot off."""
    client.delete(f"{INDUSTRY}/tasks/templates/round-1")
    client.delete(f"{ARTIFACT}/pois")
    client.delete(f"{SLAM}/maps")
    client.delete(f"{FLOORS}/stcm")
    client.wait(2)
    client.post(f"{FLOORS}/scene/unbind", {"keep_local_map": True})
    client.post(f"{SYSTEM}/power/:restartmodule", {"mode": "RestartModeSoft"})
    client.wait(15)
    client.post(f"{SYSTEM}/power/:hibernate")
    client.wait(2)
    client.post(f"{SYSTEM}/power/:wakeup")
    client.wait(10)
    client.post(f"{SYSTEM}/power/:shutdown", {"shutdown_time_interval": 60, "restart_time_interval": 0})
