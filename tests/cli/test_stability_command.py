"""Largest stable steps and advice on the command line."""

import numpy as np
import pytest

from railcosim.cli.stability_command import in_ms
from railcosim.master.files import load

pytestmark = pytest.mark.slow  # steps of all lengths of the whole pair


@pytest.fixture
def both(exported):
    return "--vehicle-fmu", exported["Vehicle"], "--track-fmu", exported["Track"]


def test_limits(both, railcosim, tmp_path) -> None:
    options = ("--contact-stiffness", "1e9,8e9", "--schemes", "interface-jacobian-hermite",
               "--out", "limits.nc", "--plot", "limits.png")  # fmt: skip
    done = railcosim("stability", *both, *options)
    assert done.status == 0, done.err
    assert "2 searches on" in done.err  # told before
    limits = load(tmp_path / "limits.nc")
    assert limits["k_H"].size == 2
    assert f"{in_ms(float(limits['interface-jacobian-hermite.master'].min()))}" in done.out
    assert (tmp_path / "limits.png").stat().st_size > 5000
    wrong = railcosim("stability", *both, "--schemes", "jakobi")
    assert wrong.status == 2
    assert "no scheme begins with 'jakobi'" in wrong.err


def test_advice(both, railcosim, tmp_path) -> None:
    options = ("--accuracy", "1e-2", "--schemes", "jacobi-quadratic", "--out", "a.nc",
               "--plot", "a.png")  # fmt: skip
    done = railcosim("advise", *both, *options)
    assert done.status == 0, done.err
    assert "3 searches on" in done.err
    advice = load(tmp_path / "a.nc")
    assert f"a step of {1e3 * float(advice['step'][0]):g} ms" in done.out
    assert float(advice["error"].max()) <= 1e-2
    assert (np.diff(advice["cost"]) >= 0).all()  # cheapest first
    assert (tmp_path / "a.png").stat().st_size > 5000
