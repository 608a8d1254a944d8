"""Wagon, locomotive and trains on the track: coupled FMUs against the monolithic system."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from railcosim.analysis.comparison.in_time import newmark_forces
from railcosim.analysis.comparison.springs import frequency_errors
from railcosim.analysis.pair.linear_pair import linear_parts
from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.response.models import Models, linear_models
from railcosim.analysis.schemes.advice import advise
from railcosim.analysis.schemes.catalogue import members
from railcosim.analysis.schemes.disturbed import Disturbance
from railcosim.analysis.schemes.growth import Bench
from railcosim.analysis.schemes.motion import fastest_motion
from railcosim.analysis.schemes.stability import Coupling, SprungPair
from railcosim.fmus.export import BARE, export
from railcosim.master.cosimulation import cosimulate
from railcosim.master.course import Course
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.mechanics.law import HertzContact, LinearContact
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.reference.agreement import relative_rms
from railcosim.reference.contacts import Pressing
from railcosim.reference.monolithic import Monolithic, assemble
from railcosim.reference.rest import equilibrium
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import AxlePlace, CarBodyPlace, Coupler
from railcosim.vehicle.train import Train, TrainVehicle

# Rings shorter than is promised: coupled and monolithic have the same one.
pytestmark = [
    pytest.mark.slow,  # pairs and monolithic systems of up to 32 wheelsets
    pytest.mark.filterwarnings("ignore::railcosim.track.decay.RingWarning"),
]

SPEED, K_H = 250 / 3.6, 1e9
WAGON = read_stock(Path("wagon"))
LOCOMOTIVE = read_stock(Path(__file__).parents[2] / "examples" / "locomotive.toml")
# The car body's middle is ahead of the axles': wheels carry different loads.
LOADED_IN_FRONT = replace(
    WAGON, carbodies=(CarBodyPlace(x=0.8),), axles=(AxlePlace(x=4.5), AxlePlace(x=-4.5))
)
TWO = Train(
    vehicles=(TrainVehicle(vehicle=WAGON), TrainVehicle(vehicle=LOADED_IN_FRONT, reversed=True)),
    coupler=Coupler(stiffness=2e5, damping=1e4),
)
# Wheels of 0.43 and 0.46 m, which carry 79, 124 and 98 kN: a contact law a wheelset.
MIXED = Train(
    vehicles=(
        TrainVehicle(vehicle=read_stock(Path("paper"))),
        TrainVehicle(vehicle=LOADED_IN_FRONT),
    ),
    coupler=Coupler(stiffness=2e5, damping=1e4),
)
STOCK = {"wagon": (WAGON, 6), "locomotive": (LOCOMOTIVE, 6), "two coupled": (TWO, 8)}


@dataclass(frozen=True)
class Made:
    """FMUs, their linear models and the monolithic system of the same."""

    folder: Path
    models: Models
    mono: Monolithic


def made(stock, cells, folder):
    track = Track(mesh=Mesh(cells=cells, highest_slab_frequency=800, highest_frequency=3000))
    export(stock, track, folder, runtime=BARE)
    models = linear_models(folder / "Vehicle.fmu", folder / "Track.fmu", quiet)
    return Made(folder, models, assemble(stock, track, models.positions))


def quiet(done, total):
    """No progress bar."""


@pytest.fixture(scope="module", params=STOCK)
def any_train(request, tmp_path_factory):
    stock, cells = STOCK[request.param]
    return made(stock, cells, tmp_path_factory.mktemp(request.param.replace(" ", "")))


def worst(made, frequency, k_H=K_H):
    """Largest relative error where a response is above a thousandth of the largest of its kind."""
    errors = frequency_errors(made.models, made.mono, k_H, np.array(frequency), quiet)
    return max(
        float(np.nanmax(error, where=strong, initial=0.0))
        for by_output in errors.values()
        for error, strong in by_output.values()
    )


def coupled_run(made, parameters, stop):
    """Forces of a run (n, n_contacts), and what was run."""
    profile = replace(synthesise("german-low", SPEED * stop), fade=0.5)
    journey = Journey(speed=SPEED, held=True, profile=profile)
    course = Course(scheme=gauss_seidel(first="vehicle", degree=1), step=1e-4, stop=stop)
    fmus = made.folder / "Vehicle.fmu", made.folder / "TrackWithContact.fmu"
    run, stopped = run_pair(*fmus, parameters, journey, course, quiet)
    assert stopped is None
    names = Layout(len(made.models.positions)).names(FORCE)
    return np.stack([run[name].values for name in names], axis=1), journey, course


def monolithic_run(made, law, journey, course):
    """The same from the monolithic system."""
    springs = Pressing(law)
    return newmark_forces(made.mono, made.models.positions, springs, journey, course, quiet)


def test_advice_for_any_wheelsets(any_train) -> None:
    """Every wheel meets the irregularity, however many there are."""
    fmus = any_train.folder / "Vehicle.fmu", any_train.folder / "Track.fmu"
    found = advise(*fmus, 3e-2, contact=K_H, schemes=["gauss-seidel-constant-vehicle-first"])
    assert found.options
    for option in found.options:
        assert option.error <= 3e-2
        assert option.step < option.limit


LINEAR = {"contact.nonlinear": False, "contact.stiffness": K_H}


def test_frequency_responses(any_train) -> None:
    """Modes fade out above 1800 Hz; far from there that costs 1e-3 of what is not weak."""
    assert worst(any_train, [0.7, 2.3, 8.0, 37.0, 95.0, 240.0]) < 5e-3


def test_forces_in_time(any_train) -> None:
    """0.1 ms, contact in the track: as good as for the paper's vehicle; measured 1.6e-3."""
    ours, journey, course = coupled_run(any_train, LINEAR, 0.03)
    theirs = monolithic_run(any_train, LinearContact(k_H=K_H), journey, course)
    assert theirs.shape == (301, 2 * len(any_train.models.positions))
    assert np.abs(theirs - theirs[0]).max() > 100.0  # N
    error = relative_rms(ours - ours[0], theirs - theirs[0], np.zeros(len(ours[0])))
    assert error < 3e-3


