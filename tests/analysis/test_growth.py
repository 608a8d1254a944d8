"""Largest stable steps from rates of growth on both sides of them."""

from types import SimpleNamespace

import numpy as np
import pytest

from railcosim.analysis.schemes import run_limit, stability
from railcosim.analysis.schemes.growth import Bench
from railcosim.analysis.schemes.stability import Coupling
from railcosim.master.schemes.jacobi import jacobi


@pytest.mark.parametrize("true", [0.9985e-3, 1.0e-3, 1.001e-3])
def test_a_limit_is_where_the_measured_rate_is_the_allowed_one(monkeypatch, true) -> None:
    """Rates that are a line over the step are known to rounding, not to the steps measured at."""
    allowed, slope = 1.0, 4e6  # 1/s, 1/s^2
    bench = object.__new__(Bench)
    monkeypatch.setattr(bench, "growth", lambda scheme, h, motion: allowed + slope * (h - true))
    monkeypatch.setattr(bench, "kicked", lambda scheme, h: -1.0)
    monkeypatch.setattr(
        run_limit, "fastest_motion", lambda coupling, h: SimpleNamespace(rate=complex(slope * h))
    )
    predicted = SimpleNamespace(fast=1e-3, end=2e-3)
    found = run_limit.limit_in_runs(
        bench, jacobi(degree=1), SimpleNamespace(fast=allowed), predicted
    )
    assert found.step == pytest.approx(true, rel=1e-9)


def test_steps_are_looked_at_together_as_far_as_memory_goes(monkeypatch) -> None:
    """2000 numbers of modes a step, and 5000 in all: two steps at once, and none left out."""
    looked = []

    def at(h):
        looked.append(np.size(h))
        lead = np.shape(h)
        return SimpleNamespace(
            C=np.zeros((*lead, 10, 100)), G=np.zeros((*lead, 100, 10)),
            real_ends=lambda: np.stack([h, -h], axis=-1),
        )  # fmt: skip

    coupling = object.__new__(Coupling)
    monkeypatch.setattr(stability, "AT_ONCE", 5000)
    coupling.__dict__ |= {"_width": 4, "amplifiers": [SimpleNamespace(at=at)]}
    steps = np.linspace(1e-4, 1e-3, 7)
    assert np.array_equal(coupling._ends(steps), np.stack([steps, -steps], axis=-1))
    assert looked == [1, 2, 2, 2, 1]
