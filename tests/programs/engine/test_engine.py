"""The engine as a whole: its zygote, what is left when something dies, and other loops."""

from __future__ import annotations

import asyncio
import importlib.util
import os
import signal
import sys
import textwrap
from functools import partial
from pathlib import Path

import pytest
import uvloop

from roboglot.programs.engine import engine as engine_module
from roboglot.programs.engine import launcher
from roboglot.programs.engine.engine import Engine, EngineError, SandboxUnavailable
from roboglot.programs.engine.events import (
    ExitReason,
    Failed,
    Finished,
    Output,
)
from roboglot.programs.engine.processor_group import ProcessorGroup
from roboglot.programs.worker import zygote
from tests.programs.playing import PRELUDE, children_of, open_descriptors, play, process_state, until
from tests.workers.warm_start import COLD

BUSY = "print('ready')\nwhile True: pass"


@pytest.mark.parametrize(("after", "gives_way"), [(0.0, True), (1e6, False)])
async def test_zygote_gives_way_after_a_moment(monkeypatch: pytest.MonkeyPatch, after: float, gives_way: bool) -> None:
    """The first program begins at the server's own weight."""
    stepped: list[int] = []
    monkeypatch.setattr(ProcessorGroup, "step_aside", lambda _, pid: stepped.append(pid))
    monkeypatch.setattr(engine_module, "STEPS_BACK_AFTER", after)
    async with Engine() as engine:
        await play(engine, "print(1)")
        assert bool(stepped) is gives_way


def test_modules_of_the_zygote_stay_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else each start compiles them, which takes a fifth of it."""
    monkeypatch.setenv(COLD, "1")
    compiled = Path(importlib.util.cache_from_source(zygote.__file__))
    compiled.unlink(missing_ok=True)

    async def start() -> None:
        async with Engine():
            pass

    asyncio.run(start())
    assert compiled.exists()


async def test_nothing_is_left_after_close() -> None:
    descriptors, children = open_descriptors(), children_of(os.getpid())
    engine = Engine()
    runs = [await engine.start(BUSY, PRELUDE) for _ in range(5)]
    await runs[0].suspend()
    zygote = children_of(os.getpid()) - children
    assert len(zygote) == 1
    assert {run.pid for run in runs} == children_of(*zygote)
    await engine.close()
    await engine.close()
    for run in runs:
        assert process_state(run.pid) == ""
        ends = [event async for event in run if isinstance(event, Failed)]
        assert [end.reason for end in ends] == [ExitReason.LOST]
    assert children_of(os.getpid()) <= children
    assert open_descriptors() <= descriptors
    with pytest.raises(EngineError):
        await engine.start("pass", PRELUDE)


async def test_the_zygote_can_die_and_is_replaced() -> None:
    before = children_of(os.getpid())
    async with Engine() as engine:
        run = await engine.start(BUSY, PRELUDE)
        assert isinstance(await anext(run), Output)
        (zygote,) = children_of(os.getpid()) - before
        os.kill(zygote, signal.SIGKILL)
        end = [event async for event in run][-1]
        assert isinstance(end, Failed)
        assert end.reason is ExitReason.LOST
        played = await play(engine, "print('again')")
        assert played.ending == Finished()
        assert process_state(run.pid) in {"", "Z"}  # Z: its new parent has not waited for it yet
    assert children_of(os.getpid()) <= before


async def test_close_ends_though_the_zygote_is_silent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_module, "ENDS_MAX", 0.1)
    monkeypatch.setattr(launcher, "EXIT_MAX", 0.1)
    before = children_of(os.getpid())
    engine = Engine()
    run = await engine.start(BUSY, PRELUDE)
    (zygote,) = children_of(os.getpid()) - before
    os.kill(zygote, signal.SIGSTOP)
    await asyncio.wait_for(engine.close(), 30)
    assert run.exit_reason is ExitReason.LOST
    assert process_state(zygote) == ""
    assert process_state(run.pid) in {"", "Z"}  # Z: its new parent has not waited for it yet


@pytest.mark.slow
async def test_start_that_is_given_up_leaves_no_process() -> None:
    others = children_of(os.getpid())
    async with Engine() as engine:
        before = open_descriptors()
        for turns in range(12):
            starting = asyncio.create_task(engine.start(BUSY, PRELUDE))
            for _ in range(turns % 4):
                await asyncio.sleep(0)
            starting.cancel()
            await asyncio.gather(starting, return_exceptions=True)
        assert (await play(engine, "print(1)")).output == "1\n"
        (zygote,) = children_of(os.getpid()) - others
        await until(lambda: not children_of(zygote))
        await until(lambda: open_descriptors() <= before)


async def test_opening_in_the_background_does_not_wait() -> None:
    engine = Engine()
    engine.open_soon()
    engine.open_soon()
    assert engine.layers == []
    assert (await play(engine, "print(1)")).output == "1\n"
    assert "seccomp" in engine.layers
    await engine.close()


async def test_opening_later_takes_nothing_from_the_start() -> None:
    before = children_of(os.getpid())
    engine, other = Engine(), Engine()
    engine.open_later()
    assert (await play(other, "print(1)")).output == "1\n"
    assert len(children_of(os.getpid()) - before) == 1  # the other's
    await other.close()
    assert (await play(engine, "print(1)")).output == "1\n"  # a program does not wait for that delay
    await engine.close()


async def test_opening_later_needs_no_program(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("roboglot.programs.engine.engine.OPENS_AFTER", 0.0)
    monkeypatch.setattr("roboglot.programs.engine.engine.OPENS_WITHIN", 0.1)
    engine = Engine()
    engine.open_later()
    await until(lambda: "seccomp" in engine.layers)
    await engine.close()


async def test_without_a_filter_nothing_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Machines with unknown system calls, and with a filter that loads but doesn't hold."""
    for trick in (
        "import os, types; os.uname = lambda: types.SimpleNamespace(machine='pdp11')",
        "from roboglot.programs.worker import seccomp; seccomp.load = lambda *a: None",
    ):
        monkeypatch.setattr(launcher, "_BOOT", launcher._BOOT.replace("zygote.main", f"{trick}\nzygote.main"))
        engine = Engine()
        engine.open_soon()
        with pytest.raises(SandboxUnavailable, match="cannot be locked in"):
            await engine.start("print(1)", PRELUDE)
        with pytest.raises(SandboxUnavailable):
            await engine.check("print(1)", PRELUDE)
        await engine.close()
        monkeypatch.undo()


