"""Programs that try to get out, with the language's rules on and off: the jail alone has to hold.

A secret file, a secret in the server's environment, a listening socket and a file to create stand for the world.
"""

from __future__ import annotations

import asyncio
import os
import secrets
import socket
import tempfile
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import pytest_asyncio

from roboglot.programs.engine import engine as engine_module
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import (
    Call,
    ExitReason,
    Failed,
    Finished,
    Limits,
    Output,
)
from tests.programs.playing import PRELUDE, Played, open_descriptors, play, process_state
from tests.workers.warm_start import COLD

# They use up twenty seconds of processor time at the lowest priority: minutes on a busy machine.
pytestmark = pytest.mark.timeout(380)
ATTACKS = sorted((Path(__file__).parent / "attacks").rglob("*.py"))
LIMITS = Limits(memory=32 * 1024 * 1024, cpu=1, output=300_000)
AT_ONCE = 8
# These use up a second of processor time. The rules find nothing in them, so they are played with the rules off alone.
ENDLESS = {"dict_collisions", "endless_c", "endless_caught", "huge_number", "int_text_bomb", "str_bomb"}

# The jail ends these by their processor time or memory too; two of them stay in every run.
LONG = (ENDLESS | {"regex_bomb", "ignore_cpu_signal", "generator_bomb", "memory_dict", "memory_string"}) - {"endless_c"}
NAMES = [path.stem for path in ATTACKS]
PARTS = {"rules": NAMES, "jail-only": sorted(set(NAMES) - LONG), "jail-only-long": sorted(LONG)}

# Their ends with the rules off, besides "somehow": the host has to name the reason.
REASONS = {
    "abort": ExitReason.CRASHED,
    "crash": ExitReason.CRASHED,
    "endless_caught": ExitReason.CPU,
    "endless_c": ExitReason.CPU,
    "exit_quietly": ExitReason.CRASHED,
    "forge_call_flood": ExitReason.PROTOCOL,
    "forge_checked": ExitReason.PROTOCOL,
    "forge_collisions": ExitReason.PROTOCOL,
    "forge_finished": ExitReason.FINISHED,
    "forge_garbage": ExitReason.PROTOCOL,
    "forge_length": ExitReason.PROTOCOL,
    "forge_nesting": ExitReason.PROTOCOL,
    "forge_record": ExitReason.PROTOCOL,
    "forge_unknown_call": ExitReason.PROTOCOL,
    "ignore_cpu_signal": ExitReason.CPU,
    "memory_list": ExitReason.MEMORY,
    "memory_dict": ExitReason.MEMORY,
    "memory_once": ExitReason.MEMORY,
    "memory_string": ExitReason.MEMORY,
    "output_flood": ExitReason.OUTPUT,
    "output_once": ExitReason.OUTPUT,
    "regex_bomb": ExitReason.CPU,
    "syscall_sweep": ExitReason.FINISHED,
    "other_descriptors": ExitReason.FINISHED,
    "lock_down_again": ExitReason.FINISHED,
}


Results = tuple[bool, dict[str, Played | None]]  # whether the rules are on, and what each attack came to


@dataclass
class World:
    """Things that must stay as they are."""

    folder: Path
    secret: str
    listener: socket.socket
    datagrams: socket.socket

    @property
    def port(self) -> int:
        return int(self.listener.getsockname()[1])

    def arm(self, attack: Path) -> str:
        """The attack's text, aimed at this world."""
        source = attack.read_text("utf-8")
        words = {
            "{secret}": str(self.folder / "secret.txt"),
            "{target}": str(self.folder / attack.stem),
            "{port}": str(self.port),
            "{host}": str(os.getpid()),
        }
        for word, value in words.items():
            source = source.replace(word, value)
        return source


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    secret = f"CANARY-{secrets.token_hex(8)}"
    with pytest.MonkeyPatch.context() as patch, tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o777)  # only the jail keeps programs from it, not its permissions
        (folder / "secret.txt").write_text(secret)
        (folder / "secret.txt").chmod(0o666)
        patch.setenv("ROBOGLOT_TEST_SECRET", secret)
        with socket.create_server(("127.0.0.1", 0)) as listener, socket.socket(type=socket.SOCK_DGRAM) as datagrams:
            datagrams.bind(listener.getsockname())
            listener.setblocking(False)
            datagrams.setblocking(False)
            yield World(folder, secret, listener, datagrams)


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def played(request: pytest.FixtureRequest, world: World) -> AsyncIterator[Results]:
    """Run the attacks of a part, a few at a time; then the engine still works, and no trace of them is left."""
    rules, attacks = request.param == "rules", [path for path in ATTACKS if path.stem in PARTS[request.param]]
    before = open_descriptors()
    with pytest.MonkeyPatch.context() as patch:
        # A tenth of them uses up a second of processor time, which takes minutes on a busy machine.
        patch.setattr(engine_module, "STEPS_BACK_AFTER", 1e6)
        patch.setenv(COLD, "1")  # in a zygote as users have it
        results = await attack_all(world, attacks, policy=rules)
    assert open_descriptors() <= before
    yield rules, {path.stem: result for path, result in zip(attacks, results, strict=True)}


