"""A recording becomes a bag of ROS 2 that the rosbags package reads, with what was recorded in it."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from typer.testing import CliRunner

from roboglot.cli import loaded
from roboglot.config import RecordConfig
from roboglot.datasets.rosbag import read_bag
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.geometry import Twist
from roboglot.recording.foxglove import TYPES
from roboglot.recording.reader import Record, read_messages
from roboglot.runtime import Runtime
from tests.recording.test_recorder import advance, config

pytest.importorskip("rosbags", reason="needs roboglot[logs]")
from rosbags.highlevel import AnyReader

from roboglot.recording.ros2.bag import export
from roboglot.recording.ros2.translation import Ros2Translator, read_cdr


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def drive(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, float]:
    """A recording of a robot that drives for two seconds, and how far its odometry says that it came."""
    folder = tmp_path_factory.mktemp("drive")
    path = folder / "r.mcap"
    started = Runtime(config(folder / "data", RecordConfig(to=str(path))))
    await started.start()
    robot: Any = started.fleet.robots["a"]
    await advance(started, 1.0)
    robot[Driving].drive(Twist(0.3), lifetime=2.0)
    await advance(started, 5.5)
    x = robot[Odometry].reading.pose.x
    await started.close()
    return path, x


@pytest.mark.slow  # in short: test_our_own_reader_of_bags_finds_the_drive
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
async def test_a_bag_has_what_was_recorded(drive: tuple[Path, float], tmp_path: Path, storage: str) -> None:
    path, x = drive
    bag = tmp_path / "bag"
    ended = CliRunner().invoke(loaded("export"), [str(path), "--rosbag2", str(bag), "--storage", storage])
    assert ended.exit_code == 0, ended.output
    found: dict[str, list[Any]] = {}
    with AnyReader([bag]) as reader:
        kinds = {connection.topic: connection.msgtype for connection in reader.connections}
        kept = {c.topic for c in reader.connections if c.ext.offered_qos_profiles[0].durability.value == 1}  # type: ignore[union-attr]
        for connection, at, raw in reader.messages():
            found.setdefault(connection.topic, []).append((at, reader.deserialize(raw, connection.msgtype)))
    assert kinds["/a/scan"] == "sensor_msgs/msg/LaserScan"
    assert kinds["/a/map"] == "nav_msgs/msg/OccupancyGrid"
    assert kinds["/a/battery_state"] == "sensor_msgs/msg/BatteryState"
    assert kept == {"/a/map", "/tf_static"}
    originals = list(read_messages(path, "/a/scan"))
    assert [at for at, _ in found["/a/scan"]] == [record.at for record in originals]
    scan = found["/a/scan"][-1][1]
    assert scan.header.frame_id == "a/laser"
    assert len(scan.ranges) == round((scan.angle_max - scan.angle_min) / scan.angle_increment) + 1
    assert [round(value, 3) for value in (scan.range_min, scan.range_max, scan.scan_time)] == [0.15, 12.0, 0.1]
    odometry = [message for _, message in found["/a/odom"]]
    assert odometry[-1].pose.pose.position.x == pytest.approx(x, abs=1e-6)
    assert max(message.twist.twist.linear.x for message in odometry) == pytest.approx(0.3, abs=0.05)
    assert odometry[-1].twist.twist.linear.x == pytest.approx(0.0, abs=1e-3)
    pairs = {(t.header.frame_id, t.child_frame_id) for _, m in found["/tf"] for t in m.transforms}
    assert pairs == {("a/map", "a/odom"), ("a/odom", "a/base_link")}
    assert [t.child_frame_id for _, m in found["/tf_static"] for t in m.transforms] == ["a/laser"]
    grid = found["/a/map"][-1][1]
    assert len(grid.data) == grid.info.width * grid.info.height
    assert set(grid.data.tolist()) <= {-1, 0, 100}
    assert 0.0 < found["/a/battery_state"][-1][1].percentage <= 1.0
    assert json.loads(found["/a/actions"][0][1].data)["name"]
    assert found["/truth/a/pose"][-1][1].header.frame_id == "world"


async def test_our_own_reader_of_bags_finds_the_drive(drive: tuple[Path, float], tmp_path: Path) -> None:
    path, x = drive
    export(path, tmp_path / "bag")
    log = read_bag(tmp_path / "bag")
    assert len(log.scans) > 20
    assert log.scans[-1].odometry.x - log.scans[0].odometry.x == pytest.approx(x, abs=0.05)


async def test_one_robot_alone(drive: tuple[Path, float], tmp_path: Path) -> None:
    assert export(drive[0], tmp_path / "other", robot="b").total() == 0
    mine = export(drive[0], tmp_path / "bag", robot="a")
    assert {"/tf", "/a/scan", "/truth/a/pose"} <= set(mine)
    assert "/rosout" not in mine


async def test_impossible_exports_are_refused(drive: tuple[Path, float], tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    for source, bag in ((drive[0], tmp_path / "there"), (tmp_path / "no.mcap", tmp_path / "x")):
        ended = CliRunner().invoke(loaded("export"), [str(source), "--rosbag2", str(bag)])
        assert ended.exit_code == 2
        assert "roboglot export:" in ended.output
    assert not (tmp_path / "x").exists()


def test_a_damaged_message_is_an_error() -> None:
    with pytest.raises(ValueError, match="/a/scan"):
        list(Ros2Translator().translate(Record("/a/scan", "foxglove.LaserScan", 0, b"\xff\xff\xff")))


def test_scan_without_known_limits_fits_its_echoes() -> None:
    words = Ros2Translator()
    for echoes, farthest in (([1.0, math.inf, 3.0], 3.0), ([2.0, math.nan], 3.0)):
        scan = TYPES["foxglove.LaserScan"](frame_id="a/laser", ranges=echoes).SerializeToString()
        [message] = words.translate(Record("/a/scan", "foxglove.LaserScan", 0, scan))
        decoded: Any = read_cdr(message.data, message.type)
        assert decoded.range_max == pytest.approx(farthest, abs=0.002)


def test_a_battery_that_says_little_is_translated() -> None:
    messages = list(Ros2Translator().translate(Record("/a/battery", "roboglot.Battery", 5, b'{"percentage": 0.5}')))
    assert [message.topic for message in messages] == ["/a/battery_state", "/a/battery/state"]
    assert math.isfinite(messages[0].at)


@pytest.mark.parametrize(
    ("schema", "data"),
    [
        ("roboglot.Battery", b'{"voltage": 1e300}'),  # a float of 32 bits there
        ("roboglot.Battery", b"[" * 100_000),
        ("roboglot.Lidar", b'{"a": ' * 100_000),
        ("foxglove.Grid", b"\xff"),
    ],
)
def test_values_without_a_ros_form_are_damage(schema: str, data: bytes) -> None:
    with pytest.raises(ValueError, match="/a/x"):
        list(Ros2Translator().translate(Record("/a/x", schema, 1, data)))
