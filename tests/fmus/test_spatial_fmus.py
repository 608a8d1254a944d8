"""A track that is met down, to the right and in roll: names, both runtimes, and the vertical one.

Directions, signs and sides against the finite elements, which know nothing of FMUs.
"""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from fmpy import simulate_fmu

from railcosim.analysis.pair.contact import CouplingError, layout_of
from railcosim.analysis.response.models import linear_models
from railcosim.fmus.export import (
    BARE,
    WITH_STATES,
    NativeRuntime,
    PythonRuntime,
    export,
    export_track,
)
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.linear.model_exchange import linear_model
from railcosim.mechanics.ports import DIMENSIONS, FORCE, RAIL, Layout
from railcosim.parameters import ParameterError
from railcosim.track.receptance import Point, direct_receptance
from railcosim.vehicle.files import read_stock

from ..fmpy_problems import problems_of
from .test_any_wheelsets import TINY, start_of, table

pytestmark = pytest.mark.filterwarnings("ignore:a ring of")  # as short as it can be
SPATIAL, VERTICAL = Layout(2, directions=DIMENSIONS["spatial"]), Layout(2)
RUNTIMES = {"native": WITH_STATES, "FMI 3": NativeRuntime(fmi=3), "python": PythonRuntime()}
STEP, SPEED = 1e-4, 70.0  # s, m/s


@pytest.fixture(scope="module")
def spatial(tmp_path_factory):
    """The FMU by runtime."""
    start = start_of(VERTICAL)

    def made(name):
        folder = tmp_path_factory.mktemp("spatial")
        return export_track(TINY, start, folder, dimension="spatial", runtime=RUNTIMES[name])

    return {name: made(name) for name in RUNTIMES}


@pytest.fixture(scope="module")
def vertical(tmp_path_factory):
    return export_track(TINY, start_of(VERTICAL), tmp_path_factory.mktemp("vertical"))["Track"]


@pytest.fixture(scope="module")
def wagon_fmu(tmp_path_factory):
    """A vertical vehicle of as many wheelsets."""
    folder = tmp_path_factory.mktemp("wagon")
    return export(read_stock(Path("wagon")), TINY, folder, runtime=BARE)["Vehicle"]


def inputs_of(path):
    """Inputs of the reference run as FMPy takes them."""
    names, given = table(path, "in")
    rows = np.zeros(len(given), dtype=[("time", float), *((name, float) for name in names)])
    for name, column in zip(("time", *names), given.T, strict=True):
        rows[name] = column
    return rows


def rolled(path, forces, names, steps=60):
    """Outputs after every step under forces by name, functions of time, of wheels that roll."""
    positions = start_of(VERTICAL).positions
    with FmuComponent.load(path) as fmu:

        def given(t):
            values = {name: f(t) for name, f in forces.items()}
            places = {f"wheelset[{i + 1}].position": x + SPEED * t for i, x in enumerate(positions)}
            return np.array([(places | values).get(v.name, 0.0) for v in fmu.inputs])

        told = [v.name for v in fmu.outputs]
        fmu.enter_initialization(0.0)
        fmu.set_inputs(given(0.0))
        fmu.exit_initialization()
        rows = [fmu.get_outputs()]
        for k in range(steps):
            fmu.set_inputs(given(k * STEP))
            fmu.do_step(k * STEP, STEP)
            rows.append(fmu.get_outputs())
    return np.array(rows)[:, [told.index(name) for name in names]]


def test_names_and_units(spatial):
    """What is exchanged at a wheel, written out; the contact inside is vertical: no such FMU."""
    assert list(spatial["native"]) == ["Track"]
    with FmuComponent.load(spatial["native"]["Track"]) as fmu:
        inputs = {v.name: v.unit for v in fmu.inputs}
        outputs = {v.name: v.unit for v in fmu.outputs}
    assert list(inputs)[2:5] == [
        f"wheelset[1].left.{name}" for name in ("force_z", "force_y", "moment_x")
    ]
    assert list(inputs)[2:] == list(SPATIAL.names(FORCE))
    assert inputs["wheelset[2].right.moment_x"] == "N.m"
    right = {n.removeprefix("wheelset[2].right."): u for n, u in outputs.items() if "[2].r" in n}
    assert right == {
        "rail_z": "m", "rail_vz": "m/s", "rail_y": "m", "rail_vy": "m/s",
        "rail_roll": "rad", "rail_vroll": "rad/s",
    }  # fmt: skip
    assert Layout.among([*inputs, *outputs]) == SPATIAL


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_descriptions_are_valid(spatial, runtime):
    assert problems_of(spatial[runtime]["Track"]) == []


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_runtimes_repeat_the_reference_run(spatial, runtime):
    """Of 200 steps with rolling wheels and forces in all directions; a rounding apart."""
    path = spatial[runtime]["Track"]
    _, given = table(path, "in")
    wanted, expected = table(path, "ref")
    run = simulate_fmu(
        path, fmi_type="CoSimulation", stop_time=200 * STEP, step_size=STEP, output_interval=STEP,
        input=inputs_of(path),
        output=wanted,
    )  # fmt: skip
    found, size = np.array([run[name] for name in wanted]).T, np.abs(expected[:, 1:]).max(axis=0)
    assert np.abs(given[:, 3:]).max(axis=0).min() > 100  # every force and moment acts
    assert size.min() > 0
    assert (np.abs(found - expected[:, 1:]) / size).max() < 1e-9


