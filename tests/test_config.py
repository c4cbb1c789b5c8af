"""Configuration: a file, overrides, addresses, and errors that name the key."""

from __future__ import annotations

import os
import pwd
from dataclasses import replace
from pathlib import Path

import pytest

from roboglot.cli.up import access_section
from roboglot.config import (
    Config,
    RobotConfig,
    StartConfig,
    default_data_folder,
    load_config,
    parse_robot,
    refuse_unguarded,
)
from roboglot.protocols import DOORS, sections


def test_defaults() -> None:
    config = load_config(None, {}, sections())
    assert config.robots == (RobotConfig("a", "universal", "127.0.0.1"),)
    ports = {door.name: [*door.port_numbers(config).values()] for door in DOORS}
    assert ports == {
        "slamware": [1448],
        "robomaster": [40923, 40921, 40922, 40925],
        "cyberdog": [50052],
        "visual": [50053],
        "vda5050": [],
        "foxglove": [8765],
        "ros2": [],
    }


def test_speed_in_lockstep_is_refused() -> None:
    with pytest.raises(ValueError, match="speed has no effect in lockstep"):
        load_config(None, {"lockstep": True, "speed": 2.0}, sections())


@pytest.mark.parametrize("broker", ["mqtt://a:1883", "mqtt://a:x", "//a"])
def test_a_broker_as_a_url_is_refused(broker: str) -> None:
    with pytest.raises(ValueError, match=r"vda5050\.broker must be HOST or HOST:PORT"):
        load_config(None, {"vda5050": {"broker": broker}}, sections())


@pytest.mark.parametrize("port", ["0", "65536", "²", "x", "9" * 50])
def test_brokers_port_is_checked(port: str) -> None:
    with pytest.raises(ValueError, match=r"vda5050\.broker: .* is not a port"):
        load_config(None, {"vda5050": {"broker": f"a:{port}"}}, sections())


def test_overrides_win_over_the_file(tmp_path: Path) -> None:
    file = tmp_path / "robots.toml"
    file.write_text(
        'world = "empty"\nseed = 7\n[cyberdog]\nport = 1\napp_port = 2\n'
        '[[robots]]\nname = "x"\n[[robots]]\nname = "y"\n'
    )
    config = load_config(file, {"seed": 8, "speed": None, "cyberdog": {"port": 3}, "data": str(tmp_path)}, sections())
    assert (config.world, config.seed, config.speed, config.data) == ("empty", 8, 1.0, tmp_path)
    assert (config.doors["cyberdog"].port, config.doors["cyberdog"].app_port) == (3, 2)
    assert [(r.name, r.address) for r in config.robots] == [("x", "127.0.0.1"), ("y", "127.0.0.2")]


def test_address_moves_first_robot_of_a_file(tmp_path: Path) -> None:
    """Regression: it removed the file's robots and started another one."""
    path = tmp_path / "robots.toml"
    path.write_text('[[robots]]\nname = "x"\nbody = "cyberdog2"\n[[robots]]\nname = "y"\n', "utf-8")
    robots = load_config(path, {"address": "127.3.0.1"}).robots
    assert [(robot.name, robot.body, robot.address) for robot in robots] == [
        ("x", "cyberdog2", "127.3.0.1"),
        ("y", "universal", "127.3.0.2"),
    ]
    assert [robot.address for robot in load_config(None, {"address": "127.3.0.9"}).robots] == ["127.3.0.9"]
    path.write_text("robots = 3\n", "utf-8")
    with pytest.raises(ValueError, match="robots"):
        load_config(path, {"address": "127.3.0.1"})


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("worldx = 'office'", r"^/.*\.toml: worldx is not a setting"),
        ("[[robots]]\naddress = '300.1.1.1'", "robot a: 300.1.1.1 is not an address"),
        ("[[robots]]\naddress = '127.0.0.9:80'", "robot a: 127.0.0.9:80 is not an address"),
        ("[[robots]]\naddress = '127.0.0.9:1,2'", "robot a: 127.0.0.9:1,2 is not an address"),
        ("address = '127.0.0.5'", r"address is a setting of one robot: it belongs below \[\[robots\]\]"),
        ("[slamware]\nprt = 1", r"slamware\.prt is not a setting"),
        ("[[robots]]\nnamex = 'a'", r"robots\.namex is not a setting"),
        ("[[robots]]\nstart = {x = 1, y = 1, yw = 2}", r"robots\.start\.yw is not a setting; did you mean 'yaw'"),
        ("seed = 'x'", "seed"),
        ("robots = []", "between 1 and"),
        ("[[robots]]\nname='a'\n[[robots]]\nname='a'", "two robots have the name a"),
        ("[[robots]]\nname='a'\naddress='127.0.0.5'\n[[robots]]\nname='b'\naddress='127.0.0.5'", "the address"),
        ("= 1", "robots.toml"),
        ("[slamware]\nport = 99999", "65535"),
        ("robots = [3]", "robots"),
        ("cyberdog = 3", "cyberdog"),
        ("[cyberdog]\napp = 'phone'", "HOST:PORT"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, complaint: str) -> None:
    file = tmp_path / "robots.toml"
    file.write_text(text)
    with pytest.raises(ValueError, match=complaint):
        load_config(file, {}, sections())


