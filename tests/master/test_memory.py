"""What does not fit is refused before it is tried."""

import numpy as np
import pytest

from railcosim.master.course import MOST_STEPS, count_steps
from railcosim.master.memory import TooLargeError, afford, available


def test_what_is_there_can_be_had():
    """And an array of it is a small part: 8 MB of the GB of any machine."""
    free = available()
    assert 1e8 < free < 1e14
    afford(np.ones(1_000_000).nbytes, "a million numbers", "take fewer")


def test_the_least_limit_counts(tmp_path, monkeypatch):
    most, used = tmp_path / "max", tmp_path / "current"
    most.write_text("2000000\n")
    used.write_text("500000\n")
    monkeypatch.setattr("railcosim.master.memory._LIMITS", {str(most): str(used)})
    assert available() == 1_500_000
    afford(1_500_000, "it", "")
    with pytest.raises(TooLargeError, match=r"it need 0.00151 GB of memory, and 0.0015 GB can be"):
        afford(1_510_000, "it", "")
    most.write_text("max\n")  # no limit
    assert available() > 1e8


@pytest.mark.parametrize(
    ("start", "stop", "step", "steps"),
    [(0, 1, 1e-4, 10_000), (0, 1, 0.3, 4), (2, 3, 1, 1), (0, 0.3, 0.3 * (1 + 1e-15), 1)],
)
def test_steps(start, stop, step, steps):
    assert count_steps(start, stop, step) == steps


@pytest.mark.parametrize(
    ("start", "stop", "step", "says"),
    [
        (0, 1, 1.1, "longer than the run of 1 s"),
        (0, 1, 0.5 / MOST_STEPS, r"2e\+09 steps of 5e-10 s; at most 1e\+09"),
        (1e15, 1e15 + 1, 0.01, "must move the time on"),
    ],
)
def test_steps_that_lead_nowhere(start, stop, step, says):
    with pytest.raises(TooLargeError, match=says):
        count_steps(start, stop, step)
