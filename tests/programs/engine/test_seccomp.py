"""The system call filter, run by a small BPF machine: both tables, also the one of the machine we are not on."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.programs.worker.seccomp import SeccompUnavailable, program

KILL, REFUSE, ALLOW = 0x80000000, 0x00050001, 0x7FFF0000
ARCHITECTURE = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}
CALLS = {
    "x86_64": {
        "read": 0,
        "write": 1,
        "mmap": 9,
        "mprotect": 10,
        "open": 2,
        "socket": 41,
        "fork": 57,
        "execve": 59,
        "openat": 257,
    },
    "aarch64": {
        "read": 63,
        "write": 64,
        "mmap": 222,
        "mprotect": 226,
        "clone": 220,
        "socket": 198,
        "execve": 221,
        "openat": 56,
    },
}
FREE = {
    "x86_64": {11, 12, 15, 24, 25, 28, 60, 96, 202, 219, 228, 229, 231, 318},
    "aarch64": {93, 94, 98, 113, 114, 124, 128, 139, 169, 214, 215, 216, 233, 278},
}
MACHINES = sorted(ARCHITECTURE)


def verdict(machine: str, number: int, *arguments: int, architecture: int | None = None) -> int:
    """Return the filter's verdict on a system call."""
    six = (*arguments, *[0] * 6)[:6]
    known = ARCHITECTURE[machine] if architecture is None else architecture
    data = struct.pack("<iIQ6Q", number, known, 0, *six)
    code = list(struct.iter_unpack("=HBBI", program(machine)))
    position = accumulator = 0
    while True:
        operation, on_true, on_false, value = code[position]
        position += 1
        match operation:
            case 0x20:
                (accumulator,) = struct.unpack_from("<I", data, value)
            case 0x15:
                position += on_true if accumulator == value else on_false
            case 0x45:
                position += on_true if accumulator & value else on_false
            case 0x06:
                return int(value)
            case _:
                raise AssertionError(f"unknown instruction {operation:#x}")


@pytest.mark.parametrize("machine", MACHINES)
def test_only_the_socket_can_be_read_and_written(machine: str) -> None:
    for name in ("read", "write"):
        number = CALLS[machine][name]
        assert [verdict(machine, number, fd) for fd in (0, 1, 2, 3, 4)] == [REFUSE, REFUSE, REFUSE, ALLOW, REFUSE]


@pytest.mark.parametrize("machine", MACHINES)
def test_memory_is_never_executable(machine: str) -> None:
    for name in ("mmap", "mprotect"):
        number = CALLS[machine][name]
        assert [verdict(machine, number, 0, 4096, rights) for rights in range(8)] == [ALLOW] * 4 + [REFUSE] * 4


@pytest.mark.parametrize("machine", MACHINES)
def test_all_other_calls_are_refused(machine: str) -> None:
    conditional = {CALLS[machine][name] for name in ("read", "write", "mmap", "mprotect")}
    allowed = {number for number in range(1024) if number not in conditional and verdict(machine, number) == ALLOW}
    assert allowed == FREE[machine]
    refused = {
        name
        for name, number in CALLS[machine].items()
        if number not in conditional and verdict(machine, number) == REFUSE
    }
    assert refused == set(CALLS[machine]) - {"read", "write", "mmap", "mprotect"}


@given(st.sampled_from(MACHINES), st.integers(0, 2**31 - 1), st.integers(0, 2**32 - 1))
def test_foreign_architectures_die(machine: str, number: int, architecture: int) -> None:
    expected = verdict(machine, number) if architecture == ARCHITECTURE[machine] else KILL
    assert verdict(machine, number, architecture=architecture) == expected


def test_an_unknown_machine_has_no_filter() -> None:
    with pytest.raises(SeccompUnavailable, match="pdp11"):
        program("pdp11")
