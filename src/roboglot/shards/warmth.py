"""Imports and kernels that a shard needs, loaded before the first fork, without starting a thread."""

from __future__ import annotations

import gc
import importlib
import os
import pkgutil
import subprocess
import sys
from collections.abc import Iterable, Iterator

PACKAGES = ("runtime", "simulation", "autonomy", "storage", "protocols", "programs", "console", "access")
SELDOM = (  # modules that few shards need, or that are programs of their own
    "roboglot.programs.worker",
    "roboglot.protocols.cyberdog.app_link",
    "roboglot.storage.postgresql",
)
FOREIGN = (
    "cryptography.hazmat.backends.openssl.backend",
    "encodings.idna",
    "grpc.aio",
    "mujoco",
    "numpy.ma",
    "unicodedata",
    "uvicorn.lifespan.off",
    "uvicorn.protocols.http.httptools_impl",
    "uvicorn.protocols.websockets.wsproto_impl",
    "uvloop",
    "websockets.server",
    "wsproto",
)
ENVIRONMENT = {  # of the nursery: keeps libraries from starting threads, and gRPC from handling forks
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "GRPC_VERBOSITY": "NONE",
    "GRPC_ENABLE_FORK_SUPPORT": "0",
}
TASKS = "/proc/self/task"


class Threaded(RuntimeError):
    """An import started a thread in the process that must be able to fork."""


def warm() -> None:
    """Load everything, then freeze it, so that garbage collection copies no shared pages. Raises Threaded."""
    _compile()
    gc.disable()
    for name in modules_of(PACKAGES):
        try:
            importlib.import_module(name)
        except ModuleNotFoundError as missing:  # the extra is not installed; code that needs it reports that
            if (missing.name or "").startswith("roboglot"):
                raise
    for name in FOREIGN:
        importlib.import_module(name)
    from roboglot.kernels import MODULES, loading

    with loading():
        for name in MODULES:
            importlib.import_module(f"roboglot.kernels.{name}")
    _rehearse()
    gc.collect()
    gc.freeze()
    gc.enable()
    refuse_threads()


def _compile() -> None:
    """Compile missing kernels in a process of its own: here, a compiler would leave 400 MB to every fork."""
    from roboglot.kernels.ahead import missing

    if missing():
        command = [sys.executable, "-m", "roboglot.kernels"]
        subprocess.run(command, stdin=subprocess.DEVNULL, stdout=sys.stderr, check=False)  # else they are compiled here


def _rehearse() -> None:
    """Build a world once and drop it, so that every fork inherits the caches of decoders, parts and physics."""
    from roboglot.model.clock import LockstepClock
    from roboglot.model.robot import Robot
    from roboglot.shards.shard import settings_of
    from roboglot.simulation.world.world import RobotPlacement, World
    from roboglot.simulation.world.world_files import load_world

    config, clock = settings_of({}), LockstepClock()
    name = config.robots[0].name
    world = World(load_world(config.world), [RobotPlacement(name)], clock=clock)
    world.equip(Robot(name, world.description_of(name), clock))
    world.close()


def refuse_threads() -> None:
    """Raise Threaded if this process has more than one thread: a fork would copy their locks and not the threads."""
    if os.path.isdir(TASKS) and len(os.listdir(TASKS)) > 1:
        raise Threaded(f"a module started a thread when it was imported; {len(os.listdir(TASKS))} run")


def modules_of(packages: Iterable[str]) -> Iterator[str]:
    """Import packages of roboglot; return the names of their modules as well that are not imported yet."""
    for package in packages:
        name = f"roboglot.{package}"
        yield name
        for path in getattr(importlib.import_module(name), "__path__", ()):
            for found in pkgutil.walk_packages([path], f"{name}."):
                if found.name not in sys.modules and not _is_seldom(found.name):
                    yield found.name


def _is_seldom(name: str) -> bool:
    return name.endswith("__main__") or any(name == own or name.startswith(f"{own}.") for own in SELDOM)
