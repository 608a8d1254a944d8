"""The coupled response in space: excitations, hunting, the mirror, and the monolithic solution."""

import warnings
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from railcosim.analysis.response.bodies import linear_of
from railcosim.analysis.response.excitation import check_excitation, is_mirrored, loads_of
from railcosim.analysis.response.frequency import coupled, dataset, on_rigid_track, response
from railcosim.analysis.response.meeting import Rolled
from railcosim.analysis.response.models import Models
from railcosim.analysis.response.rolling import ON_RAIL, ON_WHEEL
from railcosim.analysis.response.rolling_pair import rolling_of
from railcosim.cli.meeting_options import MeetingOptions
from railcosim.cli.options import UsageError
from railcosim.master.connections import CouplingError
from railcosim.mechanics.ports import FORCE, RAIL, Layout
from railcosim.reference.contacts import LinearRolling
from railcosim.reference.frequency import frequency_response, linearised
from railcosim.reference.monolithic import assemble
from railcosim.track.parameters import Mesh, Track
from railcosim.track.reduced import reduce_track
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import SPATIAL, build_multibody
from railcosim.vehicle.on_rails import cones_of, rolling
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.properties import Rolling

POSITIONS = np.array([18.75, 16.25, 2.65625, 0.3125])  # midspan, between, a railseat, midspan
BODY = build_multibody(Vehicle(), SPATIAL)
OMEGA = 2 * np.pi * np.array([0.4, 1.8, 7.0, 33.0, 91.0, 200.0])
SPEED = 20.0


def with_loads(model):
    """As an FMU tells them."""
    loads = dict(zip(Layout(4).names(FORCE), np.tile(BODY.wheel_load, 2), strict=True))
    inputs = tuple(replace(v, start=float(loads.get(v.name, 0.0))) for v in model.inputs)
    return replace(model, inputs=inputs)


@pytest.fixture(scope="module")
def vehicle():
    return with_loads(linear_of(vehicle_body(BODY).at(POSITIONS), "vehicle"))


@pytest.fixture(scope="module")
def alone(vehicle):
    return Models(vehicle, None, POSITIONS, {})


def contacts_of(model, stock=None):
    return rolling_of(stock or Vehicle(), [Path("Vehicle.fmu")], model)


@pytest.mark.parametrize(
    ("critical", "said"),
    [(np.nan, "Hz, and not up to 1000 km/h"), (0.0, "it does at 5 km/h already"),
     (50.0, "it does from 180.0 km/h on")],
)  # fmt: skip
def test_says_from_where_on_it_hunts(alone, monkeypatch, critical, said):
    pair = SimpleNamespace(
        growing=lambda speed: 0.1 + 5j, critical=lambda: SimpleNamespace(speed=critical)
    )
    monkeypatch.setattr(Rolled, "pair", pair)
    with pytest.raises(ArithmeticError, match=said):
        Rolled(contacts_of(alone.vehicle), alone).check(1100 / 3.6, believe=False)


def test_numbers_of_the_papers_vehicle_are_refused_for_an_fmu_in_space():
    given = MeetingOptions(vehicle_fmu=[Path("V.fmu")], set_=["carbody.mass=2e4"])
    given.__dict__["in_space"] = True
    with pytest.raises(UsageError, match="with --vehicle as well"), given.files():
        pass


