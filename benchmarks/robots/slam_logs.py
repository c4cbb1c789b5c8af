"""Claim: logs of real robots map as well as the best published: CSAIL's ATE <= 0.12 m. One set of parameters for all.

The logs are looked for in the folder that ROBOGLOT_LOGS or the first argument names, and skipped if there is none.
A log without a reference claims nothing: its figures are printed.
"""

from __future__ import annotations

import os
import statistics
import sys
from pathlib import Path

from _claim import Claims

from roboglot.autonomy.slam.replaying import map_recording
from roboglot.datasets.drive_log import BadDriveLog
from roboglot.datasets.formats import read_drive_log
from roboglot.datasets.measures import absolute_error, neighbour_relations, relation_errors
from roboglot.model.events import LocalizationLost, LoopClosed

LIMITS = {"csail": 0.12}  # m of ATE


def main() -> None:
    folder = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("ROBOGLOT_LOGS", "")
    if not folder:
        print("skipped: no logs; name their folder by ROBOGLOT_LOGS or as an argument")
        return
    claims = Claims()
    for path in sorted(item for item in Path(folder).iterdir() if item.is_file() and item.suffix != ".md"):
        try:
            measure(path, claims)
        except BadDriveLog as error:
            print(f"skipped: {error}")
    claims.finish()


def measure(path: Path, claims: Claims) -> None:
    """Map one log; print how well that went, with claims if the log has reference poses. Raises BadDriveLog."""
    recording = read_drive_log(path)
    drive = map_recording(recording)
    print(
        f"{path.name:24} {len(recording.scans):5} scans, {drive.count(LoopClosed)} loops, "
        f"{drive.count(LocalizationLost)} times lost, quality {statistics.median(drive.qualities):.2f}, "
        f"{1000 * statistics.median(drive.seconds):.2f} ms a scan"
    )
    truth = {item.scan.stamp: item.reference for item in recording.scans if item.reference is not None}
    pairs = [(p.stamp, p.pose, truth[p.stamp]) for p in drive.trajectory if p.stamp in truth]
    if not pairs:
        return
    errors = relation_errors([(s, p) for s, p, _ in pairs], neighbour_relations([(s, t) for s, _, t in pairs]))
    print(f"{'':24} {errors.count} relations: {errors.shift:.3f} m")
    ate = absolute_error([p for _, p, _ in pairs], [t for *_, t in pairs])
    claims.at_most(f"ATE of {path.stem}", ate, LIMITS.get(path.stem, float("inf")), "m")


if __name__ == "__main__":
    main()
