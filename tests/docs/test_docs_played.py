"""The pages' commands, typed in order: the robot ends where the text says, and has touched nothing on the way."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from roboglot.config import AccessConfig
from roboglot.model.components.energy.battery import Battery
from roboglot.model.geometry import Point, Pose
from roboglot.testing import assert_pose, passed_in_order
from roboglot.testing.addresses import free_addresses
from tests.docs.docs_terminal import ROOT, commands, terminal
from tests.docs.test_docs import blocks

STARTS, DOCS = [ROOT / "docs/start.md", ROOT / "docs/start.zh.md"], ROOT / "docs/protocols"
SLACK = 0.08  # m: error of odometry after half a metre
GOAL = 0.12  # m: tolerance of a dog's task, and the error of localization


def block_with(page: Path, words: str, language: str = "sh") -> str:
    [found] = [block for block in blocks(page, language) if words in block]
    return found


def inline(page: Path, words: str) -> str:
    """Return the command in the text that ends in ``words``."""
    [found] = re.findall(rf"`([^`\n]*{re.escape(words)})`", page.read_text())
    return str(found)


@pytest.mark.slow  # in short: test_slamware of test_docs_first_calls.py
@pytest.mark.parametrize(  # the Chinese page has the same commands
    "page",
    [STARTS[0], *(pytest.param(page, marks=pytest.mark.slow) for page in STARTS[1:])],
    ids=lambda page: page.name,
)
async def test_the_first_drive_ends_where_it_says(tmp_path: Path, page: Path) -> None:
    async with terminal(tmp_path, free_addresses(1)) as user:
        said = await user.type_block(block_with(page, "MoveToAction"))
        answered = re.fullmatch(r"ok;ok;(\S+) (\S+) (\S+);ok;", said[3].said)
        assert answered, said
        x, y, clockwise = map(float, answered.groups())
        assert (x, y) == pytest.approx((1.5, 0.0), abs=SLACK)
        assert clockwise == pytest.approx(30, abs=3)
        assert (tmp_path / "certs/client-key.pem").exists()
        assert_pose(user.moved, x=1.5, y=0.0, deg=-30)
        (tmp_path / "my_program.py").write_text(block_with(page, "go_straight", "python"))
        assert (await user.type(inline(page, "program run my_program.py"))).status == 0
        await user.stand()
        turned = math.radians(-30)
        assert_pose(user.moved, x=1.5 + 0.3 * math.cos(turned), y=0.3 * math.sin(turned), deg=-30)


async def test_the_rest_page_drives_and_stops(tmp_path: Path) -> None:
    async with terminal(tmp_path, free_addresses(1), body="hermes") as user:
        said = await user.type_block(block_with(DOCS / "slamware.md", "action-factories"))
        await user.stand()
        assert any('"status":4,"result":0' in each.said for each in said), said
        assert_pose(user.moved, x=1.5, deg=90)
        assert 0.05 < user.moved.y < 0.4, "half a second forward, to what is its left now"
        assert (tmp_path / "map.bin").stat().st_size > 1000


@pytest.mark.parametrize("page", ["robomaster.md", "robomaster.zh.md"])
async def test_the_text_page_begins_with_a_drive(page: str, tmp_path: Path) -> None:
    line, answer = next(blocks(DOCS / page, "")).splitlines()
    async with terminal(tmp_path, free_addresses(1), body="robomaster_ep") as user:
        ended = await user.type(line.removeprefix("$ "))
        numbers = r"-?\d+\.\d+"
        assert re.sub(numbers, "#", ended.said) == re.sub(numbers, "#", answer)
        for answered, wanted in zip(re.findall(numbers, ended.said), re.findall(numbers, answer), strict=True):
            assert float(answered) == pytest.approx(float(wanted), abs=0.5 if float(wanted) < 0.1 else SLACK)
        assert_pose(user.moved, x=0.5, y=0.0, deg=0)


@pytest.mark.slow  # a long story; tests/protocols/cyberdog/maps has the tasks
async def test_the_dogs_page_localizes_and_goes(tmp_path: Path) -> None:
    page = DOCS / "cyberdog.md"
    async with terminal(tmp_path, free_addresses(1)) as user:
        said = await user.type_block(block_with(page, 'goalX": 1.5'))
        first, last = next(blocks(page, "")).split("…")
        assert said[-1].said.startswith(first)
        assert said[-1].said.endswith(last)
        assert_pose(user.moved, x=1.5, y=0.2, within=GOAL)


@pytest.mark.slow  # tests/cli/test_cyberdog_cli.py runs the command there, the English page above its messages
async def test_the_dogs_chinese_page_goes_there_too(tmp_path: Path) -> None:
    [line] = re.findall(r"^.*cyberdog go 1.5 0.2", block_with(DOCS / "cyberdog.zh.md", "cyberdog go"), re.MULTILINE)
    async with terminal(tmp_path, free_addresses(1), body="cyberdog2") as user:
        ended = await user.type(f"{line} --app-port {user.app_port}")
        assert ended.status == 0, ended
        assert_pose(user.moved, x=1.5, y=0.2, within=GOAL)


async def test_the_consoles_page_drives_and_drains(tmp_path: Path) -> None:
    async with terminal(tmp_path, free_addresses(1), body="hermes") as user:
        said = await user.type_block(block_with(DOCS.parent / "console.md", "go_to"))
        assert '"a"' in said[0].said
        await user.stand()
        assert_pose(user.moved, x=2.0, y=0.0, deg=90, within=GOAL)
        assert user.robot[Battery].state.percentage < 20


@pytest.mark.slow  # a long story; tests/cli/test_program.py has the commands
async def test_the_page_of_programs_runs_and_keeps_them(tmp_path: Path) -> None:
    async with terminal(tmp_path, free_addresses(1), body="cyberdog2") as user:
        (tmp_path / "my_program.py").write_text("cyberdog.motion.go_straight(0.5, 0.5)\nprint('there')\n")
        (tmp_path / "greet.py").write_text("def greet(name):\n    print('hello', name)\n")
        said = {}
        for line in commands(block_with(DOCS / "visual.md", "program check my_program.py")):
            if not re.search("--break|--own", line):  # these wait for input, or start a robot
                said[line.split()[2]] = ended = await user.type(line)
                assert ended.status == 0, ended
        assert "my_program" in said["list"].said
        assert {"save", "run", "shutdown"} <= set(said)
        await user.stand()
        assert_pose(user.moved, x=0.5, y=0.0)


@pytest.mark.slow  # programs of their own; tests/cli has the commands
@pytest.mark.parametrize("suffix", [".md", ".zh.md"])
async def test_pages_for_pupils_start_their_robots(suffix: str, tmp_path: Path) -> None:
    async with terminal(tmp_path, free_addresses(1)) as user:
        for name in ("studio", "language"):
            for line in commands(block_with(DOCS.parent / f"programs/{name}{suffix}", ".venv/bin/roboglot")):
                ended = await user.type(line)
                assert ended.status == 0, ended
                assert re.search("3 of 3 stars|clear on 4 of 4 sides", ended.said)


@pytest.mark.slow  # a long story; tests/drivers has the lease
async def test_the_drivers_page_takes_and_releases_control(tmp_path: Path) -> None:
    block = block_with(DOCS.parent / "drivers.md", "lease b --take").replace("lease b", "lease a")
    async with terminal(tmp_path, free_addresses(1), body="hermes") as user:
        looked, taken, given, released = [ended.said for ended in await user.type_block(block)]
        assert "a" in looked
        assert len({looked, taken, given}) == 3
        assert released == looked


@pytest.mark.slow  # a long story; test_docs_first_calls has the page's first call
async def test_the_dogs_page_photographs_and_films(tmp_path: Path) -> None:
    async with terminal(tmp_path, free_addresses(1), body="cyberdog2") as user:
        block = block_with(DOCS / "cyberdog.md", "cyberdog photo")
        await user.type_block(block.replace("cyberdog ", f"cyberdog --app-port {user.app_port} "))
        assert (tmp_path / "door.jpg").read_bytes()[:2] == b"\xff\xd8"
        assert (tmp_path / "walk.mp4").stat().st_size > 10_000


@pytest.mark.slow  # a long story; tests/recording has the commands
async def test_the_page_of_recordings_records_what_runs(tmp_path: Path) -> None:
    async with terminal(tmp_path, free_addresses(1), body="hermes") as user:
        await user.type_block(block_with(DOCS.parent / "recording.md", "record mark", "bash"))
        page = DOCS.parent / "recording.md"
        _, export = commands(block_with(page, "--rosbag2 today-bag", "bash"))
        _, compare, *_ = commands(block_with(page, "compare today.mcap yesterday.mcap", "bash"))
        for line in (".venv/bin/roboglot record info today.mcap", export, compare.replace("yesterday", "today")):
            ended = await user.type(line)
            assert ended.status == 0, ended
        assert "fidelity: 100 %" in ended.said
        assert (tmp_path / "today-bag/metadata.yaml").exists()


@pytest.mark.slow  # a long story; tests/cli/test_access_command.py has the commands
async def test_page_of_access_lets_in_and_throws_out(tmp_path: Path) -> None:
    page = DOCS.parent / "access.md"
    pose = "http://127.0.0.1:1448/api/core/slam/v1/localization/pose"
    async with terminal(tmp_path, free_addresses(1), access=AccessConfig(on=True, local=False)) as user:
        guard = user.runtime.guard
        assert guard is not None

        async def status(options: str) -> str:
            guard.reload()  # as its thread does four times a second
            return (await user.type(f"curl -s -o answer -w '%{{http_code}}' {options} {pose}")).said

        said: dict[str, str] = {}
        for line in commands(block_with(page, "access add cell7")):
            if "revoke" in line:
                assert await status("-u anna:staple-horse") == "200"
            ended = await user.type(f"echo staple-horse | {line}" if "--person" in line else line)
            assert ended.status == 0, ended
            said[line.split()[2]] = ended.said
        assert await status("-u anna:staple-horse") == "401"
        assert await status(f"-H 'Authorization: Bearer {said['rotate'].strip()}'") == "200"
        assert all(name in said["list"] for name in ("cell7", "phone", "10.0.0.7"))
        assert (tmp_path / "phone/client-cert.pem").exists()

        pupil, _ = [line for line in commands(block_with(page, "allow 10.0.0.21")) if "allow" in line]
        assert await status("--interface 127.0.95.21") == "401"
        assert (await user.type(pupil.replace("10.0.0.21", "127.0.95.21"))).status == 0
        assert await status("--interface 127.0.95.21") == "200"

        plant, person, curl = commands(block_with(page, "access add mes"))
        token = (await user.type(plant)).said.strip()
        assert (await user.type(f"echo staple-horse | {person}")).status == 0
        guard.reload()
        assert '"yaw"' in (await user.type(f"TOKEN={token}; {curl.replace('10.0.0.5', '127.0.0.1')}")).said

        verified = await user.type(".venv/bin/roboglot audit --verify")
        assert verified.status == 0, verified
        assert "rows are intact" in verified.said
        answered = await user.type(".venv/bin/roboglot doctor --security")
        assert "shift-lead" in answered.said
        assert token not in answered.said


async def test_the_text_client_drives_and_listens(tmp_path: Path, vendor_ports: None) -> None:
    async with terminal(tmp_path, free_addresses(1), body="robomaster_ep") as user:
        printed = await user.run(snippet("RoboMasterClient"), lines=4)
        where = printed[0]
        assert (where.x, where.y) == pytest.approx((0.5, 0.0), abs=SLACK)
        assert_pose(user.moved, x=0.5, y=0.0, deg=0)


async def test_the_rest_client_goes_and_looks(tmp_path: Path) -> None:
    async with terminal(tmp_path, free_addresses(1)) as user:
        printed = await user.run(snippet("SlamwareClient"))
        assert printed, "progress"
        assert_pose(user.moved, x=1.0, y=0.5, deg=90)


@pytest.mark.slow  # a long story; tests/clients/cyberdog has the calls
async def test_the_dogs_client_goes_photographs_and_walks(tmp_path: Path) -> None:
    async with terminal(tmp_path, free_addresses(1), body="cyberdog2") as user:
        assert (await user.type(".venv/bin/roboglot certs --export phone")).status == 0
        await user.run(snippet("CyberDogClient"))
        assert passed_in_order(user.track, [Point(1.5, 0.2)], within=GOAL) == 1
        assert user.moved.distance_to(Pose(1.5, 0.2)) > 0.05, "the joystick led it on"


def snippet(words: str) -> str:
    return block_with(DOCS.parent / "clients.md", f"async with {words}", "python")
