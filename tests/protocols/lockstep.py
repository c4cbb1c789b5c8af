"""A robot in lockstep behind doors that a test names, as ``roboglot up --world empty --lockstep`` starts it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from roboglot.config import load_config
from roboglot.protocols import DOORS, sections
from roboglot.runtime import Runtime


async def lockstep_runtime(data: Path, address: str, *doors: str, **more: Any) -> Runtime:
    """Return a running program with the robot "a" and these ``doors``. ``more``: further keys of its configuration."""
    values: dict[str, Any] = {
        "data": str(data),
        "world": "empty",
        "lockstep": True,
        "robots": [{"name": "a", "body": "universal", "address": address}],
        "console": {"enabled": False},
    }
    config = load_config(None, values | more, sections())
    runtime = Runtime(config, tuple(door for door in DOORS if door.name in doors))
    await runtime.start()
    return runtime
