"""Artifacts of a failed test: its recording, a picture of the map, a page of the last exchanges."""

from __future__ import annotations

import logging
import re
from collections.abc import Sequence
from pathlib import Path

from roboglot.testing.page import page
from roboglot.testing.picture import picture
from roboglot.testing.server import RobotServer

log = logging.getLogger(__name__)
FOLDER = "roboglot-failures"
NAME_MAX = 120


def folder_of(root: Path, test: str) -> Path:
    """Return the folder of a test's artefacts; ``test`` is its id."""
    return root / (re.sub(r"[^\w.-]+", "-", test).strip("-.")[-NAME_MAX:] or "test")


def save(server: RobotServer, folder: Path, title: str, failure: str) -> Sequence[Path]:
    """Write all three and return the files written. Never raises: the test's own failure must stay visible."""
    saved: list[Path] = []
    drawn: bytes | None = None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        drawn = server.call(_draw, server)
        if drawn is not None:
            (folder / "map.png").write_bytes(drawn)
            saved.append(folder / "map.png")
        (folder / "exchanges.html").write_text(page(title, failure, tuple(server.exchanges), drawn), encoding="utf-8")
        saved.append(folder / "exchanges.html")
        if server.runtime.config.record.ring:
            recording = folder / "recording.mcap"
            server.call(server.runtime.recorder.save_ring, recording)
            saved.append(recording)
    except Exception:
        log.exception("cannot save all artifacts of %s", title)
    return saved


def _draw(server: RobotServer) -> bytes | None:
    stage = server.runtime.fleet.world.stage
    if not stage.robots or not stage.floors:
        return None
    floor = stage.floors[min(stage.robots[0].floor, len(stage.floors) - 1)]
    here = [placed for placed in stage.robots if placed.floor == floor.number]
    people = [placed for placed in stage.people if placed.floor == floor.number]
    return picture(floor, here, people, server.tracks)
