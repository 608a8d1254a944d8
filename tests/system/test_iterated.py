"""Iterated coupling and NEPCE on the pair, against its forces solved as one system."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.analysis.schemes.coupled_reference import compression_model, converged_forces
from railcosim.master.bonds import find_bonds
from railcosim.master.cosimulation import cosimulate
from railcosim.master.energy import EnergyMeter
from railcosim.master.schemes import ConvergenceError
from railcosim.master.schemes.aitken import aitken
from railcosim.master.schemes.iqn_ils import iqn_ils
from railcosim.master.schemes.iteration import Until
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.nepce import nepce
from railcosim.master.schemes.picard import picard
from railcosim.mechanics.law import LinearContact
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.track.irregularity import synthesise

FORCES = Layout().names(FORCE)
LAYOUT = Layout()
WHEELSETS = Layout().axles

pytestmark = pytest.mark.slow  # orders and energy of iterated schemes on the pair

SPEED, STOP = 250 / 3.6, 0.05  # m/s, s
K_H = 1e9  # N/m
PROFILE = synthesise("german-low", SPEED * STOP)
FMUS = {
    "track": ("Vehicle", "TrackWithContact"),
    "vehicle": ("VehicleWithContact", "Track"),
    "master": ("Vehicle", "Track"),
}
TIGHT = Until(relative=1e-10, absolute=1e-10)  # below what is to be seen, above rounding


def opened(folder, owner, k_H):
    """Wheels held, so that FMUs without a contact are exact; those with one in steps of 10 us."""
    vehicle, track = (folder / f"{name}.fmu" for name in FMUS[owner])
    parameters = {"contact.nonlinear": False, "contact.stiffness": k_H, "internal_step": 1e-5}
    return open_pair(vehicle, track, parameters, Journey(speed=SPEED, held=True, profile=PROFILE))


def run(folder, owner, scheme, step, k_H=K_H, stop=STOP):
    """Times, contact forces and reports."""
    with opened(folder, owner, k_H) as pair:
        names = [name.partition(".")[2] for name in pair.system.names]
        columns = [names.index(force) for force in FORCES]
        points = list(cosimulate(pair.system, scheme, step, stop))
    times = np.array([p.time for p in points])
    return times, np.array([p.outputs[columns] for p in points]), [p.report for p in points[1:]]


@pytest.fixture(scope="module")
def reference(exported):
    """Forces of vehicle, springs and track as one system."""
    with opened(exported.folder, "master", K_H) as pair:
        pair.system.exchange()
        names = [name.partition(".")[2] for name in pair.system.names]
        now = dict(zip(names, pair.system.outputs.tolist(), strict=True))
    positions = np.array([now[f"{w}.position"] for w in WHEELSETS])
    rest = LAYOUT.compression @ [now[name] for name in LAYOUT.motions]
    vehicle, track = (exported.folder / f"{name}.fmu" for name in FMUS["master"])
    model = compression_model(vehicle, track, positions)
    heights = PROFILE.under(positions, SPEED)
    return converged_forces(model, LinearContact(k_H=K_H), rest, heights, STOP)


@pytest.fixture
def error(exported, reference):
    """Relative RMS of the forces' dynamic part, of a scheme with some owner and step."""

    def measure(owner, scheme, step):
        times, forces, _ = run(exported.folder, owner, scheme, step)
        expected = reference.at(times)
        return np.linalg.norm(forces - expected) / np.linalg.norm(expected - reference.rest)

    return measure


@pytest.mark.parametrize(
    ("owner", "scheme", "limit"),
    [  # limits: measured on this irregularity, and a quarter more
        ("track", iqn_ils(degree=1, until=TIGHT), 1.25 * 7.6e-4),
        ("track", iqn_ils(degree=2, until=TIGHT), 1.25 * 1.6e-5),
        ("vehicle", iqn_ils(degree=1, until=TIGHT), 1.25 * 7.8e-4),
        ("track", nepce(), 1.25 * 3.7e-3),
    ],
    ids=str,
)
def test_error_at_a_tenth_of_a_millisecond(error, owner, scheme, limit):
    assert error(owner, scheme, 1e-4) < limit


