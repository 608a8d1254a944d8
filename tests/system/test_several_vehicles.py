"""Vehicles as one FMU each on one track, against the same in one FMU and against the monolith."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railcosim.analysis.comparison.in_time import newmark_forces
from railcosim.analysis.pair.linear_pair import linear_parts
from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.analysis.pair.several import load_vehicles
from railcosim.analysis.pair.standing import start_positions
from railcosim.analysis.pair.static_load import static_stiffness
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.response.frf import frequency_response
from railcosim.analysis.response.map import response_map
from railcosim.analysis.response.models import linear_models
from railcosim.analysis.run import run
from railcosim.fmus.export import BARE, export
from railcosim.master.connections import CouplingError
from railcosim.master.course import Course
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.interface_jacobian import interface_jacobian
from railcosim.master.schemes.jacobi import jacobi
from railcosim.mechanics.law import HertzContact
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.parameters import ArgumentError
from railcosim.reference.agreement import relative_rms
from railcosim.reference.contacts import Pressing
from railcosim.reference.monolithic import assemble
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.train import Train, TrainVehicle

pytestmark = [
    pytest.mark.slow,  # three exports of pairs, and a monolithic system
    pytest.mark.filterwarnings("ignore::railcosim.track.decay.RingWarning"),
]

SPEED = 250 / 3.6
PAPER, WAGON = read_stock(Path("paper")), read_stock(Path("wagon"))
TRAIN = Train(vehicles=(TrainVehicle(vehicle=PAPER), TrainVehicle(vehicle=WAGON)))
TRACK = Track(mesh=Mesh(cells=10, highest_slab_frequency=800, highest_frequency=3000))
FORCES = Layout(6).names(FORCE)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory):
    """Each vehicle, and the train with the track for it."""
    named = {"paper": PAPER, "wagon": WAGON, "train": TRAIN}
    return {
        n: export(stock, TRACK, tmp_path_factory.mktemp(n), runtime=BARE)
        for n, stock in named.items()
    }


@pytest.fixture(scope="module")
def positions(fmus):
    """Where the last wheelset of each stands: as in the train."""
    x = build_multibody(TRAIN).wheelset_x
    last = TRACK.fastening.spacing / 2
    return [float(x[3] - x[5] + last), last]


def journey(duration, *, held):
    profile = replace(synthesise("german-low", SPEED * duration), fade=0.2)
    return Journey(speed=SPEED, held=held, profile=profile)


SCHEMES = {
    Owner.TRACK: gauss_seidel(first="vehicle", degree=1),
    Owner.VEHICLE: jacobi(degree=1),
    Owner.MASTER: interface_jacobian(),
}


@pytest.mark.parametrize("owner", Owner)
def test_the_same_as_in_one_fmu(fmus, positions, owner) -> None:
    """Bits apart, which the order of the modes of both in one FMU decides: rolling, 0.01 s."""
    vehicle, track = FMUS[owner]
    both = fmus["paper"][vehicle], fmus["wagon"][vehicle]
    course = Course(scheme=SCHEMES[owner], step=2e-5, stop=0.01)
    over, rails = journey(0.01, held=False), fmus["train"][track]
    starts = start_positions(both, positions)
    apart, _ = run_pair(both, rails, starts, over, course, quiet)
    whole, _ = run_pair(fmus["train"][vehicle], rails, {}, over, course, quiet)
    names = {name: name for name in whole.data_vars if name.startswith("wheelset")} | {
        "carbody[1].z": "vehicle[1].carbody.z", "carbody[2].pitch": "vehicle[2].carbody.pitch",
        "bogie[2].vz": "vehicle[1].bogie[2].vz",
    }  # fmt: skip
    for there, here in names.items():
        size = np.abs(whole[there].values).max()
        error = np.abs(apart[here].values - whole[there].values).max()
        assert error <= 1e-11 * size, there  # measured 1.5e-12, 0 where the vehicle has no contact
    assert np.ptp(whole[FORCES[9]].values) > 500.0  # N: the wagon moves


def quiet(done, total):
    """No progress bar."""


def test_against_the_monolithic_system(fmus, positions) -> None:
    """Every vehicle with the contact law of its own wheels."""
    both = fmus["paper"]["Vehicle"], fmus["wagon"]["Vehicle"]
    models = linear_models(both, fmus["train"]["Track"], quiet, positions)
    mono = assemble(TRAIN, TRACK, models.positions)
    law = HertzContact(C=np.tile(build_multibody(TRAIN).hertz_coefficient, 2))
    over = journey(0.02, held=True)
    course = Course(scheme=gauss_seidel(first="vehicle", degree=1), step=5e-5, stop=0.02)
    parameters = start_positions(both, positions)
    found, _ = run_pair(both, fmus["train"]["TrackWithContact"], parameters, over, course, quiet)
    ours = np.stack([found[name].values for name in FORCES], axis=1)
    theirs = newmark_forces(mono, models.positions, Pressing(law), over, course, quiet)
    assert ours[0] == pytest.approx(theirs[0], abs=5.0)  # the reduced track, see test_any_train
    assert relative_rms(ours - ours[0], theirs - theirs[0], np.zeros(12)) < 3e-3


def test_in_the_frequency_domain(fmus, positions) -> None:
    """Against one FMU to rounding, and its errors against the monolithic system."""
    both = fmus["paper"]["Vehicle"], fmus["wagon"]["Vehicle"]
    rails, frequency = fmus["train"]["Track"], np.array([0.7, 8.0, 37.0, 95.0, 240.0])
    given = {"excitation": "irregularity_z", "contact_stiffness": 1e9}
    apart = frequency_response(both, rails, frequency, position=positions, **given)
    whole = frequency_response(fmus["train"]["Vehicle"], rails, frequency, **given)
    for there, here in {
        FORCES[5]: FORCES[5], "wheelset[1].left.rail_z": "wheelset[1].left.rail_z",
        "carbody[2].z": "vehicle[2].carbody.z",
    }.items():  # fmt: skip
        assert apart[here].values == pytest.approx(whole[there].values, rel=1e-9)
    models = linear_models(both, rails, quiet, positions)
    assert [v.name for v in models.vehicle.inputs] == [
        *FORCES[:4],
        *FORCES[6:10],
        *FORCES[4:6],
        *FORCES[10:],
    ]


def test_predicted_as_in_one_fmu(fmus, positions) -> None:
    """Matrices and static stiffness of every wheelset, each vehicle where it is said to stand."""
    both = fmus["paper"]["Vehicle"], fmus["wagon"]["Vehicle"]
    rails, omega = fmus["train"]["Track"], 2 * np.pi * np.array([3.0, 37.0, 240.0])
    apart = linear_parts(both, rails, quiet, positions)
    whole = linear_parts(fmus["train"]["Vehicle"], rails, quiet)
    for part, same in zip(apart, whole, strict=True):
        ours, theirs = (
            one.track.response(1j * omega) - one.vehicle.frequency_response(omega)
            for one in (part, same)
        )
        # Modes are left out of the track to 1e-6, of which rounding changes the place.
        assert np.abs(ours - theirs).max() < 1e-7 * np.abs(theirs).max()
    k_H = [
        static_stiffness(vehicle, rails, {"contact.nonlinear": True}, position)
        for vehicle, position in ((both, positions), (fmus["train"]["Vehicle"], None))
    ]
    assert k_H[0] == pytest.approx(k_H[1], rel=1e-9)
    assert np.ptp(k_H[0]) > 0.1 * k_H[0].max()  # 1.30 and 1.46 GN/m


def test_what_is_of_one_vehicle_says_so(fmus, positions) -> None:
    both = fmus["paper"]["Vehicle"], fmus["wagon"]["Vehicle"]
    span = np.array([1.0, 2.0])
    with pytest.raises(CouplingError, match="this has 6 wheelsets"):
        response_map(both, fmus["train"]["Track"], span, span, position=positions)


def test_what_cannot_be(fmus, positions) -> None:
    vehicle, track = FMUS[Owner.TRACK]
    both, rails = (fmus["paper"][vehicle], fmus["wagon"][vehicle]), fmus["train"][track]
    with pytest.raises(CouplingError, match="is not behind the last one of"):
        run(both, rails, time=1e-3)
    with pytest.raises(CouplingError, match="is not behind the last one of"):
        run(both, rails, time=1e-3, position=positions[::-1])
    with pytest.raises(ArgumentError, match="one of each of 2 vehicles"):
        run(both, rails, time=1e-3, position=[0.3])
    owning = fmus["wagon"]["VehicleWithContact"]
    with pytest.raises(CouplingError, match="all do or none"):
        run([both[0], owning], rails, position=positions)
    with pytest.raises(CouplingError, match="made for 6 wheelsets"):
        run([both[0], both[0]], rails, time=1e-3, position=[30.0, 0.3])
    span = np.ptp(build_multibody(PAPER).wheelset_x)
    around = [positions[1] + TRACK.length - span - 0.1, positions[1]]
    cars = [fmus[name]["Vehicle"] for name in ("paper", "wagon")]
    for linearised in (linear_parts, linear_models):
        with pytest.raises(CouplingError, match="left the other way round"):
            linearised(cars, fmus["train"]["Track"], quiet, around)


def test_the_step_that_suits_all_is_the_shortest(fmus) -> None:
    def load(path, name):
        fmu = FmuComponent.load(path, name=name)
        step = {"vehicle[1]": 1e-3, "vehicle[2]": 1e-5, "vehicle[3]": None}[name]
        fmu.description = replace(fmu.description, default_step=step)
        return fmu

    cars = [fmus[name]["Vehicle"] for name in ("paper", "wagon", "paper")]
    with load_vehicles(cars, load) as three:
        assert three.description.default_step == 1e-5


def test_a_run_goes_on_from_its_state(fmus, positions) -> None:
    """All vehicles go back together, also through bytes."""
    vehicle, track = FMUS[Owner.TRACK]
    both, rails = (fmus["paper"][vehicle], fmus["wagon"][vehicle]), fmus["train"][track]
    starts = start_positions(both, positions)
    with open_pair(both, rails, starts, journey(0.01, held=False)) as pair:
        cars = pair.vehicle
        state = cars.deserialize_state(cars.serialize_state(cars.save_state()))
        pushed = 1.1 * cars.u
        cars.set_inputs(pushed)
        cars.do_step(0.0, 1e-3)
        first = cars.get_outputs()
        cars.restore_state(state)
        assert not np.array_equal(cars.get_outputs(), first)
        cars.set_inputs(pushed)
        cars.do_step(0.0, 1e-3)
        assert np.array_equal(cars.get_outputs(), first)