@pytest.mark.parametrize(
    ("parameters", "law"),
    [(LINEAR, LinearContact(k_H=K_H)), ({"contact.hertz_coefficient": 9e10}, HertzContact(C=9e10))],
    ids=["linear", "Hertz"],
)
def test_forces_at_rest(any_train, parameters, law) -> None:
    """Every wheel carries its own load; heights change them where three axles hold a bogie."""
    ours, journey, _ = coupled_run(any_train, parameters, 1e-4)
    mono, positions = any_train.mono, any_train.models.positions
    heights = journey.profile.under(positions, SPEED)
    theirs = equilibrium(mono, Pressing(law), positions, heights(0.0)).force
    # The reduced track deflects by 1 mm to 2e-4; ten springs of 3 MN/m make a few N of that.
    assert ours[0] == pytest.approx(theirs, abs=5.0)
    assert ours[0].sum() == pytest.approx(mono.load.sum(), abs=1.0)


def test_whoever_owns_the_contact(any_train) -> None:
    """At rest the same, and the same some steps later, where wheels roll on a rail that slopes."""
    profile = replace(synthesise("german-low", 1.0), fade=0.5)
    journey = Journey(speed=SPEED, held=False, profile=profile)
    names = Layout(len(any_train.models.positions)).names(FORCE)
    mono, positions = any_train.mono, any_train.models.positions
    heights = profile.under(positions, SPEED)(0.0)
    theirs = equilibrium(mono, Pressing(HertzContact(C=9e10)), positions, heights).force
    changes = []
    for owner in Owner:
        fmus = [any_train.folder / f"{name}.fmu" for name in FMUS[owner]]
        with open_pair(*fmus, {"contact.hertz_coefficient": 9e10}, journey) as pair:
            points = list(cosimulate(pair.system, gauss_seidel(first="vehicle"), 5e-6, 1e-4))
            told = [name.partition(".")[2] for name in pair.system.names]
            columns = [told.index(name) for name in names]
        assert points[0].outputs[columns] == pytest.approx(theirs, abs=5.0)  # see above
        changes.append(points[-1].outputs[columns] - points[0].outputs[columns])
    # Held inputs lag by half a step of a twentieth of this span, which the contact halves again.
    size = np.abs(changes).max()
    assert size > 50.0  # N
    for change in changes[1:]:
        assert np.abs(change - changes[0]).max() < 0.05 * size


def test_loads_differ() -> None:
    loads = build_multibody(TWO).wheel_load
    assert loads[0] == pytest.approx(loads[1])
    assert loads[3] / loads[2] > 1.3  # reversed: what was in front is behind


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    return made(MIXED, 10, tmp_path_factory.mktemp("mixed"))


def own_law():
    """Hertz by the formula of two cylinders, steel, rail head of 0.3 m; and its tangents."""
    radius, load = np.array([0.43] * 4 + [0.46] * 2), build_multibody(MIXED).wheel_load
    C = 2 / 3 * 2.059e11 / (1 - 0.3**2) * (radius * 0.3) ** 0.25
    return C, 1.5 * C ** (2 / 3) * load ** (1 / 3)