async def attack_all(world: World, attacks: list[Path], *, policy: bool) -> list[Played | None]:
    slots = asyncio.Semaphore(AT_ONCE)
    async with Engine(policy=policy) as engine:

        async def attack(path: Path) -> Played | None:
            async with slots:
                if policy and path.stem in ENDLESS:
                    assert await engine.check(world.arm(path), PRELUDE) == []
                    return None
                return await play(engine, world.arm(path), limits=LIMITS)

        results = await asyncio.gather(*(attack(path) for path in attacks))
        after = await play(engine, "print('still here')")
        assert (after.output, after.ending) == ("still here\n", Finished())
    return results


@pytest.mark.parametrize(
    "played", ["rules", "jail-only", pytest.param("jail-only-long", marks=pytest.mark.slow)], indirect=True
)
@pytest.mark.asyncio(loop_scope="module")
async def test_nothing_gets_out(world: World, played: Results) -> None:
    rules, results = played
    for name, result in results.items():
        nothing_got_out(name, result, world, rules)


def nothing_got_out(name: str, result: Played | None, world: World, rules: bool) -> None:
    """Assert that an attack came to nothing."""
    if result is None:
        assert rules
        assert name in ENDLESS
        return
    assert isinstance(result.ending, (Finished, Failed))
    shown = result.output + (result.ending.message if isinstance(result.ending, Failed) else "")
    assert world.secret not in shown
    assert "ESCAPED" not in shown
    assert {call.name for call in result.calls} <= PRELUDE.callable_names()
    assert not (world.folder / name).exists()
    assert (world.folder / "secret.txt").read_text() == world.secret
    assert process_state(result.pid) == ""
    with pytest.raises(BlockingIOError):
        world.listener.accept()
    with pytest.raises(BlockingIOError):
        world.datagrams.recv(1)
    if not rules and name in REASONS:
        reason = result.ending.reason if isinstance(result.ending, Failed) else ExitReason.FINISHED
        assert reason is REASONS[name], result.ending


@pytest.mark.parametrize("played", ["rules", "jail-only"], indirect=True)
@pytest.mark.asyncio(loop_scope="module")
async def test_the_rules_stop_reflection_before_it_runs(played: Results) -> None:
    rules, results = played
    refused = {
        name
        for name, result in results.items()
        if result
        and isinstance(result.ending, Failed)
        and result.ending.type in {"PolicyError", "NameError", "SyntaxError"}
    }
    reflective = {
        "subclasses",
        "print_globals",
        "format_globals",
        "generator_frame",
        "traceback_frames",
        "class_pattern",
    }
    reflective |= {"metatype_match_args", "metaclass", "code_object", "dunder_import", "evaluate", "open_file"}
    assert (reflective <= refused) is rules
    shown = results["super_format"]
    assert shown
    assert ("LANGUAGE" in shown.output) is not rules


@pytest.mark.parametrize(
    "source",
    [
        "(" * 50_000,
        "x = " + "-" * 50_000 + "1",
        "x = " + "[" * 90 + "]" * 90,
        "x" + ".a" * 60_000,
        "lambda: " * 5_000 + "0",
        "if 1:\n" + "".join(" " * i + "if 1:\n" for i in range(1, 150)),
        "x = 1\n" * 25_000,
        "#" * 300_000,
        "\0",
        "\udcff = 1",
        "x = '" + "\\N{BULLET}" * 20_000 + "'",
        pytest.param("f(" + "a," * 60_000 + ")", marks=pytest.mark.slow),
        "9" * 100_000,
        "x = 2 ** 2 ** 2 ** 2 ** 2 ** 2",
        "",
    ],
    ids=lambda text: f"{text[:8]!r}x{len(text)}",
)
@pytest.mark.asyncio(loop_scope="module")
async def test_monstrous_text_is_answered(engine: Engine, source: str) -> None:
    """The parser runs inside the jail too, for checks as for runs."""
    problems = await engine.check(source, PRELUDE)
    result = await play(engine, source, limits=LIMITS)
    assert all(problem.line >= 1 and problem.english and problem.chinese for problem in problems)
    assert isinstance(result.ending, (Finished, Failed))
    assert process_state(result.pid) == ""


@pytest.mark.asyncio(loop_scope="module")
async def test_a_program_cannot_read_the_replies_of_another(engine: Engine) -> None:
    """Two runs at once, each with its own socket: what one receives the other never sees."""

    async def one(word: str) -> str:
        run = await engine.start("print(cyberdog.echo(1))", PRELUDE)
        text = ""
        async for event in run:
            match event:
                case Output(text=piece):
                    text += piece
                case Call():
                    run.calls.reply(event.id, word)
        return text

    assert await asyncio.gather(*(one(f"word {i}") for i in range(12))) == [f"word {i}\n" for i in range(12)]


def test_every_attack_is_listed() -> None:
    assert len(ATTACKS) >= 100
    assert set(REASONS) <= {path.stem for path in ATTACKS}
