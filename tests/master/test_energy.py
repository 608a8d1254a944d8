"""Energy residual: against the energy that the whole system really gained."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.master.bonds import Bond, find_bonds
from railcosim.master.component import Variable
from railcosim.master.connections import Connection, CouplingError, connect_by_name
from railcosim.master.cosimulation import cosimulate
from railcosim.master.energy import EnergyMeter
from railcosim.master.law import Law
from railcosim.master.linear_component import LinearComponent
from railcosim.master.recording import Recorder, record
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.iqn_ils import iqn_ils
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.nepce import nepce
from railcosim.master.system import System

from .oscillator import K_C, K, M, make_system

SHAPE = np.array([1.0, -0.4])  # m: where the masses start


class Spring:
    def force(self, compression):
        return K_C * compression

    def tangent(self, compression):
        return np.full((*compression.shape, 1), K_C)


def make_half(name, sign, z):
    """A mass on a spring to the ground, without a damper: energy is kept."""
    return LinearComponent(
        name, A=[[0.0, 1.0], [-K / M, 0.0]], B=[[0.0], [sign / M]], C=np.eye(2),
        D=np.zeros((2, 1)), x0=[z, 0.0], inputs=[Variable(name="force", unit="N")],
        outputs=[Variable(name=f"z_{name}", unit="m"), Variable(name=f"v_{name}", unit="m/s")],
    )  # fmt: skip


def make_by_power():
    """Two masses, and between them a spring that is told their velocities."""
    spring = LinearComponent(
        "spring", A=[[0.0]], B=[[1.0, -1.0]], C=[[K_C]], D=[[0.0, 0.0]], x0=[SHAPE[0] - SHAPE[1]],
        inputs=[Variable(name="v_left", unit="m/s"), Variable(name="v_right", unit="m/s")],
        outputs=[Variable(name="force", unit="N")],
    )  # fmt: skip
    return finish(spring)


def make_by_work():
    """Two masses, and between them a law that is told where they are."""
    motions = [Variable(name="z_left", unit="m"), Variable(name="z_right", unit="m")]
    return finish(Law("spring", Spring(), motions, [Variable(name="force", unit="N")], [[1, -1]]))


def make_by_owner():
    """Two masses, the right one with the spring to the left one, which is told where that is."""
    right = LinearComponent(
        "right", A=[[0.0, 1.0], [-(K + K_C) / M, 0.0]], B=[[0.0], [K_C / M]],
        C=[[1.0, 0.0], [0.0, 1.0], [-K_C, 0.0]], D=[[0.0], [0.0], [K_C]], x0=[SHAPE[1], 0.0],
        inputs=[Variable(name="z_left", unit="m")],
        outputs=[Variable(name="z_right", unit="m"), Variable(name="v_right", unit="m/s"),
                 Variable(name="force", unit="N")],
    )  # fmt: skip
    components = [make_half("left", -1.0, SHAPE[0]), right]
    return System(components, connect_by_name(components))


def finish(spring):
    components = [make_half("left", -1.0, SHAPE[0]), spring, make_half("right", 1.0, SHAPE[1])]
    return System(components, connect_by_name(components))


def gained(dataset):
    """Kinetic and potential energy at all times, less that at the start, J."""
    z1, v1, z2, v2 = (dataset[n].values for n in ("z_left", "v_left", "z_right", "v_right"))
    force = dataset["force"].values
    total = 0.5 * M * (v1**2 + v2**2) + 0.5 * K * (z1**2 + z2**2) + 0.5 * force**2 / K_C
    return total - total[0]


def run(system, scheme, step, stop):
    """What the meter says, and what the energy is, J."""
    meter, recorder = EnergyMeter(system, find_bonds(system, against=["left"])), Recorder(system)
    stopped = record(meter.watch(cosimulate(system, scheme, step, stop)), recorder)
    return meter.to_dataset(), gained(recorder.to_dataset()), stopped


# A second each.
@pytest.mark.parametrize(
    "make",
    [
        pytest.param(make_by_power, marks=pytest.mark.slow),
        pytest.param(make_by_work, marks=pytest.mark.slow),
        make_by_owner,
    ],
)
@pytest.mark.parametrize(
    "scheme",
    [jacobi(degree=0), jacobi(), gauss_seidel(first="left", degree=0), gauss_seidel(first="left"),
     nepce(), iqn_ils(degree=1)],
    ids=str,
)  # fmt: skip
def test_residual_is_the_energy_gained(make, scheme):
    """The system keeps energy; what it gains came from the coupling, and that is what is told."""
    errors = []
    for step in (1 / 200, 1 / 400):
        measured, true, _ = run(make(), scheme, step, 1.0)
        errors.append(np.abs(measured["energy_residual"].values - true).max())
    # The law's work is a polynomial's: held forces leave rounding, 1e-16 of 50 J 800 times over.
    if errors[-1] > 1e-10:
        # Third order: the parabola between points. 0.4: energy that grows exponentially on top.
        assert np.log2(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.4)
    # Of 49 J at the start; (omega h)^3 is 1.6e-5, over 12 rad.
    assert errors[-1] < 49 * 12 * 1.6e-5


@pytest.mark.parametrize(
    ("scheme", "order"),
    [(jacobi(degree=0), 1), (jacobi(degree=1), 2), (nepce(), 2), (gauss_seidel(first="left"), 2)],
    ids=str,
)
def test_residual_vanishes_as_the_error_does(scheme, order):
    coarse, fine = (
        run(make_by_power(), scheme, h, 0.125)[0]["energy_residual"].values[-1]
        for h in (1 / 1600, 1 / 3200)
    )
    # 0.1: the next term, of the relative size omega h = 0.01, in part.
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.1)


def test_exact_coupling_creates_nothing():
    """Quadratic inputs, converged, are the parabolas through the outputs: nothing is left."""
    measured, _, _ = run(make_by_power(), iqn_ils(degree=2), 0.01, 1.0)
    # The iteration's tolerance, 1e-8 of 70 N, over 5 m of way.
    assert np.abs(measured["energy_residual"]).max() < 1e-8 * 70 * 5


def test_growing_residual_explains_instability():
    """Jacobi with constant inputs: the energy grows a hundredfold, and all of it is told."""
    measured, true, stopped = run(make_by_power(), jacobi(degree=0), 0.005, 9.0)
    assert stopped is None
    assert true[-1] > 100 * 49
    # 1e-3: the third order of omega h = 0.06, relative to the first.
    assert measured["energy_residual"].values[-1] == pytest.approx(true[-1], rel=1e-3)
    assert (np.diff(measured["energy_residual"].values)[5:] > 0).mean() > 0.9


def test_each_interface_is_told():
    measured, _, _ = run(make_by_power(), jacobi(), 0.01, 0.1)
    names = ["energy_residual[spring.force->left]", "energy_residual[spring.force->right]"]
    assert list(measured.data_vars) == [*names, "energy_residual"]
    total = measured[names[0]] + measured[names[1]]
    np.testing.assert_allclose(total, measured["energy_residual"], rtol=1e-14, atol=1e-14)
    assert float(measured[names[0]][-1]) != 0.0
    assert measured["energy_residual"].attrs["units"] == "J"
    assert measured.sizes["time"] == 11
    assert float(measured["energy_residual"][0]) == 0.0


def test_signs():
    """Left is driven against its motion by a positive force, right with it."""
    system = make_by_power()
    bonds = find_bonds(system, against=["left"])
    assert [(b.effort.target, b.motion.output, b.sign) for b in bonds] == [
        ("left", "v_left", -1),
        ("right", "v_right", 1),
    ]


def test_velocity_is_preferred():
    """The oscillator of the literature exchanges both."""
    (bond,) = find_bonds(make_system())
    assert (bond.effort.output, bond.motion.output, bond.sign) == ("force", "vz", 1)


def make_wheels(names, effort="force_z", units=("N", "m/s")):
    """Two components that exchange a force and velocities at two wheels."""
    forces = [Variable(name=f"{w}.{effort}", unit=units[0]) for w in ("left", "right")]
    motions = [Variable(name=n, unit=units[1]) for n in names]

    def component(name, inputs, outputs):
        return LinearComponent(
            name, A=[[0.0]], B=np.zeros((1, len(inputs))), C=np.zeros((len(outputs), 1)),
            D=np.zeros((len(outputs), len(inputs))), inputs=inputs, outputs=outputs,
        )  # fmt: skip

    components = [component("car", forces, motions), component("rail", motions, forces)]
    return System(components, connect_by_name(components))


def test_wheel_by_wheel_and_by_direction():
    system = make_wheels(["right.vz", "left.vy", "left.vz"])
    pairs = {b.effort.output: b.motion.output for b in find_bonds(system)}
    assert pairs == {"left.force_z": "left.vz", "right.force_z": "right.vz"}


def test_a_moment_goes_with_the_rotation_about_its_axis():
    """In whatever order they are told."""
    for axis, turning in (("x", "vroll"), ("y", "vpitch"), ("z", "vyaw")):
        names = [f"{w}.{n}" for w in ("left", "right") for n in ("vyaw", "vroll", "vpitch")]
        bonds = find_bonds(make_wheels(names, f"moment_{axis}", ("N.m", "rad/s")))
        assert [b.motion.output for b in bonds] == [f"left.{turning}", f"right.{turning}"]


def test_what_is_not_clear_is_asked():
    with pytest.raises(CouplingError, match=r"could be .*give the bonds"):
        find_bonds(make_wheels(["left.vz", "left.wz"]))
    with pytest.raises(CouplingError, match="did you mean car"):
        find_bonds(make_wheels(["left.vz"]), against=["cat"])


def test_bonds_are_checked():
    system = make_system()
    force, z, vz = (
        next(c for c in system.connections if c.output == name) for name in ("force", "z", "vz")
    )
    EnergyMeter(system, [Bond(force, vz)])
    EnergyMeter(system, [Bond(force, z)])
    with pytest.raises(CouplingError, match="neither a power nor a work"):
        EnergyMeter(system, [Bond(force, force)])
    with pytest.raises(CouplingError, match="is not in the system"):
        EnergyMeter(system, [Bond(force, Connection("left", "a", "right", "a"))])
