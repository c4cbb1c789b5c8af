"""Extras beyond the core: the modules of each, and the message if one is missing.

The core (``pip install roboglot``) holds the clients and the commands that need no robot of our own; everything else
comes with an extra. Also the version. Imports nothing outside the standard library.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from importlib import import_module
from importlib.util import find_spec, module_from_spec
from types import ModuleType

# The extra to install for a module; for a module in several extras, the one most likely missing.
EXTRA_OF = {
    "aiomqtt": "vda5050",
    "aiortc": "video",
    "av": "video",
    "cryptography": "cyberdog",
    "cv2": "demo",
    "foxglove_schemas_protobuf": "recording",
    "google": "cyberdog",  # protobuf
    "grpc": "cyberdog",
    "hpack": "recording",
    "httptools": "slamware",
    "httpx": "demo",
    "llvmlite": "simulation",
    "mcap": "recording",
    "mcp": "mcp",
    "mujoco": "simulation",
    "numba": "simulation",
    "numpy": "simulation",
    "opentelemetry": "otlp",
    "PIL": "simulation",
    "prometheus_client": "console",
    "psycopg": "postgresql",
    "pytest_asyncio": "testing",
    "ray": "fleet",
    "robomasterpy": "demo",
    "rosbags": "logs",
    "uvicorn": "console",
    "uvloop": "up",
    "websockets": "programs",
    "wsproto": "console",
    "yaml": "simulation",
    "zenoh": "ros2",
    "zstandard": "recording",
}
# The modules in each extra that is made of no others.
MODULES: dict[str, tuple[str, ...]] = {
    "simulation": ("mujoco", "numba", "llvmlite", "numpy", "PIL", "yaml"),
    "slamware": ("httptools", "numpy", "uvicorn", "uvloop"),
    "cyberdog": ("cryptography", "grpc", "google", "numpy"),
    "video": ("aiortc", "av", "numpy", "PIL"),
    "programs": ("numpy", "websockets"),
    "console": ("httptools", "numpy", "prometheus_client", "uvicorn", "uvloop", "wsproto"),
    "recording": ("foxglove_schemas_protobuf", "google", "hpack", "httptools", "mcap", "numpy", "zstandard"),
    "logs": ("rosbags",),
    "postgresql": ("psycopg",),
    "testing": ("pytest_asyncio",),
    "mcp": ("mcp",),
    "otlp": ("opentelemetry.proto", "prometheus_client"),
    "vda5050": ("aiomqtt",),
    "fleet": ("ray",),
    "ros2": ("zenoh", "rosbags", "foxglove_schemas_protobuf", "google", "mcap", "numpy", "zstandard"),
    "demo": ("httpx", "robomasterpy", "cv2"),
}
# The extras that ``up`` is made of.
UP = ("simulation", "slamware", "cyberdog", "video", "programs", "console", "recording")


class MissingExtra(ModuleNotFoundError):
    """The packages of a part of roboglot are not installed; the text says how to install them."""


@contextmanager
def explaining(what: str, extra: str) -> Iterator[None]:
    """Context for imports: a missing module raises MissingExtra, which says that ``what`` needs ``extra``."""
    try:
        yield
    except ModuleNotFoundError as error:
        words = explained(error, what, extra)
        if words is None:
            raise
        raise MissingExtra(words, name=error.name) from None


def explained(error: ModuleNotFoundError, what: str, extra: str = "") -> str | None:
    """Return a sentence about a missing module, which names ``extra`` if that brings it; None if no extra does."""
    if isinstance(error, MissingExtra) and not str(error).startswith("roboglot."):  # those are for other programs
        return str(error)
    name = (error.name or "").partition(".")[0]
    if name not in EXTRA_OF:
        return None
    return in_words(what, [name], extra if name in _brought(extra) else EXTRA_OF[name])


def _brought(extra: str) -> set[str]:
    """Return the modules that installing this extra, or several with commas, brings."""
    parts = {"up": UP, "demo": (*UP, "demo"), "testing": ("simulation", "testing")}.get(extra, extra.split(","))
    return {module for part in parts for module in MODULES.get(part, ())}


def refuse_without(what: str, extra: str, modules: Iterable[str]) -> None:
    """Raise MissingExtra if any of these modules is not installed."""
    if missing := [module for module in modules if not is_there(module)]:
        raise MissingExtra(in_words(what, missing, extra))


def in_words(what: str, missing: list[str], extra: str) -> str:
    """Return the sentence about missing modules, with the command that installs them."""
    verb = "is" if len(missing) == 1 else "are"
    return f"{what} needs {' and '.join(missing)}, which {verb} not installed: pip install 'roboglot[{extra}]'"


def is_there(module: str) -> bool:
    """Return whether the module can be imported, without importing it."""
    try:
        return find_spec(module) is not None
    except (ImportError, ValueError):
        return False


def installed() -> dict[str, bool]:
    """Return, by extra, whether all its modules are installed."""
    return {extra: all(map(is_there, modules)) for extra, modules in MODULES.items()}


class _Lazy(ModuleType):
    """Stand-in for a module, imported at the first use of an attribute; each attribute is looked up once."""

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):  # Python itself asks modules for these
            raise AttributeError(name)
        try:
            module = import_module(self.__name__)
        except ModuleNotFoundError as error:
            words = explained(error, "this")
            raise MissingExtra(words, name=error.name) if words else error from None
        value = getattr(module, name)
        setattr(self, name, value)
        return value


def lazy(module: str) -> object:
    """Return a module that is imported at its first use; that raises MissingExtra if its extra is not installed."""
    return _Lazy(module)


def open_uvicorn() -> None:
    """Put a package ``uvicorn`` into ``sys.modules`` whose own ``__init__`` runs only when a name of it is used.

    It imports uvicorn's command line (1.5 MB in each process), which the doors and the console do not use; Python has
    no other way to import a package's modules without its ``__init__``.
    """
    if "uvicorn" in sys.modules or (spec := find_spec("uvicorn")) is None or (loader := spec.loader) is None:
        return
    package = module_from_spec(spec)

    def look_up(name: str) -> object:
        if name == "Config":
            return import_module("uvicorn.config").Config
        vars(package).pop("__getattr__", None)
        loader.exec_module(package)
        return getattr(package, name)

    vars(package)["__getattr__"] = look_up
    sys.modules["uvicorn"] = package


@cache
def own_version() -> str:
    """Return roboglot's version from the name of its entry among the installed packages.

    ``importlib.metadata`` reads it there as well, but takes 20 ms of a start to load. Raises PackageNotFoundError.
    """
    before, after = "roboglot-", ".dist-info"
    for folder in sys.path:
        with suppress(OSError):  # not a folder
            for name in os.listdir(folder or "."):
                if name.startswith(before) and name.endswith(after):
                    return name.removeprefix(before).removesuffix(after)
    from importlib.metadata import version

    return version("roboglot")
