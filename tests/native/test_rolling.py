"""The rolling law of the C runtime, under sanitizers, against the numpy one."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from railcosim.fmus.native_runtime.compile import SOURCES
from railcosim.mechanics.contact.at_ports import AtPorts
from railcosim.mechanics.contact.creep import LINEAR, CreepLaw
from railcosim.mechanics.contact.fastsim import Fastsim
from railcosim.mechanics.contact.geometry import LEFT, RIGHT, Cone, TextbookCone
from railcosim.mechanics.contact.profiled import NUMBERS, Profiled
from railcosim.mechanics.contact.profiles import COLUMNS, Curve, tabulate
from railcosim.mechanics.contact.rolling import Flange, RollingContact
from railcosim.mechanics.contact.saturation import Saturated, resultant

FloatArray = NDArray[np.float64]
Found = tuple[FloatArray, FloatArray, FloatArray, FloatArray]

HERE = Path(__file__).parent / "c"
B, FRICTION = 0.7465, 0.3
CONTACTS = 300
SHAPE = {
    "radius": 0.43, "half_distance": B, "conicity": 0.05, "head_radius": 0.3,
    "shear_modulus": 79265e6, "poisson_ratio": 0.3,
}  # fmt: skip
FLANGE = Flange(stiffness=1e7, clearance=3e-3)
# Both sum numbers of some 1e5 N in another order: a few thousand times rounding, where they cancel.
CLOSE = 1e-12


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory, sanitizing: Callable[[], list[str]]) -> Path:
    """The law with what feeds it."""
    made = tmp_path_factory.mktemp("rolling") / "rolling"
    files = [HERE / "rolling.c", *sorted(SOURCES.glob("rolling*.c"))]
    command = [*sanitizing(), f"-I{SOURCES}", "-o", made, *files, "-lm"]
    subprocess.run([str(part) for part in command], check=True)
    return made


FASTSIM = Fastsim(friction=FRICTION)
CREEPS = pytest.mark.parametrize(
    "creep", [LINEAR, Saturated(friction=FRICTION), FASTSIM], ids=["linear", "Shen", "FASTSIM"]
)


@CREEPS
@pytest.mark.parametrize("geometry", [Cone, TextbookCone])
def test_forces_and_tangents(
    program: Path, sanitizers: dict[str, str], geometry: type[Cone], creep: CreepLaw
) -> None:
    """Of contacts on both sides: open and closed, sliding in part and whole, flanges apart or not.

    The numpy law's derivatives are found by the complex step, the C one's are written down.
    """
    rng = np.random.default_rng(1)
    side = rng.choice([LEFT, RIGHT], CONTACTS)
    contact = RollingContact(
        geometry=geometry(**SHAPE), side=side, speed=60.0, creep=creep, flange=FLANGE,
        axle_inertia=130.0,
    )  # fmt: skip
    at_ports = AtPorts(contact=contact, half_distance=B)
    sizes = [2e-4, 4e-3, 1e-4, 1e-3, 4e-3, 1e-4, 2e-3, 1e-3]
    q = rng.standard_normal((CONTACTS, 8)) * sizes
    v = rng.standard_normal((CONTACTS, 8)) * [0.1, 0.1, 0.02, 0.1, 0.02, 0.1, 0.1, 0.1]
    v *= 10 ** rng.uniform(-2, 1.0, (CONTACTS, 1))
    all_cases_there(contact, *(np.einsum("nij,nj->ni", at_ports.coordinates, x) for x in (q, v)))
    V = rng.uniform(10.0, 90.0, CONTACTS)
    alike(asked(program, sanitizers, contact, q, v, V), at_ports, q, v, V)


def alike(found: Found, at_ports: AtPorts, q: FloatArray, v: FloatArray, V: FloatArray) -> None:
    """Forces and tangents are those of the numpy law; by the speed those of differences, too."""
    wanted = (at_ports.force(q, v, V), *at_ports.tangents(q, v, V))
    for a, b in zip(found[:3], wanted, strict=True):
        largest = np.abs(b).reshape(CONTACTS, -1).max(axis=1)
        assert (np.abs(a - b).reshape(CONTACTS, -1).max(axis=1) <= CLOSE * largest).all()
    by_rates = np.abs(wanted[2] * v[:, None]).sum(axis=(1, 2)) / V  # of which it is a sum
    by_speed = at_ports.by_speed(v, wanted[2], V)
    assert (np.abs(found[3] - by_speed).max(axis=1) <= CLOSE * by_rates).all()
    h = 1e-4 * V
    faster, slower = (at_ports.force(q, v, V + dV) for dV in (h, -h))
    # h^2 / 6 of the third derivative; where friction gives way there is none.
    off = np.abs((faster - slower) / (2 * h[:, None]) - by_speed).max(axis=1) / (by_rates + 1e-3)
    assert np.median(off) < 1e-7
    assert (off < 1e-3).mean() > 0.98


@pytest.fixture(scope="module")
def worn() -> Profiled:
    """A wheel that is hollow and steep towards its flange, on a head of two radii."""
    y = np.linspace(-0.04, 0.04, 161)
    rail = Curve(y, y**2 / 0.6 + 40 * np.maximum(y, 0) ** 3)
    one = tabulate(
        Curve(y, -0.05 * y - y**2 / 2 - 10 * y**3), rail, np.linspace(-8e-3, 8e-3, 161),
        radius=0.43, half_distance=B, shear_modulus=79265e6, poisson_ratio=0.3,
    )  # fmt: skip
    return Profiled(
        reference_radius=0.43, half_distance=B, left=one, right=one, shear_modulus=79265e6
    )


@CREEPS
def test_forces_and_tangents_of_profiles(
    program: Path, sanitizers: dict[str, str], worn: Profiled, creep: CreepLaw
) -> None:
    """Of contacts on both sides, open and closed, all over the table; nothing beyond it."""
    rng = np.random.default_rng(2)
    side = rng.choice([LEFT, RIGHT], CONTACTS)
    contact = RollingContact(geometry=worn, side=side, speed=60.0, creep=creep, axle_inertia=130.0)
    at_ports = AtPorts(contact=contact, half_distance=B)
    q = rng.standard_normal((CONTACTS, 8)) * [3e-4, 2e-3, 1e-4, 1e-3, 4e-3, 3e-4, 5e-4, 1e-3]
    v = rng.standard_normal((CONTACTS, 8)) * [0.1, 0.1, 0.02, 0.1, 0.02, 0.1, 0.1, 0.1]
    normal = contact.normal_force(np.einsum("nij,nj->ni", at_ports.coordinates, q))
    assert CONTACTS / 10 < (normal > 0).sum() < CONTACTS * 9 / 10
    V = rng.uniform(10.0, 90.0, CONTACTS)
    alike(asked(program, sanitizers, contact, q, v, V), at_ports, q, v, V)
    q[0, 1] = 0.02
    force, *_ = asked(program, sanitizers, contact, q, v, V)
    assert np.isnan(force[0]).any()
    assert np.isfinite(force[1:]).all()


def all_cases_there(contact: RollingContact, q: FloatArray, v: FloatArray) -> None:
    """Of everything that the law chooses between there is some in what is asked of it."""
    normal = contact.normal_force(q)
    assert contact.flange is not None
    flange = contact.flange.force(q, contact.side, contact.geometry.radius).any(axis=-1)
    for side in (LEFT, RIGHT):
        for touches in (flange, ~flange):
            for closed in (normal > 0, normal == 0):
                assert ((contact.side == side) & touches & closed).sum() > CONTACTS / 100
    _, force = contact.creep_forces(q, v)
    if contact.creep is not LINEAR:
        slides = resultant(force) > FRICTION * normal * (1 - 3e-3)  # FASTSIM's strips leave 2e-3
        assert 0.1 < slides[normal > 0].mean() < 0.9


def asked(
    program: Path,
    sanitizers: dict[str, str],
    contact: RollingContact,
    q: FloatArray,
    v: FloatArray,
    V: FloatArray,
) -> Found:
    """Forces and their derivatives by the C law."""
    rows = np.column_stack([contact.side, q, v, V])
    text = " ".join(map(repr, [*law_of(contact), *rows.ravel().tolist()]))
    told = subprocess.run(
        [str(program)], input=text, capture_output=True, text=True, check=False,
        env=os.environ | sanitizers,
    )  # fmt: skip
    assert told.returncode == 0, told.stderr
    found = np.array(told.stdout.split(), float).reshape(CONTACTS, 8 + 64 + 64 + 8)
    force, by_q, by_v, by_speed = np.split(found, [8, 72, 136], axis=1)
    return force, by_q.reshape(-1, 8, 8), by_v.reshape(-1, 8, 8), by_speed


def law_of(contact: RollingContact) -> list[float]:
    """The law and its table, as c/rolling.c reads them."""
    if isinstance(contact.geometry, Profiled):
        told = contact.geometry.told()
        table = np.array([told["columns"][name] for name in COLUMNS]).T
        law = [0.0] * 12 + creep_of(contact) + [0.0] * 3 + [float(contact.axle_inertia)]
        about = [told[name] for name in NUMBERS]
        return [*law, float(len(table)), *about, *table.ravel().tolist()]
    return [*numbers(contact), 0.0]


def creep_of(contact: RollingContact) -> list[float]:
    """Friction, and which of c/rolling.c's laws of creep."""
    laws = [type(LINEAR), Saturated, Fastsim]
    return [getattr(contact.creep, "friction", 0.0), float(laws.index(type(contact.creep)))]


def numbers(contact: RollingContact) -> list[float]:
    """The law, in the order of `RollingLaw`."""
    cone, flange = contact.geometry, contact.flange
    assert isinstance(cone, Cone)
    assert flange is not None
    one = np.array(1.0)
    patch = [*cone.patch.creep_coefficients(one), *cone.patch.ellipse.semi_axes(one)]
    return [
        cone.radius, cone.half_distance, cone.conicity, cone.head_radius,
        float(isinstance(cone, TextbookCone)), float(cone.patch.ellipse.C), *map(float, patch),
        *creep_of(contact),
        flange.stiffness, flange.clearance, flange.depth,
        float(contact.axle_inertia),
    ]  # fmt: skip
