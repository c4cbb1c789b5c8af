"""The programs' control group, on folders that look like the kernel's."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from roboglot.programs.engine.processor_group import ProcessorGroup


def machine(tmp_path: Path, membership: str, parent: str) -> tuple[Path, Path]:
    """Return a root of control groups and a /proc with process 7, a child of 5."""
    root, proc = tmp_path / "cgroup", tmp_path / "proc"
    (root / parent).mkdir(parents=True)
    (proc / "self").mkdir(parents=True)
    (proc / "self" / "cgroup").write_text(membership)
    (proc / "7").mkdir()
    (proc / "7" / "stat").write_text("7 (a) b) S 5 7 7 0")
    return root, proc


@pytest.mark.parametrize(
    ("membership", "parent", "file"),
    [
        ("4:memory:/x\n1:cpu:/robots\n0::/\n", "cpu/robots", "cpu.shares"),
        ("0::/user.slice/me\n", "user.slice/me", "cpu.weight"),
    ],
)
def test_programs_are_weighed_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, membership: str, parent: str, file: str
) -> None:
    root, proc = machine(tmp_path, membership, parent)
    made = Path.mkdir

    def as_the_kernel_does(self: Path, *args: object, **kwargs: object) -> None:
        made(self, exist_ok=True)
        (self / file).write_text("1024")

    monkeypatch.setattr(Path, "mkdir", as_the_kernel_does)
    group = ProcessorGroup(root, proc)
    assert group.open() == ["cpu group"]
    folder = root / parent / f"roboglot-programs-{os.getpid()}"
    assert int((folder / file).read_text()) < 300
    group.take(7, parent=6)
    group.take(8, parent=5)
    assert not (folder / "cgroup.procs").exists()
    group.take(7, parent=5)
    assert (folder / "cgroup.procs").read_text() == "7"
    for entry in folder.iterdir():
        entry.unlink()  # the kernel's files do not keep a folder from being removed
    group.close()
    assert not folder.exists()
    assert not group.there


def test_without_the_right_nothing_is_done(tmp_path: Path) -> None:
    root, proc = machine(tmp_path, "0::/user\n", "user")  # a hierarchy without the processor controller
    (root / "user" / "roboglot-programs-999999").mkdir()
    group = ProcessorGroup(root, proc)
    assert group.open() == []
    group.take(7, parent=5)
    group.close()
    assert list((root / "user").iterdir()) == []
    assert ProcessorGroup(root, tmp_path / "nothing").open() == []
