"""Output of ``roboglot --version``: the version, the installed extras, kernels, and the layers of the jail."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from importlib.metadata import version

from roboglot.extras import MODULES, installed, is_there


def about() -> Iterator[str]:
    """Yield the lines; the first is ``roboglot VERSION``."""
    yield f"roboglot {version('roboglot')}"
    yield f"python     {platform.python_version()}, {platform.system()} {platform.machine()}"
    there = installed()
    yield f"extras     {' '.join(extra for extra in MODULES if there[extra]) or 'none: the core only'}"
    missing = [extra for extra in MODULES if not there[extra]]
    if missing:
        yield f"missing    {' '.join(missing)}: pip install 'roboglot[{','.join(missing)}]'"
    yield f"kernels    {_kernels()}"
    yield f"jail       {_jail()}"


def _kernels() -> str:
    if not is_there("numba"):
        return "not here: they need numba, of roboglot[simulation]"
    from roboglot.kernels import MODULES as KERNELS
    from roboglot.kernels.ahead import missing

    waiting = missing()
    return f"{len(KERNELS) - len(waiting)} of {len(KERNELS)} compiled" + (
        ", the rest at the first start" * bool(waiting)
    )


def _jail() -> str:
    """Return the layers that confine users' programs, found by starting a sandbox."""
    if not is_there("numpy"):
        return "not here: programs need numpy, of roboglot[programs]"
    from roboglot.cli.doctor import examine_sandbox

    return examine_sandbox().seen
