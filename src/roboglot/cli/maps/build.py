"""``roboglot map build``: makes a map, which every door can load, a trajectory and a report from a recorded drive."""

from __future__ import annotations

import math
import statistics
import sys
from pathlib import Path

import numpy as np

from roboglot.autonomy.slam.replaying import MappedDrive, map_recording
from roboglot.datasets.drive_log import DriveLog
from roboglot.datasets.formats import read_drive_log
from roboglot.datasets.measures import absolute_error, neighbour_relations, read_relations, relation_errors
from roboglot.demo.picture import draw
from roboglot.model.events import LocalizationLost, LocalizationRecovered, LoopClosed
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, composite_of
from roboglot.wire.slamware.chapters.slam.stcm import encode_stcm

BAR = 40  # characters


def build(log: Path, out: Path, relations: Path | None) -> None:
    """Map ``log`` into the folder ``out``. Raises BadDriveLog, OSError, ValueError."""
    from roboglot.cli.maps.ros_map import write_ros_map

    recording = read_drive_log(log)
    out.mkdir(parents=True, exist_ok=True)
    total, shown = len(recording.scans), -1

    def progress(done: int) -> None:
        nonlocal shown
        part = done * BAR // total
        if part != shown and sys.stderr.isatty():
            shown = part
            print(f"\r{'#' * part}{'.' * (BAR - part)} {done} of {total} scans", end="", file=sys.stderr, flush=True)

    drive = map_recording(recording, progress)
    if sys.stderr.isatty():
        print(file=sys.stderr)
    write_ros_map(drive.grid, out / "map.yaml")
    (out / "map.stcm").write_bytes(encode_stcm(composite_of(FloorMap(grid=drive.grid))))
    (out / "trajectory.tum").write_text(tum(drive), encoding="ascii")
    draw(drive.grid, {"robot": [(p.pose.x, p.pose.y) for p in drive.trajectory]}, recording.name, out / "map.png")
    text = report(recording, drive, relations)
    (out / "report.md").write_text(text, encoding="utf-8")
    print(text)


def tum(drive: MappedDrive) -> str:
    """Return the trajectory in TUM's format: stamp x y z qx qy qz qw."""
    lines = []
    for point in drive.trajectory:
        x, y, half = point.pose.x, point.pose.y, point.pose.yaw / 2
        lines.append(f"{point.stamp:.6f} {x:.4f} {y:.4f} 0 0 0 {math.sin(half):.6f} {math.cos(half):.6f}")
    return "".join(f"{line}\n" for line in lines)


def report(recording: DriveLog, drive: MappedDrive, relations: Path | None) -> str:
    """Return a report of the map in Markdown."""
    milliseconds = 1000.0 * np.array(drive.seconds)
    way_noise, yaw_noise = drive.noise
    size = f"{drive.grid.width * drive.grid.resolution:.1f} x {drive.grid.height * drive.grid.resolution:.1f} m"
    rows = [
        ("scans", f"{len(recording.scans)}"),
        ("map", size),
        ("closed loops", f"{drive.count(LoopClosed)}"),
        ("place lost, found again", f"{drive.count(LocalizationLost)}, {drive.count(LocalizationRecovered)}"),
        ("quality, median and least", f"{statistics.median(drive.qualities):.2f}, {min(drive.qualities):.2f}"),
        (
            "processor time a scan: mean, 99 %, most",
            f"{milliseconds.mean():.2f}, {np.percentile(milliseconds, 99):.1f}, {milliseconds.max():.1f} ms",
        ),
        ("noise of odometry's way and turning, times the assumed", f"{way_noise:.1f}, {yaw_noise:.1f}"),
        *accuracy(recording, drive, relations),
        *((f"left out: {reason}", f"{count}") for reason, count in sorted(recording.unread.items())),
    ]
    table = "".join(f"| {name} | {value} |\n" for name, value in rows)
    return f"# {recording.name}\n\n![map](map.png)\n\n| what | figure |\n|---|---|\n{table}"


def accuracy(recording: DriveLog, drive: MappedDrive, relations: Path | None) -> list[tuple[str, str]]:
    """Return rows of errors against the file of relations, or the log's reference, if there is one."""
    estimated = [(point.stamp, point.pose) for point in drive.trajectory]
    known = {item.scan.stamp: item.reference for item in recording.scans if item.reference is not None}
    pairs = [(stamp, pose, known[stamp]) for stamp, pose in estimated if stamp in known]
    rows = []
    if pairs:
        error = absolute_error([pose for _, pose, _ in pairs], [truth for *_, truth in pairs])
        rows.append(("ATE against the log's reference", f"{error:.3f} m"))
    wanted = read_relations(relations) if relations else neighbour_relations([(s, truth) for s, _, truth in pairs])
    if wanted:
        errors = relation_errors(estimated, wanted)
        rows.append(
            (
                f"{errors.count} relations",
                f"{errors.shift:.3f} ± {errors.shift_deviation:.3f} m, "
                f"{math.degrees(errors.turn):.2f} ± {math.degrees(errors.turn_deviation):.2f}°",
            )
        )
    return rows
