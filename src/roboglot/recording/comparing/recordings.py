"""Compares two recordings: the messages of one robot each, and what it did."""

from __future__ import annotations

from pathlib import Path

from roboglot.recording.comparing.comparison import Comparison, compare
from roboglot.recording.comparing.drives import Drive, compare_drives, read_drive
from roboglot.recording.comparing.masks import Mask
from roboglot.recording.reader import BadRecording, Recording, read_recording


def compare_recordings(one: Path, other: Path, mask: Mask, robot: str = "", door: str = "") -> Comparison:
    """Compare one robot of each (empty: the only one); ``door``: compare the messages of this protocol, nothing else.

    Raises BadRecording, OSError.
    """
    try:
        return _compared(one, other, mask, robot, door)
    except MemoryError:
        why = "out of memory: the recordings are too large to be compared"
        raise BadRecording(why) from None


def _compared(one: Path, other: Path, mask: Mask, robot: str, door: str) -> Comparison:
    found = read_recording(one), read_recording(other)
    names = [robot or _only_robot(recording) for recording in found]
    sessions = [recording.of(name, door) for recording, name in zip(found, names, strict=True)]
    drives = [Drive() if door else read_drive(r.path, name) for r, name in zip(found, names, strict=True)]
    for recording, session, drive in zip(found, sessions, drives, strict=True):
        if not (session or drive.tracks or drive.actions):
            raise BadRecording(f"{recording.path} has nothing of that robot and protocol")
    comparison = compare(sessions[0], sessions[1], mask)
    if door:
        comparison.reason = "--door leaves all else out"
    else:
        outcome = compare_drives(drives[0], drives[1], mask, (str(one), str(other)))
        comparison.drive, comparison.figures, comparison.reason = outcome.rows, outcome.figures, outcome.reason
    return comparison


def _only_robot(recording: Recording) -> str:
    names = recording.all_robots
    if len(names) > 1:
        raise BadRecording(f"{recording.path} has the robots {', '.join(names)}: choose one with --robot")
    return names[0] if names else ""
