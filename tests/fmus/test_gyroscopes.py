"""Axles that turn, as gyroscopes, in the FMUs that own rolling contacts."""

import numpy as np
import pytest

from railcosim.fmus.content import Content
from railcosim.fmus.export import NativeRuntime
from railcosim.fmus.interface import interface
from railcosim.fmus.start import start_of
from railcosim.master.component import Hold
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import SPATIAL, build_multibody
from railcosim.vehicle.parameters import PrimarySuspension, Vehicle

FREE = Vehicle(
    primary_suspension=PrimarySuspension(
        stiffness=1.0, stiffness_x=1.0, stiffness_y=1.0,
        damping=0.0, damping_x=0.0, damping_y=0.0,
    )
)  # fmt: skip
SPEED, H, BEFORE, STEPS = 70.0, 1e-3, 3, 300


@pytest.fixture(scope="module")
def vehicle(tmp_path_factory):
    body = vehicle_body(build_multibody(FREE, SPATIAL))
    start = start_of(FREE, [18.2, 15.7, 2.5, 0.0], dimension="spatial")
    content = Content(
        name="VehicleWithContact", model="vehicle", text="Rolls.", parameters="", annotations={},
        table=interface(body, start, with_contact=True), body=body,
    )  # fmt: skip
    path = tmp_path_factory.mktemp("free") / "VehicleWithContact.fmu"
    NativeRuntime(documented=False).pack(content, path, lambda text: None)
    return path


def flown(path, inertia):
    """Rates of roll and yaw of the first axle, thrown up by a rail, which then falls away."""
    with FmuComponent.load(path) as fmu:
        fmu.set_parameters({"contact.axle_inertia": inertia, "contact.flange_stiffness": 0.0})
        fmu.enter_initialization(0.0)
        fmu.exit_initialization()
        fmu.set_hold(Hold.CONSTANT)
        names, given = [v.name for v in fmu.inputs], [v.name for v in fmu.outputs]
        u = np.where(np.array(names) == "speed", SPEED, 0.0)
        at = [given.index(f"wheelset[1].left.wheel_v{turn}") for turn in ("roll", "yaw")]
        found = []
        for k in range(BEFORE + STEPS):
            for i, name in enumerate(names):
                if name.endswith("rail_z"):
                    up = -1e-3 if name == "wheelset[1].left.rail_z" else 0.0
                    u[i] = up if k < BEFORE else 1e3
            fmu.set_inputs(u)
            fmu.do_step(k * H, H)
            found.append(fmu.get_outputs()[at])
    return np.array(found)[BEFORE:]


def test_a_free_axle_nutates(vehicle) -> None:
    """About x and z by turns, at I V / r0 over the root of both inertias.

    Springs of 1 N/m turn it back by 1e-5 of that; contacts were open since the rails fell.
    """
    own = FREE.wheelset
    rates = flown(vehicle, own.inertia_spin)
    size = np.sqrt(own.inertia_yaw / own.inertia_roll)
    omega = own.inertia_spin * SPEED / own.radius / np.sqrt(own.inertia_roll * own.inertia_yaw)
    turned = rates[0, 0] + 1j * size * rates[0, 1]
    turned = turned * np.exp(1j * omega * H * np.arange(STEPS))
    assert omega * H * STEPS > 2 * np.pi  # it has been round
    assert np.abs(turned[0]) > 0.01
    np.testing.assert_allclose(rates[:, 0] + 1j * size * rates[:, 1], turned, rtol=1e-3)


def test_an_axle_without_inertia_flies_straight_on(vehicle) -> None:
    """For a vehicle that has gyroscopes of its own; but for springs of 1 N/m."""
    rates = flown(vehicle, 0.0)
    np.testing.assert_allclose(rates, rates[:1] * np.ones((STEPS, 1)), rtol=1e-3)