def test_a_vehicle_that_hunts_is_refused_with_its_critical_speed(alone):
    """166.2 km/h on rigid rails at a conicity of 0.05, as critical-speed has it."""
    contacts = contacts_of(alone.vehicle)
    with pytest.raises(ArithmeticError, match=r"at 250 km/h .*hunts.* 166\.2 km/h.*--believe"):
        Rolled(contacts, alone).check(250 / 3.6, believe=False)
    with pytest.warns(UserWarning, match="hunts"):
        Rolled(contacts, alone).check(250 / 3.6, believe=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Rolled(contacts, alone).check(166.0 / 3.6, believe=False)
    with pytest.raises(ArithmeticError, match=r"at 166\.4 km/h"):
        Rolled(contacts, alone).check(166.4 / 3.6, believe=False)
    worn = contacts_of(alone.vehicle, Vehicle(rolling=Rolling(conicity=0.2)))
    with pytest.raises(ArithmeticError, match=r"84\.0 km/h"):
        Rolled(worn, alone).check(100 / 3.6, believe=False)


def test_what_is_its_own_mirror_image_moves_nothing_aside(alone):
    """Down alike, or wider by gauge: all stay in the middle. Aside, or one rail low: no bounce."""
    system = on_rigid_track(alone, OMEGA, contacts_of(alone.vehicle).at(SPEED))
    odd = [f"vehicle.{body}.{d}" for body in BODY.names for d in ("y", "roll", "yaw")]
    even = [f"vehicle.{name}.z" for name in BODY.names] + ["vehicle.carbody.pitch"]
    for excitation in ("vertical", "gauge", "cross_level", "alignment"):
        found = np.abs(response(system, excitation, POSITIONS, SPEED))
        aside, down = (found[:, system.rows(names)].max() for names in (odd, even))
        still, moved = (aside, down) if is_mirrored(excitation) else (down, aside)
        assert still < 1e-10 * moved
    assert is_mirrored("wheelset[1].rail_force_z")
    assert not is_mirrored("wheelset[1].rail_force_y")


def test_slowly_wheelsets_go_where_the_track_goes(alone):
    """An alignment of long waves takes all with it; of a low left rail the wheelsets' roll is half
    of its depth over the half distance of the rails."""
    omega = np.array([2 * np.pi * 1e-3])
    system = on_rigid_track(alone, omega, contacts_of(alone.vehicle).at(SPEED))
    found = response(system, "alignment", POSITIONS, SPEED)[0]
    moved = found[system.rows(["vehicle.wheelset[1].y", "vehicle.carbody.y"])]
    np.testing.assert_allclose(moved, 1.0, atol=0.02)  # a wave is 20 km
    found = response(system, "cross_level", POSITIONS, SPEED)[0]
    (roll,) = found[system.rows(["vehicle.wheelset[1].roll"])]
    # Left side down: about the forward axis, against the right side down.
    assert roll == pytest.approx(-0.5 / BODY.wheels[0].half_distance, rel=0.02)


def test_wheelsets_meet_irregularity_one_after_the_other(alone):
    system = on_rigid_track(alone, OMEGA, contacts_of(alone.vehicle).at(SPEED))
    names, amplitudes = loads_of(system, "gauge", POSITIONS, SPEED)
    assert names[:2] == ["wheelset[1].left.irregularity_y", "wheelset[2].left.irregularity_y"]
    behind = 18.75 - np.tile(POSITIONS, 2)
    expected = np.repeat([-0.5, 0.5], 4) * np.exp(-1j * np.outer(OMEGA, behind / SPEED))
    np.testing.assert_allclose(amplitudes, expected, rtol=1e-12)
    names, amplitudes = loads_of(system, "wheelset[3].cross_level", POSITIONS, SPEED)
    assert names == ["wheelset[3].left.irregularity_z", "wheelset[3].right.irregularity_z"]
    np.testing.assert_allclose(amplitudes, np.tile([0.5, -0.5], (6, 1)))
    with pytest.raises(CouplingError, match="there is no such input"):
        loads_of(system, "wheelset[1].rail_force_y", POSITIONS, SPEED)  # rails do not move
    with pytest.raises(CouplingError, match=r"must be irregularity_z, vertical, .*, or one of"):
        loads_of(system, "sideways", POSITIONS, SPEED)
    with pytest.raises(CouplingError, match=r"must be irregularity_z, vertical, or .*in space"):
        check_excitation("cross_level", in_space=False)


def test_results_have_units(alone):
    system = on_rigid_track(alone, OMEGA, contacts_of(alone.vehicle).at(SPEED))
    values = response(system, "alignment", POSITIONS, SPEED)
    told = dataset(system, values, alone, "alignment")
    units = {name: told[name].attrs["units"] for name in told.data_vars}
    assert units["carbody.y"] == units["wheelset[1].left.wheel_y"] == "m/m"
    assert units["bogie[1].yaw"] == "rad/m"
    assert units["wheelset[2].right.force_y"] == units["wheelset[2].right.force_x"] == "N/m"
    assert units["wheelset[2].right.rail_moment_x"] == "N.m/m"


@pytest.mark.slow  # the track is reduced in all directions
@pytest.mark.filterwarnings("ignore::railcosim.track.decay.RingWarning")
def test_against_the_monolithic_solution(vehicle):
    """All of one matrix, both rails and slabs in finite elements, at a speed below hunting."""
    track = Track(mesh=Mesh(cells=4, highest_slab_frequency=300))
    rails = reduce_track(track, ON_RAIL).under(Layout(4, directions=ON_RAIL)).at(POSITIONS)
    models = Models(vehicle, linear_of(rails, "track"), POSITIONS, {})
    system = coupled(models, OMEGA, contacts_of(vehicle).at(SPEED))

    mono = assemble(Vehicle(), track, POSITIONS, SPATIAL)
    at_speed = rolling(BODY, cones_of(BODY, Vehicle().rolling.conicity))(SPEED)
    linear = linearised(mono, LinearRolling(at_speed), POSITIONS)
    names, one = Layout(4, directions=ON_RAIL), Layout(4, directions=ON_WHEEL)
    bodies = list(BODY.coordinates)
    for excitation in ("vertical", "cross_level", "alignment", "gauge"):
        ours = response(system, excitation, POSITIONS, SPEED)
        inputs, amplitudes = loads_of(system, excitation, POSITIONS, SPEED)
        # Irregularities of the reference: of each contact down and to the right.
        order = [f"{wheel}.irregularity_{d}" for wheel in one.wheels for d in "zy"]
        rough = np.zeros((OMEGA.size, 16, 1), complex)
        rough[:, [order.index(name) for name in inputs], 0] = amplitudes
        x = frequency_response(mono, OMEGA, linear, linear.loads @ rough)
        moved = np.array([mono.rails(POSITIONS) @ at for at in x])[..., 0]
        force = linear.forces(OMEGA, x)[..., 0] - np.einsum(
            "pm,wm->wp", (linear.pushes @ linear.K @ linear.lowered).toarray(), rough[..., 0]
        )
        told = [n.replace("moment_x", "rail_moment_x") for n in names.names(FORCE)]
        for expected, outputs in (
            (x[:, : len(bodies), 0], [f"vehicle.{name}" for name in bodies]),
            (moved, [f"track.{name}" for name in names.names(RAIL.motion)]),
            (force, told),
        ):
            found = ours[:, system.rows(outputs)]
            size = np.abs(expected).max(axis=1, keepdims=True)
            # Promised of the reduced track, of each kind of answer.
            assert np.abs((found - expected) / size).max() < 5e-3
