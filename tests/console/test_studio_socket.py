"""The studio's socket: frames as at any door, debugging, checks, trials, classes; hostile pages get nowhere."""

from __future__ import annotations

import asyncio
import itertools
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Origin

from roboglot.console.settings import JOIN_BURST
from roboglot.console.studio import channel
from roboglot.console.studio.blocks import table
from roboglot.console.studio.classroom import PUPILS_MAX
from roboglot.console.studio.mistakes import explain
from roboglot.model.components.mapping.localization import Localization
from roboglot.programs.functions.prelude import ability_set
from roboglot.programs.language import check
from roboglot.wire.contracts import contract
from tests.console.conftest import ServedConsole

ATTACKS = sorted((Path(__file__).parent.parent / "programs" / "attacks").rglob("*.py"))
SAVE = {"type": "task", "operate": "save", "target_id": ["t"], "mode": "single", "condition": "now", "describe": "t"}
RUN = {"type": "task", "operate": "run", "target_id": ["t"], "mode": "single", "condition": "now"}


class Page:
    """A page of the studio without a browser."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self.heard: list[dict[str, Any]] = []

    async def say(self, **message: Any) -> None:
        await self._socket.send(json.dumps(message))

    async def until(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        async with asyncio.timeout(60):
            while True:
                message: dict[str, Any] = json.loads(await self._socket.recv())
                self.heard.append(message)
                if wanted(message):
                    return message

    async def kind(self, kind: str) -> dict[str, Any]:
        return await self.until(lambda message: message["type"] == kind)

    async def frame(self, **fields: Any) -> dict[str, Any]:
        await self.say(type="frame", text=json.dumps(fields))
        answer = await self.until(lambda m: m["type"] == "frame" and f'"id": "{fields["id"]}"' in m["text"])
        found: dict[str, Any] = json.loads(answer["text"])
        return found


@asynccontextmanager
async def page(served: ServedConsole) -> AsyncIterator[Page]:
    async with connect(served.url.replace("http", "ws") + "/studio", max_size=None) as socket:
        made = Page(socket)
        await made.say(type="open", robot="a")
        await made.kind("opened")
        yield made


async def test_a_block_for_each_function_in_both_languages(served: ServedConsole) -> None:
    status, found = await served.ask("/api/blocks")
    assert status == 200
    assert {function["key"] for function in found["functions"]} == {row.key for row in contract("visual")}
    for function in table()["functions"]:
        assert function["zh"] != function["en"], function
        assert any("\u4e00" <= letter <= "\u9fff" for letter in function["zh"]), function
        assert function["about"]["en"]
        assert any("\u4e00" <= letter <= "\u9fff" for letter in function["about"]["zh"]), function
        assert all(table()["members"][name]["zh"] for p in function["parameters"] for name in p.get("choices", ()))
        assert [p for p in function["parameters"] if not (p["en"] and p["zh"])] == []
        for parameter in function["parameters"]:
            if "minimum" in parameter:
                assert parameter["minimum"] <= parameter["default"] <= parameter["maximum"], (function, parameter)


async def test_program_is_saved_run_halted_and_stepped(served: ServedConsole) -> None:
    async with page(served) as studio:
        body = "n = 1\ncyberdog.task.block('one')\nn = 2\ncyberdog.task.block('two')\nprint(n)\n"
        assert (await studio.frame(**SAVE, id="1", body=body))["feedback"]["state"] == 0
        stops = {"target_id": "t", "operate": "break", "first_block": True, "watched": True}
        await studio.say(type="debug", id=5, text=json.dumps(stops))
        assert json.loads((await studio.kind("debugged"))["text"])["error"] == ""
        await studio.frame(**RUN, id="2")
        await studio.until(lambda m: m["type"] == "frame" and "now state is suspend" in m["text"])
        assert [m["variables"] for m in studio.heard if m["type"] == "variables"][-1] == {"n": "1"}
        await studio.say(type="debug", id=6, text=json.dumps({"target_id": "t", "operate": "step_block"}))
        await studio.until(lambda m: m["type"] == "frame" and "now state is suspend" in m["text"])
        assert [m["variables"] for m in studio.heard if m["type"] == "variables"][-1] == {"n": "2"}
        await studio.say(type="debug", id=7, text=json.dumps({"target_id": "t", "operate": "go"}))
        assert (await studio.kind("log"))["text"] == "2"
        await studio.until(lambda m: m["type"] == "frame" and "stop task" in m["text"])


CALLING = """
def walk(n):
    cyberdog.task.block('inside')
    print(n)
