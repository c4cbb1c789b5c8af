"""The systemd unit that ships: how much it gives away, and that block programs are confined inside of it as outside."""

from __future__ import annotations

import ctypes.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

UNIT = Path(__file__).parents[1] / "packaging" / "roboglot.service"
EXPOSURE_MAX = 2.0

# Applies the unit's limits on system calls, capabilities and namespaces, then runs a program in the engine.
INSIDE = r"""
import asyncio, ctypes, os, sys
ERRNO, NO_CALL, ALLOW, MASKED_EQ, NEW_PRIVS = 0x00050001, 0x00050026, 0x7FFF0000, 7, 38
calls, denied = sys.argv[1].split(), int(sys.argv[2])
lib, libc = ctypes.CDLL("libseccomp.so.2"), ctypes.CDLL(None)
class Compare(ctypes.Structure):
    _fields_ = [("arg", ctypes.c_uint), ("op", ctypes.c_int), ("a", ctypes.c_uint64), ("b", ctypes.c_uint64)]
lib.seccomp_init.restype = ctypes.c_void_p
context = ctypes.c_void_p(lib.seccomp_init(ERRNO))
resolve = lambda name: lib.seccomp_syscall_resolve_name(name.encode())
flags = {"unshare": 0, "clone": 0}
for name in calls:
    if name not in flags and name != "clone3" and resolve(name) >= 0:
        assert lib.seccomp_rule_add_array(context, ALLOW, resolve(name), 0, None) == 0, name
for name, argument in flags.items():
    rule = (Compare * 1)(Compare(argument, MASKED_EQ, denied, 0))
    assert lib.seccomp_rule_add_array(context, ALLOW, resolve(name), 1, rule) == 0
lib.seccomp_rule_add_array(context, NO_CALL, resolve("clone3"), 0, None)  # its flags cannot be seen; as systemd does
libc.prctl(NEW_PRIVS, 1, 0, 0, 0)
assert lib.seccomp_load(context) == 0
from roboglot.programs.engine.engine import Engine
from roboglot.programs.engine.events import Finished, Output
async def main():
    async with Engine() as engine:
        print("layers:", ", ".join(engine.layers))
        run = await engine.start("print(6 * 7)\n")
        async for event in run:
            print(event)
asyncio.run(main())
"""

NAMESPACES = {"cgroup": 0x02000000, "ipc": 0x08000000, "net": 0x40000000, "mnt": 0x00020000, "pid": 0x20000000,
              "user": 0x10000000, "uts": 0x04000000, "time": 0x00000080}  # fmt: skip


def setting(name: str) -> list[str]:
    """Return the values of a setting, one for each line."""
    return re.findall(rf"^{name}=(.*)$", UNIT.read_text(), re.MULTILINE)


def group(name: str) -> set[str]:
    """Return the system calls of systemd's group."""
    listed = subprocess.run(["systemd-analyze", "syscall-filter", name], capture_output=True, text=True, check=True)
    lines = map(str.strip, listed.stdout.splitlines()[1:])
    names = {line for line in lines if line and not line.startswith("#")}
    return {call for each in names for call in (group(each) if each.startswith("@") else {each})}


def allowed() -> set[str]:
    """System calls that the unit allows."""
    calls: set[str] = set()
    for line in setting("SystemCallFilter"):
        named = {call for word in line.lstrip("~").split() for call in (group(word) if word[0] == "@" else {word})}
        calls = calls - named if line.startswith("~") else calls | named
    return calls


needs_systemd = pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="systemd is not installed")


@needs_systemd
def test_the_unit_gives_little_away() -> None:
    command = ["systemd-analyze", "security", "--offline=true", "--no-pager", str(UNIT)]
    said = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
    exposure = re.search(r"exposure level.*: ([0-9.]+)", said.stdout)
    if exposure is None:
        pytest.skip(f"this systemd judges no files: {said.stderr}")
    assert "Unknown" not in said.stderr
    assert float(exposure[1]) <= EXPOSURE_MAX


@needs_systemd
def test_programs_are_confined_in_it() -> None:
    if ctypes.util.find_library("seccomp") is None:
        pytest.skip("libseccomp is not installed")
    [namespaces] = setting("RestrictNamespaces")
    denied = sum(flag for name, flag in NAMESPACES.items() if name not in namespaces.split())
    command = [sys.executable, "-c", INSIDE, " ".join(sorted(allowed())), str(denied)]
    if os.geteuid() == 0:  # the unit has a user without capabilities
        command = ["setpriv", "--bounding-set=-all", "--inh-caps=-all", "--no-new-privs", *command]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=180, check=False)
    assert ended.returncode == 0, ended.stderr
    if "namespaces" not in ended.stdout and subprocess.run(["unshare", "--user", "true"], check=False).returncode:
        pytest.skip("no user namespaces here, as in a chroot")
    assert "namespaces" in ended.stdout
    assert "seccomp" in ended.stdout
    assert "42" in ended.stdout


def test_kernels_have_a_folder_in_it() -> None:
    """Its user has no home: without kernels beside the code, robots had no navigation."""
    [folder] = setting("CacheDirectory")
    assert f"XDG_CACHE_HOME=%C/{folder}" in setting("Environment")


def test_the_unit_starts_what_there_is() -> None:
    [command] = setting("ExecStart")
    assert " up --config " in command
    assert "--insecure" not in command
