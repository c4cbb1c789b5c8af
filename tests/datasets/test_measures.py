"""Errors of trajectories against references."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from roboglot.datasets.drive_log import BadDriveLog
from roboglot.datasets.measures import absolute_error, neighbour_relations, read_relations, relation_errors
from roboglot.model.geometry import Pose

TRUTH = [Pose(math.cos(k / 5), math.sin(k / 5), k / 5) for k in range(20)]


def test_another_origin_is_no_error() -> None:
    moved = [Pose(3.0, -2.0, 1.2).compose(pose) for pose in TRUTH]
    assert absolute_error(moved, TRUTH) < 1e-9
    stamped = [(float(k), pose) for k, pose in enumerate(moved)]
    errors = relation_errors(stamped, neighbour_relations([(float(k), pose) for k, pose in enumerate(TRUTH)]))
    assert errors.count == 19
    assert errors.shift < 1e-9
    assert errors.turn < 1e-9


def test_one_bad_step_is_one_bad_relation() -> None:
    bent = TRUTH[:10] + [Pose(0.5, 0.0, 0.3).compose(pose) for pose in TRUTH[10:]]
    relations = neighbour_relations([(float(k), pose) for k, pose in enumerate(TRUTH)])
    errors = relation_errors([(float(k), pose) for k, pose in enumerate(bent)], relations)
    assert errors.turn == pytest.approx(0.3 / 19)
    assert absolute_error(bent, TRUTH) > 0.1


def test_relations_are_read_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "log.relations").write_text("# t1 t2 x y z roll pitch yaw\n1.0 2.0 0.5 0 0 0 0 0.1\n")
    (relation,) = read_relations(tmp_path / "log.relations")
    assert relation.between == Pose(0.5, 0.0, 0.1)
    (tmp_path / "bad").write_text("1 2 3\n")
    with pytest.raises(BadDriveLog, match="line 1"):
        read_relations(tmp_path / "bad")
