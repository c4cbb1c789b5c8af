"""Compiling ahead: what is compiled is known, and a cache that cannot be written is one sentence."""

from __future__ import annotations

import asyncio
import hashlib
import logging
import subprocess
import sys
import threading
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import pytest

from roboglot.autonomy import skills
from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.kernels import MODULES, ahead
from roboglot.kernels.ahead import KernelsUnavailable, compile_ahead, compile_beside, missing
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.errors import NotReady, Refused
from roboglot.model.events import FaultRaised
from roboglot.model.geometry import Point
from roboglot.simulation.world import world
from roboglot.storage.database import Database

UNAVAILABLE = "navigation unavailable"


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    ahead.cache_folder.cache_clear()
    yield tmp_path
    monkeypatch.undo()
    ahead.cache_folder.cache_clear()


@pytest.fixture
def no_cache(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/proc/no/such/folder")
    ahead.cache_folder.cache_clear()
    yield
    monkeypatch.undo()
    ahead.cache_folder.cache_clear()


@pytest.fixture
async def fleet_of_one() -> AsyncIterator[Fleet]:
    database = Database(":memory:")
    fleet = build_fleet("empty", [RobotConfig(name="a")], clock=LockstepClock(), seed=1, database=database)
    yield fleet
    await fleet.close()
    database.close()


@pytest.mark.parametrize("names", [("linear",), pytest.param(("linear", "touring"), marks=pytest.mark.slow)])
async def test_compiled_kernels_are_remembered(cache: Path, names: tuple[str, ...]) -> None:
    assert missing() == list(MODULES)
    seen: list[tuple[str, int, int]] = []
    compile_ahead(names, lambda *progress: seen.append(progress))
    assert {name for name, _, _ in seen} == set(names)
    assert [(done, total) for _, done, total in seen] == [(done, len(names)) for done in range(1, len(names) + 1)]
    assert set(missing()) == set(MODULES) - set(names)
    await compile_beside(["linear"], lambda *_progress: pytest.fail("it is compiled already"))


@pytest.mark.slow
async def test_robots_share_one_compiler(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[object] = []
    begin = asyncio.create_subprocess_exec

    async def counted(*command: str, **options: Any) -> asyncio.subprocess.Process:
        begun.append(command)
        return await begin(*command, **options)

    monkeypatch.setattr(asyncio, "create_subprocess_exec", counted)
    await asyncio.gather(*(compile_beside(["linear"]) for _ in range(20)))
    assert len(begun) == 1
    assert "linear" not in missing()


async def test_looking_for_kernels_delays_no_start(fleet_of_one: Fleet, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the first time, it reads the sources: that takes as long as opening all doors."""
    looked = set[threading.Thread]()

    def look(*modules: object) -> list[str]:
        looked.add(threading.current_thread())
        return missing(*modules)  # type: ignore[arg-type]

    monkeypatch.setattr(world, "missing", look)
    monkeypatch.setattr(skills, "missing", look)
    await fleet_of_one.start(wait=True)
    assert looked
    assert threading.main_thread() not in looked


async def test_an_unwritable_cache_is_one_sentence(no_cache: None) -> None:
    with pytest.raises(KernelsUnavailable, match="cannot hold compiled kernels"):
        compile_ahead(["linear"])
    with pytest.raises(KernelsUnavailable, match="cannot hold compiled kernels"):
        await compile_beside(["linear"])
    command = [sys.executable, "-m", "roboglot.kernels"]
    ended = await asyncio.to_thread(subprocess.run, command, capture_output=True, text=True)
    assert ended.returncode == 1
    assert len(ended.stderr.strip().splitlines()) == 1


async def test_without_kernels_navigation_says_why(
    no_cache: None, fleet_of_one: Fleet, caplog: pytest.LogCaptureFixture
) -> None:
    robot = fleet_of_one.robots["a"]
    await fleet_of_one.start(wait=True)
    (fault,) = [fault for fault in robot[Health].faults if fault.name == UNAVAILABLE]
    assert fault.level is FaultLevel.ERROR
    assert "cannot hold compiled kernels" in fault.message
    assert not any(record.exc_info for record in caplog.records if record.levelname != "DEBUG")
    with pytest.raises(Refused, match="cannot hold compiled kernels"):
        robot[Navigation].navigate_to([Point(1.0, 0.0)], NavigationOptions())


async def test_navigation_is_not_ready_while_compiling(
    fleet_of_one: Fleet, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    compiled = asyncio.Event()

    async def compile_slowly(*_: object, **__: object) -> None:
        await compiled.wait()

    monkeypatch.setattr(skills, "missing", lambda _: ["graph"])
    monkeypatch.setattr(skills, "compile_beside", compile_slowly)
    robot = fleet_of_one.robots["a"]
    await fleet_of_one.start(wait=False)
    async with asyncio.timeout(60):
        while not robot[Health].has(UNAVAILABLE):  # noqa: ASYNC110 - a thread looks for them
            await asyncio.sleep(0.001)
    assert "robot a can be driven, seen and programmed; maps, localization and navigation follow" in caplog.text
    with pytest.raises(NotReady, match="warming up"):
        robot[Navigation].navigate_to([Point(1.0, 0.0)], NavigationOptions())
    search = robot[Localization].relocalize()
    assert isinstance(robot.clock, LockstepClock)
    await robot.clock.advance(11.0)
    assert isinstance(search.error, NotReady)
    assert not robot[Health].has("not localized"), "nothing has looked for its place yet"
    compiled.set()
    await fleet_of_one.start(wait=True)
    assert not robot[Health].has(UNAVAILABLE)
    assert robot[Navigation].navigate_to([Point(1.0, 0.0)], NavigationOptions())


async def test_compiling_leaves_no_trace_in_lockstep(fleet_of_one: Fleet, monkeypatch: pytest.MonkeyPatch) -> None:
    """A recording made right after an installation is like one that is made later."""

    async def compile_at_once(*_: object, **__: object) -> None:
        await asyncio.sleep(0)

    monkeypatch.setattr(skills, "missing", lambda _: ["graph"])
    monkeypatch.setattr(skills, "compile_beside", compile_at_once)
    raised: list[FaultRaised] = []
    fleet_of_one.robots["a"].events.listen(FaultRaised, raised.append)
    await fleet_of_one.start(wait=True)
    assert raised == []


def test_changes_of_built_in_kernels_are_noticed(cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sources = tmp_path / "kernels"
    sources.mkdir()
    for name, text in (
        ("compiled", ""),
        ("linear", "from roboglot.kernels.compiled import kernel\n"),
        ("graph", "from roboglot.kernels.compiled import kernel\nfrom roboglot.kernels.linear import invert\n"),
        ("touring", "from roboglot.kernels.compiled import kernel\n"),
    ):
        (sources / f"{name}.py").write_text(text)
    monkeypatch.setattr(ahead, "HERE", sources)
    ahead._sources.cache_clear()
    built: list[list[str]] = []

    def note(names: list[str]) -> Iterator[str]:
        built.append(list(names))
        yield from names

    monkeypatch.setattr(ahead, "_compiled", note)
    names = ["linear", "graph", "touring"]
    compile_ahead(names)
    kept = tmp_path / f"kernels_{hashlib.sha1(str(sources).encode()).hexdigest()}"
    kept.mkdir()
    python = f"py{sys.version_info.major}{sys.version_info.minor}"
    for name in names:
        for end in (f"{python}.nbi", f"{python}.1.nbc", "py39.nbi"):
            (kept / f"{name}.f-1.{end}").touch()
    (sources / "linear.py").write_text("from roboglot.kernels.compiled import kernel\n# changed\n")
    assert missing(names) == ["linear", "graph"]
    compile_ahead(names)
    assert built == [names, ["linear", "graph"]]
    left = {file.name for file in kept.iterdir() if python in file.name}
    assert left == {f"touring.f-1.{python}.nbi", f"touring.f-1.{python}.1.nbc"}, "Numba would take the old ones"
    assert len(list(kept.glob("*.py39.nbi"))) == len(names), "another Python has marks of its own"
    (sources / "compiled.py").write_text("# changed\n")
    assert missing(names) == names
    ahead._sources.cache_clear()
