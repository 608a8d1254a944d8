"""The compiled rolling law of a master, against the numpy one."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.analysis.pair import rolling
from railcosim.analysis.pair.rolling import OverRates, Sent, at_ports, numbers, rolling_law
from railcosim.fmus.native_runtime.rolling import compiled_rolling
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.contact.profiles import Curve, tabulate
from railcosim.mechanics.ports import DIMENSIONS, Layout

LAYOUT, SPEED = Layout(2, directions=DIMENSIONS["spatial"]), 60.0
CONE = {
    "contact.nonlinear": True, "contact.hertz_coefficient": 9e10, "contact.wheel_radius": 0.43,
    "contact.half_distance": 0.7465, "contact.conicity": 0.05, "contact.head_radius": 0.3,
    "contact.f11": 7e6, "contact.f22": 6e6, "contact.f23": 1e4, "contact.f33": 20.0,
    "contact.ellipse_along": 7e-3, "contact.ellipse_across": 5e-3, "contact.fastsim": False,
    "contact.friction": 0.3, "contact.flange_stiffness": 1e7, "contact.flange_clearance": 3e-3,
    "contact.flange_depth": 0.014, "contact.axle_inertia": 120.0, "contact.textbook": False,
}  # fmt: skip
# Both sum numbers of some 1e5 N in another order: a few thousand times rounding, where they cancel.
CLOSE = 1e-12


def motions(times: int = 50) -> np.ndarray:
    rng = np.random.default_rng(3)
    sizes = [2e-4, 1.2e-3, 1e-4, 1e-3, 4e-3, 1e-4, 1.2e-3, 1e-3, *(8 * [0.05])]
    moving = rng.standard_normal((times, LAYOUT.contacts, 16)) * sizes
    speed = rng.uniform(10.0, 90.0, (times, LAYOUT.contacts, 1))
    return np.concatenate([moving, speed], axis=-1)


@pytest.fixture(scope="module")
def worn() -> Profiled:
    y = np.linspace(-0.04, 0.04, 161)
    one = tabulate(
        Curve(y, -0.05 * y - y**2 / 2 - 10 * y**3), Curve(y, y**2 / 0.6),
        np.linspace(-8e-3, 8e-3, 161), radius=0.43, half_distance=0.7465,
        shear_modulus=79265e6, poisson_ratio=0.3,
    )  # fmt: skip
    return Profiled(
        reference_radius=0.43, half_distance=0.7465, left=one, right=one, shear_modulus=79265e6
    )


KINDS = [
    "cone", "of wheelsets", "textbook", "without bound", "profiles", "FASTSIM", "FASTSIM, profiles",
    "FASTSIM of one wheelset",
]  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_the_numpy_law(kind: str, worn: Profiled) -> None:
    """Forces and their derivatives, where each wheelset has numbers of its own as well."""
    given = dict(CONE)
    if kind == "of wheelsets":
        del given["contact.f11"]
        given |= {"wheelset[1].contact.f11": 5e6, "wheelset[2].contact.f11": 8e6}
    given |= {"contact.textbook": kind == "textbook"}
    given |= {"contact.friction": 0.0 if kind == "without bound" else 0.3}
    if kind == "FASTSIM of one wheelset":
        del given["contact.friction"]  # that of the other is without bound
        given |= {"wheelset[1].contact.friction": 0.3, "wheelset[2].contact.friction": 0.0}
    given |= {"contact.fastsim": "FASTSIM" in kind}
    profiles = worn if "profiles" in kind else None
    law = at_ports(given, LAYOUT, profiles)
    fast = compiled_rolling(law, numbers(given, LAYOUT), profiles)
    assert fast is not None
    q = motions()
    slow = OverRates(law)
    for found, wanted in ((fast.force(q), slow.force(q)), (fast.tangent(q), slow.tangent(q))):
        largest = np.abs(wanted).reshape(*q.shape[:2], -1).max(axis=-1)
        assert (
            np.abs(found - wanted).reshape(*q.shape[:2], -1).max(axis=-1) <= CLOSE * largest
        ).all()
    assert (np.abs(slow.force(q)).max(axis=(1, 2)) > 1e3).mean() > 0.9  # N: most are pressed


def test_a_wheel_beyond_its_table_is_told(worn: Profiled) -> None:
    law = at_ports(CONE, LAYOUT, worn)
    fast = compiled_rolling(law, numbers(CONE, LAYOUT), worn)
    assert fast is not None
    q = motions(1)
    q[0, 0, 1] = 0.05
    with pytest.raises(ArithmeticError, match="tabulated from"):
        fast.force(q)


def test_without_a_library_it_is_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forces of both are the same to rounding, as sent."""
    made = rolling_law(CONE, LAYOUT, {}, SPEED).law
    monkeypatch.setattr(rolling, "compiled_rolling", lambda *_: None)
    plain = rolling_law(CONE, LAYOUT, {}, SPEED).law
    assert isinstance(plain, Sent)
    assert isinstance(plain.law, OverRates)
    q = motions(3)
    np.testing.assert_allclose(made.force(q), plain.force(q), rtol=1e-9, atol=1e-6)  # N