@pytest.mark.parametrize(
    ("owner", "scheme", "steps"),
    [
        ("master", iqn_ils(degree=0, until=TIGHT), (1e-4, 5e-5)),
        ("master", iqn_ils(degree=1, until=TIGHT), (1e-4, 5e-5)),
        ("vehicle", iqn_ils(degree=1, until=TIGHT), (1e-4, 5e-5)),
        ("track", nepce(), (5e-5, 2.5e-5)),
        # At these steps; shorter ones read 2.0 to 2.8 (internal steps of the FMU, or its fastest
        # modes: not established).
        ("vehicle", iqn_ils(degree=2, until=TIGHT), (2e-4, 1e-4)),
    ],
    ids=str,
)
def test_orders(error, owner, scheme, steps):
    coarse, fine = (error(owner, scheme, step) for step in steps)
    # 0.1: asked for.
    assert np.log2(coarse / fine) == pytest.approx(scheme.order, abs=0.1)


def test_long_steps_with_the_contact_in_the_track(exported):
    """1 ms: stable, and all methods find the same forces."""
    forces = []
    for scheme in (iqn_ils(), iqn_ils(reuse=4), aitken(), picard()):
        _, found, reports = run(exported.folder, "track", scheme, 1e-3)
        forces.append(found)
        assert all(report.converged for report in reports)
        # The eight wheels are alike: a line is learnt from two evaluations and holds for all.
        assert scheme == picard() or max(report.evaluations for report in reports) <= 6
    for found in forces[1:]:
        # Tolerances of 1e-9 of 80 kN, kept open by each of 50 steps.
        np.testing.assert_allclose(found, forces[0], atol=50 * 80e3 * 1e-9)


def test_reuse_makes_it_two_evaluations(exported):
    """Held wheels and a linear contact: what was learnt stays true."""
    run_ = partial(run, exported.folder, "track", step=1e-3)
    _, _, reports = run_(iqn_ils(reuse=4))
    assert np.mean([report.evaluations for report in reports[5:]]) <= 2.2


@pytest.mark.parametrize("owner", ["track", "vehicle", "master"])
def test_energy_at_the_wheels(exported, owner):
    """Created at every wheel, half as much with half the step; and measuring changes no bit."""
    scheme, total, forces = jacobi(degree=0), [], []
    for step in (2e-5, 1e-5):
        with opened(exported.folder, owner, K_H) as pair:
            bonds = find_bonds(pair.system, against=["vehicle"])
            meter = EnergyMeter(pair.system, bonds)
            points = list(meter.watch(cosimulate(pair.system, scheme, step, 0.01)))
            names = [name.partition(".")[2] for name in pair.system.names]
        forces.append(np.array([p.outputs[[names.index(f) for f in FORCES]] for p in points]))
        total.append(np.abs(meter.to_dataset()["energy_residual"]).max())
    assert len(bonds) == (16 if owner == "master" else 8)
    assert all(b.motion.output[:17] == b.effort.output[:17] for b in bonds)
    # 0.1: asked for.
    assert np.log2(total[0] / total[1]) == pytest.approx(scheme.order, abs=0.1)
    np.testing.assert_array_equal(
        run(exported.folder, owner, scheme, 1e-5, stop=0.01)[1], forces[1]
    )


def test_picard_diverges_where_the_others_do_not(exported):
    """1 ms with the contact in the vehicle: a change of the rail comes back larger."""
    run_ = partial(run, exported.folder, "vehicle", step=1e-3, stop=0.01)
    with pytest.raises(ConvergenceError, match=r"did not converge at t = 0\.001 s"):
        run_(picard())
    for scheme in (aitken(), iqn_ils()):
        assert max(report.evaluations for report in run_(scheme)[2]) <= 8
