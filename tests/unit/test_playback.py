"""A path through kept poses."""

import numpy as np
import pytest

from kinetostat.studio.playback import STEPS_BETWEEN_KEPT_POSES as STEPS
from kinetostat.studio.playback import poses_between


def test_a_path_goes_evenly_through_all_kept_poses():
    path = poses_between(
        [{"pose.x": 0.0, "pose.z": 1.0}, {"pose.x": 0.2, "pose.z": 1.0}, {"pose.x": 0.2, "pose.z": 0.5}]
    )
    assert set(path) == {"pose.x", "pose.z"}
    assert len(path["pose.x"]) == 2 * STEPS + 1
    assert path["pose.x"][[0, STEPS, -1]] == pytest.approx([0.0, 0.2, 0.2])
    assert path["pose.z"][[0, STEPS, -1]] == pytest.approx([1.0, 1.0, 0.5])
    assert np.diff(path["pose.x"][: STEPS + 1]) == pytest.approx([0.2 / STEPS] * STEPS)
