"""Parts of the coupling left out, where each response is a fraction: free wheels, rails on springs.

A wheel of mass m on a contact k_H and a rail on a spring k: a gap makes the force
1 / (1/k_H + 1/k - 1/(m w^2)), and without a part its term is missing. The car body moves by the
sum of the wheels' forces, the bogie by that of the first wheelset.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import trapezoid

from railcosim.analysis.response.models import Models
from railcosim.analysis.response.uncoupled import HIGHEST, NEGLIGIBLE, changes
from railcosim.mechanics.ports import Layout

WHEELS = Layout().wheels

MASS, K_H, RAIL = 900.0 * (1 - 0.1j), 1e9, 4e7 * (1 + 0.2j)  # kg, N/m, N/m; damped
POSITIONS, SPEED = np.array([18.2, 15.7, 2.5, 0.0]), 60.0  # m, m/s
FREQUENCY = np.geomspace(8.0, 320.0, 4000)


def linear(name, outputs, values):
    return SimpleNamespace(
        name=name, inputs=tuple(SimpleNamespace(name=f"{w}.force_z") for w in WHEELS),
        outputs=tuple(SimpleNamespace(name=o) for o in outputs),
        frequency_response=lambda omega: values(np.asarray(omega)[:, None, None]) + 0j,
    )  # fmt: skip


@pytest.fixture(scope="module")
def found():
    first = [float(w.startswith("wheelset[1]")) for w in WHEELS]
    rows = np.array([np.ones(8), first, *np.eye(8)])  # a force lifts, and so does w^2
    names = ["carbody.z", "bogie[1].z", *(f"{w}.wheel_z" for w in WHEELS)]
    vehicle = linear("vehicle", names, lambda w: rows / (MASS * w**2))
    track = linear("track", [f"{w}.rail_z" for w in WHEELS], lambda w: np.eye(8) / RAIL + 0 * w)
    models = Models(vehicle, track, POSITIONS, {})
    return {(c.part, c.output): c for c in changes(models, FREQUENCY, K_H, SPEED)}


def force(f, k_H=K_H, k=RAIL):
    return 1 / np.abs(1 / k_H + 1 / k - 1 / (MASS * (2 * np.pi * f) ** 2))


def steps(f):
    """How far the wheelsets of a train are from adding up."""
    return np.abs(np.exp(-2j * np.pi * np.outer(f, POSITIONS.max() - POSITIONS) / SPEED).sum(1)) / 4


def body(f):
    """Of all wheels at once."""
    return 8 * force(f) / np.abs(MASS * (2 * np.pi * f) ** 2)


def under_wheels(f):
    """Rail under a force of 1 N: its spring, and the wheel on its contact."""
    return 1 / np.abs(RAIL + 1 / (1 / K_H - 1 / (MASS * (2 * np.pi * f) ** 2)))


@pytest.mark.parametrize(
    ("part", "output", "full", "less"),
    [
        ("flexible track", "contact force 1", force, lambda f: force(f, k=np.inf)),
        ("contact flexibility", "contact force 1", force, lambda f: force(f, k_H=np.inf)),
        ("phase lag", "contact force 1", force, force),
        ("phase lag", "car body", lambda f: body(f) * steps(f), body),
        ("vehicle", "rail under wheelset 1", under_wheels, lambda f: 1 / np.abs(RAIL) + 0 * f),
    ],
)  # fmt: skip
def test_each_part(found, part, output, full, less) -> None:
    change = found[part, output]
    assert change.with_part == pytest.approx(full(FREQUENCY), rel=1e-9)
    assert change.without_part == pytest.approx(less(FREQUENCY), rel=1e-9)
    low = FREQUENCY[FREQUENCY <= HIGHEST]
    for at, size in ((change.resonance_with, full), (change.resonance_without, less)):
        assert size(np.array([at]))[0] >= size(low).max() * (1 - 1e-5)
    band = np.geomspace(0.1**0.05, 10**0.05, 2001) * change.centres[:, None]
    means = [trapezoid(size(band.ravel()).reshape(band.shape) ** 2, band) for size in (less, full)]
    # Points 0.1 % apart, 250 in a band: within one, a straight line at the edges; found 5e-4 dB.
    assert change.decibel == pytest.approx(10 * np.log10(means[0] / means[1]), abs=0.005)


def test_where_a_part_is_negligible(found) -> None:
    assert found["phase lag", "contact force 1"].where_negligible() == "8.91-282 Hz"
    change = found["contact flexibility", "contact force 1"]
    (band,) = [b for b in change.neglected_in if b[0] < 10.0]
    inside = change.centres < band[1]
    assert (np.abs(change.decibel[inside]) < NEGLIGIBLE).all()
    assert abs(change.decibel[~inside][0]) >= NEGLIGIBLE