@pytest.mark.parametrize(
    "trick",
    [
        "import os, types; os.uname = lambda: types.SimpleNamespace(machine='pdp11')",
        "from roboglot.programs.worker import seccomp; seccomp.load = lambda *a: None",
    ],
)
async def test_without_filter_programs_run_if_operator_says_so(
    trick: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(launcher, "_BOOT", launcher._BOOT.replace("zygote.main", f"{trick}\nzygote.main"))
    async with Engine(policy=False, filter_required=False) as engine:
        assert "seccomp" not in engine.layers
        assert "without a system call filter" in caplog.text
        assert (await play(engine, "print(1)")).output == "1\n"
        other_walls = "try: print(open('/etc/passwd').read())\nexcept OSError as e: print('kept in')"
        assert (await play(engine, other_walls)).output == "kept in\n"


async def test_available_filter_always_applies(caplog: pytest.LogCaptureFixture) -> None:
    async with Engine(filter_required=False) as engine:
        assert "seccomp" in engine.layers
    assert caplog.text == ""


def test_runs_on_uvloop() -> None:
    async def main() -> tuple[str, str]:
        async with Engine() as engine:
            run = await engine.start(BUSY, PRELUDE)
            await anext(run)
            await run.suspend()
            state = process_state(run.pid)
            await run.resume()
            await run.kill()
            return (
                await play(engine, "for i in range(3000): print(cyberdog.echo(i) if i % 100 == 0 else i)")
            ).output, state

    output, state = uvloop.run(main())
    assert output == "".join(f"{i}\n" for i in range(3000))
    assert state == "T"


async def test_workers_die_with_the_server() -> None:
    server = textwrap.dedent("""
        # warm
        import asyncio
        from roboglot.programs.engine.engine import Engine
        async def main():
            engine = Engine()
            runs = [await engine.start("print(1)\\nwhile True: pass") for _ in range(3)]
            for run in runs:
                await anext(run)
            await runs[0].suspend()
            print(*[run.pid for run in runs], flush=True)
            await asyncio.Event().wait()
        asyncio.run(main())
    """)
    process = await asyncio.create_subprocess_exec(sys.executable, "-c", server, stdout=asyncio.subprocess.PIPE)
    assert process.stdout is not None
    workers = [int(word) for word in (await asyncio.wait_for(process.stdout.readline(), 60)).split()]
    assert process_state(workers[0]) == "T"
    (zygote,) = children_of(process.pid)
    process.kill()
    await asyncio.wait_for(process.wait(), 60)
    for pid in (zygote, *workers):
        await until(partial(lambda pid: process_state(pid) in {"", "Z"}, pid))


@pytest.mark.slow  # in short: test_nothing_is_left_after_close
async def test_many_programs_at_once() -> None:
    async with Engine() as engine:
        played = await asyncio.gather(*(play(engine, f"print(cyberdog.echo({i}) + 1)") for i in range(60)))
    assert [one.output for one in played] == [f"{i + 1}\n" for i in range(60)]