@pytest.mark.parametrize(
    ("address", "alone"),
    [
        ("127.0.0.1", True),
        ("127.9.9.9", True),
        ("localhost", True),
        ("::1", True),
        ("0.0.0.0", False),
        ("::", False),
        ("10.0.0.7", False),
        ("robot.lan", False),
        ("128.0.0.1", False),
    ],
)
def test_robots_others_can_reach_need_a_word(address: str, alone: bool) -> None:
    config = replace(Config(), robots=(RobotConfig("a", "universal", address),))
    refuse_unguarded(replace(config, insecure=True))
    if alone:
        refuse_unguarded(config)
    else:
        with pytest.raises(ValueError, match="--insecure"):
            refuse_unguarded(config)


def test_insecure_lets_everyone_in_although_the_file_asks(tmp_path: Path) -> None:
    file = tmp_path / "robots.toml"
    file.write_text("[access]\non = true\n")
    options = {"insecure": True, "access": access_section(on=False, insecure=True)}
    assert load_config(file, options, sections()).access.on is False
    assert load_config(file, {"access": access_section(on=False, insecure=False)}, sections()).access.on is True
    with pytest.raises(ValueError, match="one of them"):
        access_section(on=True, insecure=True)


def test_robots_on_the_command_line() -> None:
    assert parse_robot("b=universal") == RobotConfig("b", "universal", "")
    for name in ("b c", "dog-2", "2"):
        with pytest.raises(ValueError, match="name is letters"):
            parse_robot(f"{name}=universal")
    assert parse_robot("b=universal@127.0.0.9") == RobotConfig("b", "universal", "127.0.0.9")
    assert parse_robot("b=recording:/x/y.mcap#c@127.0.0.9") == RobotConfig("b", "recording:/x/y.mcap#c", "127.0.0.9")
    assert parse_robot("b=recording:y.mcap").recording == "y.mcap"
    for bad in ("b", "=universal", "b="):
        with pytest.raises(ValueError, match="name=body"):
            parse_robot(bad)


def test_the_data_folder_follows_the_environment() -> None:
    assert default_data_folder({"XDG_DATA_HOME": "/d", "HOME": "/h"}) == Path("/d/roboglot")
    assert default_data_folder({"HOME": "/h"}) == Path("/h/.local/share/roboglot")
    assert default_data_folder({}) == Path(pwd.getpwuid(os.getuid()).pw_dir) / ".local/share/roboglot"
    assert isinstance(Config().data, Path)


@pytest.mark.parametrize(
    ("text", "start"),
    [
        ("b=hermes:1,2", StartConfig(1.0, 2.0)),
        ("b=hermes:1.5,-2,1.57@127.0.0.9", StartConfig(1.5, -2.0, 1.57)),
        ("b=hermes:1,2,0,1", StartConfig(1.0, 2.0, 0.0, 1)),
    ],
)
def test_a_robot_may_say_where_it_starts(text: str, start: StartConfig) -> None:
    assert parse_robot(text).start == start
    assert parse_robot(text).body == "hermes"


@pytest.mark.parametrize("where", ["", "1", "1,2,3,4,5", "one,2", "nan,2", "1,2,3,-1", "1,2,3,0.5"])
def test_a_start_that_is_no_place_is_refused(where: str) -> None:
    with pytest.raises(ValueError, match="a robot starts at"):
        parse_robot(f"b=hermes:{where}")


def test_a_real_robot_starts_where_it_stands(tmp_path: Path) -> None:
    file = tmp_path / "robots.toml"
    file.write_text('robots = [{name = "a", body = "slamware://10.0.0.1", start = {x = 1.0, y = 2.0}}]')
    with pytest.raises(ValueError, match="a real one"):
        load_config(file, {})


def test_a_table_of_free_names_is_no_section() -> None:
    config = load_config(None, {"ros2": {"namespaces": {"a": "kitchen/robot"}}}, sections())
    assert config.doors["ros2"].namespaces == {"a": "kitchen/robot"}