cyberdog.task.block('first')
walk(1)
cyberdog.task.block('second')
walk(2)
cyberdog.task.block('third')
print(3)
"""


async def test_steps_go_over_and_out_of_functions(served: ServedConsole) -> None:
    async with page(served) as studio:
        assert (await studio.frame(**SAVE, id="1", body=CALLING))["feedback"]["state"] == 0
        stops = {"target_id": "t", "operate": "break", "first_block": True}
        await studio.say(type="debug", id=5, text=json.dumps(stops))
        await studio.kind("debugged")
        await studio.frame(**RUN, id="2")
        blocks = []
        for id, operate in enumerate(("over_block", "step_block", "out_block", "where"), start=6):
            await studio.until(lambda m: m["type"] == "frame" and "now state is suspend" in m["text"])
            await studio.say(type="debug", id=100 + id, text=json.dumps({"target_id": "t", "operate": "where"}))
            blocks.append(json.loads((await studio.kind("debugged"))["text"])["block"])
            await studio.say(type="debug", id=id, text=json.dumps({"target_id": "t", "operate": operate}))
            assert json.loads((await studio.kind("debugged"))["text"])["error"] == ""
        assert blocks == ["first", "second", "inside", "third"]
        assert [m["text"] for m in studio.heard if m["type"] == "log"] == ["1", "2"]
        await studio.frame(type="task", operate="shutdown", target_id=["t"], id="3")


async def test_page_lights_only_blocks_of_its_own_program(served: ServedConsole) -> None:
    async with page(served) as mine, page(served) as theirs, page(served) as every:
        await mine.say(type="open", robot="a", program="t")
        await theirs.say(type="open", robot="a", program="other")
        await mine.kind("opened")
        await theirs.kind("opened")
        body = "cyberdog.task.block('one')\nprint(1)\n"
        await mine.frame(**SAVE, id="1", body=body)
        await mine.frame(**RUN, id="2")
        for one in (mine, theirs, every):
            await one.until(lambda m: m["type"] == "frame" and "stop task" in m["text"])
        heard = [[m["type"] for m in one.heard if '"begin"' in m.get("text", "") or m["type"] == "log"]
                 for one in (mine, theirs, every)]  # fmt: skip
        assert heard == [["frame", "log"], [], ["frame", "log"]]


async def test_problems_are_reported_while_typing(served: ServedConsole) -> None:
    async with page(served) as studio:
        await studio.say(type="check", id=1, body="cyberdog.motion.trun(90)\n")
        [problem] = (await studio.kind("checked"))["problems"]
        assert (problem["line"], "Did you mean 'turn'" in problem["en"], "turn" in problem["zh"]) == (1, True, True)


UNFIT = "print(1)\nfound = cyberdog.led.play(LedConstraint.target_head, LedConstraint.system_effect_mini_one_by_one)\n"
UNFIT += "if found.state.code:\n    print('it failed')\n"


async def test_program_is_tried_in_mission_and_world_copy(served: ServedConsole) -> None:
    async with page(served) as studio:
        await studio.say(type="try", id=1, lesson="02_turn_around", body="cyberdog.motion.turn(180, 2)\n")
        assert (await studio.kind("tried"))["grade"]["stars"] == 3
        await studio.say(type="try", id=2, lesson="", body="print(1 / 0)\n")
        assert "ZeroDivisionError" in (await studio.kind("tried"))["error"]
        await studio.say(type="try", id=4, lesson="", body=UNFIT)
        tried = await studio.kind("tried")
        assert (tried["error"], [(one["function"], one["line"]) for one in tried["refused"]]) == (
            "",
            [("cyberdog.led.play", 2)],
        )
        assert tried["refused"][0]["words"]
        await studio.say(type="try", id=3, lesson="../../secret", body="x = 1\n")
        assert "there is no mission" in (await studio.kind("refused"))["why"]


async def test_trial_begins_where_the_map_has_it(served: ServedConsole) -> None:
    async with page(served) as studio:
        await studio.say(type="try", id=1, lesson="", body="x = 1\n")
        spot = await studio.until(lambda m: m.get("what") == "spot")
        believed = served.robot[Localization].pose
        assert (spot["x"], spot["y"], spot["yaw"]) == pytest.approx((believed.x, believed.y, believed.yaw), abs=0.01)
        assert served.runtime.fleet.world.truth.pose_of("a").distance_to(believed) > 0.5


async def test_a_page_tries_one_program_at_once(served: ServedConsole) -> None:
    wish = {"type": "try", "id": 1, "lesson": "", "body": "import time\ntime.sleep(1000)\n"}
    async with page(served) as studio:
        for _ in range(2):
            await studio.say(**wish)
        assert "being tried already" in (await studio.kind("refused"))["why"]
        await studio.until(lambda m: m.get("what") == "spot")
        await studio.say(type="end_try")
        assert "it was cancelled" in (await studio.kind("refused"))["why"]
        await studio.say(**wish | {"body": "import time\ntime.sleep(2000)\n"})
        await studio.say(type="end_try")  # while it is checked, as nothing was that is known already
        assert "it was cancelled" in (await studio.kind("refused"))["why"]


async def test_a_class_is_joined_seen_and_handed_in(served: ServedConsole) -> None:
    async with page(served) as teacher, page(served) as anna, page(served) as other:
        await teacher.say(type="class", do="open", name="7b")
        code = (await teacher.kind("grid"))["code"]
        await anna.say(type="class", do="join", code=code.lower(), name="Anna")
        assert (await anna.kind("joined"))["class"] == "7b"
        await other.say(type="class", do="join", code=code, name="Anna")
        assert "already" in (await other.kind("refused"))["why"]
        await other.say(type="class", do="look", name="Anna")
        assert "only the teacher" in (await other.kind("refused"))["why"]
        doing = {"phase": "running", "lit": "turn", "program": "p", "error": "", "mission": "", "stars": 4}
        await anna.say(type="class", do="hand_in", doing=doing, style='{"body": "x = 1"}')
        await anna.kind("handed")
        [row] = (await teacher.until(lambda m: m["type"] == "grid" and any(p["handed"] for p in m["pupils"])))["pupils"]
        assert (row["name"], row["lit"], row["stars"], row["robot"]) == ("Anna", "turn", 4, "a")
        await teacher.say(type="class", do="look", id=9, name="Anna")
        assert (await teacher.kind("looked"))["style"] == '{"body": "x = 1"}'
        await anna.say(type="check", id=1, body="x = 1\n")  # editors stay in the class
        await anna.kind("checked")
        await teacher.say(type="class", do="look", id=10, name="Anna")
        await teacher.kind("looked")
        assert [m["pupils"][0]["here"] for m in teacher.heard if m["type"] == "grid" and m["pupils"]][-1]
    async with page(served) as teacher, page(served) as anna:
        await teacher.say(type="class", do="open", code=code)
        await teacher.kind("grid")
        await anna.say(type="class", do="join", code=code, name="Anna")  # closes her first page
        assert (await anna.kind("joined"))["name"] == "Anna"


async def test_malformed_messages_close_only_their_page(served: ServedConsole) -> None:
    async with page(served) as other:
        for text in ("{", "[]", '{"type": "run"}', "[" * 100_000, '{"type": "check", "id": "x"}', "\x00"):
            async with connect(served.url.replace("http", "ws") + "/studio") as socket:
                await socket.send(text)
                with pytest.raises(ConnectionClosed) as closed:
                    await socket.recv()
            assert closed.value.rcvd is not None
            assert "`" not in closed.value.rcvd.reason  # around the library's names of types
        await other.say(type="check", id=1, body="x = 1\n")
        assert (await other.kind("checked"))["problems"] == []


@pytest.mark.slow  # every attack; tests/programs/test_attacks.py judges them
async def test_hostile_programs_are_judged_through_the_page_alike(served: ServedConsole) -> None:
    wish = {"type": "task", "operate": "run", "target_id": ["t"], "mode": "single", "condition": "now"}
    async with page(served) as studio:
        for _, paths in itertools.groupby(ATTACKS, key=lambda path: path.parent):
            for path in paths:
                body = path.read_text("utf-8")
                feedback = (await studio.frame(**SAVE, id=path.stem, body=body))["feedback"]
                assert (feedback["state"] == 0) == (check(body, ability_set().names()) == []), path
            if feedback["state"]:  # the folder's last one: refused programs do not run, either
                assert (await studio.frame(**wish, id="run"))["feedback"]["state"] != 0


async def test_hostile_frames_are_refused_and_the_page_stays(served: ServedConsole) -> None:
    frames = ("{", "[" * 100_000, "NaN", '{"type": 7}', '{"type": "task", "target_id": [["t"]]}', "\x00")
    async with page(served) as studio:
        for number, text in enumerate(frames):
            await studio.say(type="frame", text=text)
            await studio.say(type="check", id=number, body="x = 1\n")
            assert (await studio.kind("checked"))["problems"] == [], text[:40]


async def flood(studio: Page) -> None:
    for _ in range(1000):
        await studio.say(type="end_try")
        await asyncio.sleep(0)
    await studio.kind("never")


async def test_a_flood_of_messages_closes_the_page(served: ServedConsole) -> None:
    async with page(served) as studio:
        with pytest.raises(ConnectionClosed):
            await flood(studio)


async def test_codes_cannot_be_tried_out(served: ServedConsole, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(channel, "MESSAGES_PER_SECOND_MAX", 10_000)  # under another limit
    async with page(served) as teacher, page(served) as guest:
        await teacher.say(type="class", do="open", name="7b")
        code = (await teacher.kind("grid"))["code"]
        for number in range(2 * JOIN_BURST):  # right codes are free
            await guest.say(type="class", do="join", code=code, name=f"pupil {number % 2}")
            await guest.kind("joined")
        for number in range(JOIN_BURST + 1):
            await guest.say(type="class", do="join", id=7, code=f"WRONG{number}", name="Eve")
            why = (await guest.kind("refused"))["why"]
        assert "too many wrong codes" in why
    async with page(served) as again:  # counted by address, not by page
        said = set()
        for number in range(JOIN_BURST // 2):
            await again.say(type="class", do="join", id=7, code=f"WRONG{number}", name="Eve")
            said.add((await again.kind("refused"))["why"].partition(":")[0])
        assert "too many wrong codes from your address" in said


async def test_names_alone_do_not_fill_a_class(served: ServedConsole, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(channel, "MESSAGES_PER_SECOND_MAX", 10_000)  # under another limit
    async with page(served) as teacher, page(served) as eve, page(served) as anna:
        await teacher.say(type="class", do="open", name="7b")
        code = (await teacher.kind("grid"))["code"]
        await anna.say(type="class", do="join", code=code, name="Anna", style="{}")
        await anna.kind("joined")
        for number in range(PUPILS_MAX + 5):
            await eve.say(type="class", do="join", code=code, name=f"Eve {number}")
            await eve.kind("joined")
        grid = await teacher.until(lambda m: m["type"] == "grid" and m["pupils"][-1]["name"] == f"Eve {PUPILS_MAX + 4}")
        assert len(grid["pupils"]) == PUPILS_MAX
        assert grid["pupils"][0]["name"] == "Anna"


TOO_MUCH: tuple[dict[str, object], ...] = (
    {"do": "open", "name": "x" * 41},
    {"do": "join", "code": "x" * 13, "name": "a"},
    {"do": "join", "code": "x", "name": "x" * 41},
    {"do": "hand_in", "style": "x" * 400_001},
    {"do": "doing", "doing": {"lit": "x" * 301}},
    {"do": "doing", "doing": {"stars": 1001}},
    {"do": "erase"},
)


async def test_requests_of_a_class_are_bounded(served: ServedConsole) -> None:
    async with page(served) as other:
        for wish in TOO_MUCH:
            async with page(served) as hostile:
                await hostile.say(type="class", **wish)
                try:
                    joined = await hostile.kind("joined")
                except ConnectionClosed:
                    continue
                pytest.fail(f"{str(wish)[:60]} was answered with {joined}")
        await other.say(type="check", id=1, body="x = 1")
        assert (await other.kind("checked"))["problems"] == []


async def test_pages_of_strangers_are_refused(served: ServedConsole) -> None:
    with pytest.raises(Exception, match=r"\d|closed"):
        async with connect(f"ws{served.url[4:]}/studio", origin=Origin("http://evil.example")) as socket:
            await socket.recv()


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("ZeroDivisionError: division by zero (line 3: print(1 / 0))", 3, "divided by zero"),
        ("NameError: name 'x' is not defined (line 1: x)", 1, "x has no value"),
        ("AttributeError: 'State' object has no attribute 'cod' (line 2: s.cod)", 2, "Did you mean code"),
        ("the server was stopped", 0, ""),
    ],
)
def test_a_failure_is_explained(text: str, line: int, words: str) -> None:
    found = explain(text)
    assert found["line"] == line
    assert words in str(found["en"])
    assert bool(found["zh"]) == bool(words)


def test_starting_blocks_of_the_table_are_right_programs() -> None:
    for function in table()["functions"]:
        assert check(f"x = {function['key']}\n", ability_set().names()) == [], function["key"]


async def test_lists_go_to_the_page_that_asked(served: ServedConsole) -> None:
    async with page(served) as first, page(served) as second:
        inquiry = {"type": "task", "operate": "inquiry", "target_id": []}
        assert "response" in await first.frame(**inquiry, id="of_first")
        assert "response" in await second.frame(**inquiry, id="of_second")
        broken = json.dumps({**inquiry, "id": "raw", "describe": "-"}).replace("-", "a\nb")  # as the manual has it
        await first.say(type="frame", text=broken)
        await first.until(lambda m: m["type"] == "frame" and '"id": "raw"' in m["text"])
        lists = [[m["text"] for m in one.heard if "response" in m.get("text", "")] for one in (first, second)]
        assert [len(found) for found in lists] == [2, 1]
        assert "of_second" in lists[1][0]


async def test_functions_that_answer_nothing_are_no_readings(served: ServedConsole) -> None:
    async with page(served) as studio:
        body = "import time\ntime.sleep(0)\ntime.monotonic()\nprint('end')\n"
        await studio.frame(**SAVE, id="1", body=body)
        await studio.say(type="frame", text=json.dumps({**RUN, "id": "2"}))
        await studio.kind("log")
        assert [m["function"] for m in studio.heard if m["type"] == "reading"] == ["time.monotonic"]


async def test_later_pages_learn_what_was_refused(served: ServedConsole) -> None:
    found = []
    for body in "for n in (7.0, 7.0, 8.0):\n    cyberdog.motion.go_straight(n)\n", "print(1)\n":
        async with page(served) as studio:
            await studio.frame(**SAVE, id="1", body=body)
            await studio.say(type="frame", text=json.dumps({**RUN, "id": "2"}))
            await studio.until(lambda m: m["type"] == "frame" and "stop task" in m["text"])
        async with page(served) as later:
            await later.say(type="fetch", id=5, program="t")
            found += [(c["line"], c["refused"].split()[2]) for c in (await later.kind("fetched"))["refused"]]
    assert found == [(2, "7"), (2, "8")]  # the second run leaves none