# 3 s: a track of its own is reduced.
@pytest.mark.slow
def test_modes_that_move_in_all_directions(tmp_path):
    """Of rails that tilt with their slabs; of upright ones zeros are skipped."""
    tilted = replace(TINY, slab=replace(TINY.slab, tilts_rails=True))
    path = export_track(tilted, start_of(VERTICAL), tmp_path, dimension="spatial")["Track"]
    wanted, expected = table(path, "ref")
    run = simulate_fmu(
        path, fmi_type="CoSimulation", stop_time=200 * STEP, step_size=STEP, output_interval=STEP,
        input=inputs_of(path), output=wanted,
    )  # fmt: skip
    found, size = np.array([run[name] for name in wanted]).T, np.abs(expected[:, 1:]).max(axis=0)
    assert (np.abs(found - expected[:, 1:]) / size).max() < 1e-9
    down = expected[:, 1 + wanted.index("wheelset[1].left.rail_z")]
    upright = export_track(TINY, start_of(VERTICAL), tmp_path / "up", dimension="spatial")["Track"]
    names, other = table(upright, "ref")
    assert np.abs(down / other[:, 1 + names.index("wheelset[1].left.rail_z")] - 1).max() > 1e-6


def test_mirrored_excitation_gives_the_vertical_answers(spatial, vertical):
    """Equal forces down, and whatever acts sideways and in roll: down nothing changes.

    Sideways and in roll rails move as mirror images of each other.
    """
    down, aside = {}, {}
    for i, side in product((1, 2), ("left", "right")):
        mirror = 1 if side == "left" else -1
        wheel = f"wheelset[{i}].{side}"
        down[f"{wheel}.force_z"] = lambda t, i=i: 7e4 + 2e3 * i * np.sin(600 * t + i)
        aside[f"{wheel}.force_y"] = lambda t, m=mirror, i=i: m * (5e3 + 2e3 * np.sin(900 * t + i))
        aside[f"{wheel}.moment_x"] = lambda t, m=mirror, i=i: m * 300 * np.cos(400 * t + i)
    z = [n for q in (RAIL.motion, RAIL.rate) for n in VERTICAL.names(q)]
    expected = rolled(vertical, down, z)
    found = rolled(spatial["native"]["Track"], down | aside, z)
    size = np.abs(expected).max(axis=0)
    assert size.min() > 0
    assert (np.abs(found - expected) / size).max() < 1e-9
    own = [n for n in SPATIAL.names(RAIL.motion) if not n.endswith("_z")]
    moved = rolled(spatial["native"]["Track"], down | aside, own)
    left, right = np.split(moved, 2, axis=1)
    assert np.abs(left).max(axis=0).min() > 1e-5
    assert right == pytest.approx(-left, rel=1e-9, abs=1e-9 * np.abs(left).max())


def test_against_the_finite_elements(spatial):
    """At rest, every direction for every other, on both rails: names, signs and sides."""
    layout, positions = SPATIAL, (12.5, 4.6875)  # of nodes: beside a railseat, and midspan
    model = linear_model(
        spatial["native"]["Track"], inputs=layout.names(FORCE), outputs=layout.names(RAIL.motion),
        at=dict(zip(layout.of_axles("position"), positions, strict=True)),
    )  # fmt: skip
    points = [
        Point(x=positions[port.wheelset - 1], side=-1 if port.side == "left" else 1,
              direction=port.direction)
        for port in layout.ports
    ]  # fmt: skip
    exact = direct_receptance(TINY, np.zeros(1), points, points, viscous=True)[0].real
    found = model.frequency_response(np.zeros(1))[0].real
    size = np.sqrt(np.diag(exact))
    off = np.abs(found - exact) / size[:, None] / size
    # Single precision of the shapes.
    assert np.diag(off).max() < 1e-6
    # Modes to 400 Hz only: what they leave out reaches others a little.
    assert off.max() < 1e-2
    # Pushed to the right it goes there, and rolls by its head, the right side down.
    wheel = found[:3, :3]
    assert wheel[1, 1] > 0
    assert 0.2 < wheel[2, 1] / np.sqrt(wheel[1, 1] * wheel[2, 2]) < 1


def test_names_of_dimensions_are_told(tmp_path):
    with pytest.raises(ParameterError, match="dimension = lateral: must be one of vertical, spa"):
        export_track(TINY, start_of(VERTICAL), tmp_path, dimension="lateral")


def test_a_vertical_vehicle_does_not_stand_on_it(spatial, vertical):
    """Refused in a sentence that says what each is made for."""
    with (
        FmuComponent.load(vertical) as one,
        FmuComponent.load(spatial["native"]["Track"]) as other,
    ):
        told = [[*fmu.inputs, *fmu.outputs] for fmu in (one, other)]
    with pytest.raises(CouplingError, match=r"made for 2 wheelsets, spatial, and .* 2 wheelsets:"):
        layout_of((vertical, told[0]), (spatial["native"]["Track"], told[1]))


# 3 s: a spatial track is linearised.
@pytest.mark.slow
def test_nor_in_the_frequency_domain(spatial, wagon_fmu):
    with pytest.raises(CouplingError, match=r"made for 2 wheelsets, spatial, and .* 2 wheelsets:"):
        linear_models(wagon_fmu, spatial["native"]["Track"], lambda done, total: None)
