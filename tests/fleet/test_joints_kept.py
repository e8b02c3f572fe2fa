"""Joints on the disk: what an older file says of a tie beyond what is needed does not cost the joint."""

import json
from pathlib import Path

import numpy as np

from contourslam.fleet.joints_kept import NAME, KeptJoint, keep_joint, kept_joints
from contourslam.joining.joint import Evidence, Joint, Tie


def test_a_joint_of_an_older_file_is_read_without_what_nobody_needs(tmp_path: Path) -> None:
    tie = Tie(3, 4, np.array([1.0, 2.0, 0.5]), np.diag([1e-4, 2e-4, 1e-6]))
    joint = Joint(np.array([0.1, 0.2, 0.3]), (tie,), Evidence(8, 9, 40.0, 0.01, 7.0, 0.2), "search")
    keep_joint(tmp_path, KeptJoint(5.0, joint, (("a", 1, 3),), (("b", 2, 4),)))
    row = json.loads((tmp_path / NAME).read_text())
    row["joint"]["ties"][0] |= {"overlap": 0.9, "residual": 0.01}
    with (tmp_path / NAME).open("a") as file:
        file.write(json.dumps(row) + "\n")
    first, second = kept_joints(tmp_path)
    for kept in (first, second):
        assert (kept.at, kept.first, kept.second) == (5.0, (("a", 1, 3),), (("b", 2, 4),))
        assert (kept.joint.evidence, kept.joint.method) == (joint.evidence, "search")
        (read,) = kept.joint.ties
        assert (read.first, read.second) == (3, 4)
        np.testing.assert_array_equal(read.pose, tie.pose)
        np.testing.assert_array_equal(read.covariance, tie.covariance)