@pytest.mark.parametrize("owner", Owner)
@pytest.mark.parametrize("nonlinear", [True, False], ids=["Hertz", "linear"])
def test_every_wheelset_has_its_own_contact(mixed, owner, nonlinear) -> None:
    """Whoever owns the contact takes every wheelset's own law, though nothing is given."""
    (C, k_H), step = own_law(), 1e-5
    law = HertzContact(C=np.tile(C, 2)) if nonlinear else LinearContact(k_H=np.tile(k_H, 2))
    profile = replace(synthesise("german-low", SPEED * 0.01), fade=0.2)
    journey = Journey(speed=SPEED, held=True, profile=profile)
    course = Course(scheme=gauss_seidel(first="vehicle", degree=1), step=step, stop=0.01)
    fmus = [mixed.folder / f"{name}.fmu" for name in FMUS[owner]]
    parameters = {"contact.nonlinear": nonlinear}
    if owner is Owner.MASTER and not nonlinear:  # which no FMU without contact tells
        names = Layout(6).of_axles("contact.stiffness")
        parameters |= dict(zip(names, k_H.tolist(), strict=True))
    run, stopped = run_pair(*fmus, parameters, journey, course, quiet)
    assert stopped is None
    ours = np.stack([run[name].values for name in Layout(6).names(FORCE)], axis=1)
    theirs = monolithic_run(mixed, law, journey, course)
    # What is measured for the paper's vehicle; one law, the mean, is wrong by 1e-2.
    assert ours[0] == pytest.approx(theirs[0], abs=5.0)
    assert np.abs(theirs - theirs[0]).max() > 1000.0  # N
    assert relative_rms(ours - ours[0], theirs - theirs[0], np.zeros(12)) < 3e-3


def test_frequency_responses_with_every_wheelsets_own_contact(mixed) -> None:
    assert worst(mixed, [0.7, 8.0, 37.0, 95.0, 240.0], own_law()[1]) < 5e-3


@pytest.mark.parametrize(
    ("owner", "name"), [(Owner.VEHICLE, "jacobi-linear"), (Owner.TRACK, "jacobi-quadratic")]
)
def test_what_grows_just_beyond_the_largest_stable_step_grows_in_runs(mixed, owner, name) -> None:
    """Linear springs, of every wheelset its own; limits themselves are sought in test_stability.

    Growth there is within 5 %, which is 0.02 % of the limit. With one number for all wheelsets,
    limits are 1.6 and 3 % elsewhere.
    """
    pair = mixed.folder / "Vehicle.fmu", mixed.folder / "Track.fmu"
    scheme = members()[name].scheme
    parts = linear_parts(*pair, quiet)
    coupling = Coupling(SprungPair(parts, owner, own_law()[1]), scheme)
    predicted = next(w for w in coupling.limit(longest=2e-3).windows if math.isfinite(w.fast))
    h = 1.004 * predicted.fast
    motion = fastest_motion(coupling, h)
    one = SprungPair(parts, owner, float(own_law()[1].mean()))
    assert abs(Coupling(one, scheme).growth(h) / motion.rate.real - 1) > 0.5
    disturbance = Disturbance()
    journey = Journey(speed=SPEED, held=True, profile=disturbance)
    parameters = {"contact.nonlinear": False, "internal_step": 2e-5}
    fmus = [mixed.folder / f"{name}.fmu" for name in FMUS[owner]]
    with open_pair(*fmus, parameters, journey) as opened:
        grown = Bench(opened, disturbance).growth(scheme, h, motion)
    assert grown == pytest.approx(motion.rate.real, rel=0.05, abs=0.1)


# A ring of 50 cells, and 10,000 unknowns at once.
def test_eight_vehicles(tmp_path) -> None:
    """32 wheelsets of the paper's vehicle, coupled."""
    one = TrainVehicle(vehicle=read_stock(Path("paper")))
    train = Train(vehicles=8 * (one,), coupler=Coupler(stiffness=1e5, damping=5e3))
    eight = made(train, 40, tmp_path)
    assert worst(eight, [0.7, 37.0, 95.0]) < 5e-3
    ours, journey, course = coupled_run(eight, LINEAR, 0.01)
    theirs = monolithic_run(eight, LinearContact(k_H=K_H), journey, course)
    assert ours.shape == theirs.shape == (101, 64)
    error = relative_rms(ours - ours[0], theirs - theirs[0], np.zeros(64))
    assert error < 3e-3
