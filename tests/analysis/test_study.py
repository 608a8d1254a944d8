"""Studies: the converged forces, what a point measures, what is kept, and who may be killed."""

import os
import shutil
import signal
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
import xarray as xr
from scipy.integrate import solve_ivp

from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.schemes.catalogue import members
from railcosim.analysis.schemes.coupled_reference import converged_forces
from railcosim.analysis.schemes.study import Folder, Grid, StudyError, settings_of
from railcosim.analysis.schemes.study_here import measured as measured_here
from railcosim.analysis.schemes.study_point import (
    ContactCase,
    Measurement,
    PairStudied,
    measure,
    reference,
)
from railcosim.analysis.schemes.study_table import DIMS, observed_order, save_table, table_of
from railcosim.master.component import Variable
from railcosim.master.files import load
from railcosim.master.law import Tangents
from railcosim.master.linear.state_space import StateSpace
from railcosim.mechanics.law import HertzContact, LinearContact
from railcosim.track.irregularity import Profile, synthesise
from railcosim.track.irregularity.usual import FADE_IN

distributed = pytest.importorskip("distributed")
from railcosim.analysis.schemes.cluster import ClusterError, connect, measured  # noqa: E402

pytestmark = pytest.mark.slow  # converged references for every case

STIFF = ContactCase(label="1e9", parameters={"contact.nonlinear": False, "contact.stiffness": 1e9})
STOP, LONG = 0.02, 0.05

# A wheel on a soft primary suspension over a sleeper on its bed, kg, N/m, N s/m.
M = np.diag([840.0, 400.0])
K = np.diag([1e6, 8e7])
C = np.diag([3e4, 9e4])
LOAD = 8e4  # N


def pair_of_masses() -> StateSpace:
    """From the contact force to the compression: the wheel goes up, the sleeper down."""
    inverse = np.linalg.inv(M)
    zero, eye = np.zeros((2, 2)), np.eye(2)
    A = np.block([[zero, eye], [-inverse @ K, -inverse @ C]])
    B = np.concatenate([np.zeros(2), inverse @ [-1.0, 1.0]])[:, None]
    return StateSpace(
        name="masses",
        A=sp.csc_array(A),
        B=B,
        C=np.array([[1.0, -1.0, 0.0, 0.0]]),
        D=np.zeros((1, 1)),
        inputs=(Variable(name="force", unit="N"),),
        outputs=(Variable(name="compression", unit="m"),),
    )


def test_reference_is_the_exponential_of_the_whole() -> None:
    """Wheel, spring and sleeper on a wave that begins smoothly: one matrix with its excitation."""
    model, k, omega, height = pair_of_masses(), 1e9, 2 * np.pi * 150, 1e-4
    forces = converged_forces(
        model,
        LinearContact(k_H=k),
        np.array([LOAD / k]),
        lambda t: np.array([height * (1 - np.cos(omega * t))]),
        STOP,
    )
    # x' = (A + k B C) x - k B z, and z = height (1 - c), where c' = -omega s, s' = omega c.
    whole = np.zeros((7, 7))
    whole[:4, :4] = model.A.toarray() + k * model.B @ model.C
    whole[:4, 6:] = -k * model.B * height
    whole[:4, 4:5] = k * model.B * height
    whole[4, 5], whole[5, 4] = -omega, omega
    times = np.linspace(0, STOP, 173)
    exact = []
    for t in times:
        x = scipy.linalg.expm(whole * t) @ [0, 0, 0, 0, 1.0, 0, 1.0]
        exact.append(LOAD + k * (model.C @ x[:4] - height * (1 - np.cos(omega * t)))[0])
    dynamic = np.ptp(exact)
    assert dynamic > 0.1 * LOAD
    # Its own estimate, 1e-9 at most, and the rounding of k times a difference of displacements.
    assert np.abs(forces.at(times)[:, 0] - exact).max() < 5e-9 * dynamic
    assert forces.error <= 1e-9


def test_reference_with_loss_of_contact_knows_its_error() -> None:
    """A dip so deep that the wheel flies: against an explicit integration with tiny tolerances."""
    model, law = pair_of_masses(), HertzContact(C=1e11)
    rest, omega = (LOAD / law.C) ** (2 / 3), 2 * np.pi * 80

    def height(t: float) -> float:
        return 4e-4 * np.sin(omega * t) ** 3

    forces = converged_forces(model, law, np.array([rest]), lambda t: np.array([height(t)]), STOP)

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        force = law.force(rest + model.C @ x - height(t)) - LOAD
        return model.A @ x + model.B @ force

    times = np.linspace(0, STOP, 400)
    found = solve_ivp(
        rate, (0, STOP), np.zeros(4), method="DOP853", t_eval=times, rtol=1e-11, atol=1e-14,
        max_step=1e-5,
    ).y  # fmt: skip
    exact = law.force(rest + (model.C @ found)[0] - np.array([height(t) for t in times]))
    assert (exact == 0).any()  # it flies
    error = np.sqrt(np.mean((forces.at(times)[:, 0] - exact) ** 2) / np.mean((exact - LOAD) ** 2))
    # The estimate is of the last halving, so the error is below it; five times for the luck of
    # where the kinks fall in their intervals.
    assert error < 5 * forces.error + 1e-9
    assert forces.error < 1e-5


def test_reference_with_a_damper_that_jumps_with_its_force() -> None:
    """A mass that falls on a damper, both of which move at once: one equation of first order."""
    m, c, through, push = 100.0, 4e4, 2e-5, 500.0
    one = (Variable(name="force", unit="N"),)
    # The rate of the gap is v less what the force makes at once, and m v' = -change of the force.
    model = StateSpace(
        name="damped", A=sp.csc_array((1, 1)), B=np.array([[-1 / m]]), C=np.ones((1, 1)),
        D=np.array([[-through]]), inputs=one, outputs=one,
    )  # fmt: skip
    found = converged_forces(
        model, Tangents(np.array([[[c]]])), np.array([[1.0]]), lambda t: np.zeros(1), STOP,
        held=np.array([c - push]),
    )  # fmt: skip
    # F = c (1 + v - through (F - held)), so F' = -g (F - held) / m with g = c / (1 + c through).
    g = c / (1 + c * through)
    times = np.linspace(0.0, STOP, 50)
    exact = c - push + push / c * g * np.exp(-g * times / m)
    assert found.at(times)[:, 0] == pytest.approx(exact, rel=1e-9)


# --- points -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def ride() -> tuple[Journey, float]:
    speed = 250 / 3.6
    # Over less, what is met is one bump or two, and an order is theirs.
    profile = synthesise("german-low", speed * LONG)
    return Journey(speed=speed, held=True, profile=profile), LONG


@pytest.fixture(scope="module")
def contents(exported):
    return {name: exported[name].read_bytes() for names in FMUS.values() for name in names}


@pytest.fixture(scope="module")
def forces(ride, contents):
    """Converged forces of that ride."""
    return reference(*ride, STIFF, *(contents[name] for name in FMUS[Owner.MASTER]))


def studied(ride, contents) -> PairStudied:
    return PairStudied(journey=ride[0], stop=ride[1], fmus=contents)


def grid(names: list[str], steps: list[float], owners=(Owner.TRACK,)) -> Grid:
    known = members()
    return Grid(
        schemes={name: known[name] for name in names}, owners=owners, contacts=[STIFF], steps=steps
    )


def test_orders_of_the_pair(ride, contents, forces) -> None:
    """Schemes approach the monolithic solution, with the order that they claim.

    That they get there at all says that both are right: nothing is shared but the bodies' matrices.
    """
    assert forces.error < 1e-8
    names = ["jacobi-constant", "jacobi-linear", "jacobi-quadratic"]
    results = []
    for point in grid(names, [1e-4, 5e-5, 2.5e-5]).points():
        pair = [contents[name] for name in FMUS[point.owner]]
        results.append((point, measure(*ride, point, *pair, forces)))
    table = table_of(results, {}).isel(owner=0, contact=0)
    orders = table["observed_order"].sel(scheme=names).values
    # Measured 0.96, 1.99, 3.02.
    assert orders == pytest.approx([1.0, 2.0, 3.0], abs=0.1)
    assert table["error"].sel(scheme="jacobi-quadratic").values.min() < 5e-6


def test_claimed_orders_from_one_to_four(contents) -> None:
    """Contact in the master, whose law is exact, on a wave of 0.1 m: 700 Hz at 250 km/h.

    A smooth irregularity leaves so small an error that the fourth order meets the reference's.
    """
    x = np.arange(0.0, 13.0, 5e-4)
    wave = 1e-5 * np.sin(2 * np.pi * x / 0.1)
    profile = Profile(name="wave of 0.1 m", x=x, left=wave, right=wave, fade=FADE_IN)
    ride = Journey(speed=250 / 3.6, held=True, profile=profile), STOP
    bodies = [contents[name] for name in FMUS[Owner.MASTER]]
    forces = reference(*ride, STIFF, *bodies)
    claimed = {
        "picard-constant": 1,
        "interface-jacobian": 2,
        "picard-quadratic": 3,
        "interface-jacobian-radau-2": 3,
        "interface-jacobian-hermite": 4,
    }
    points = grid(list(claimed), [2.5e-5, 1.25e-5], [Owner.MASTER]).points()
    table = table_of([(p, measure(*ride, p, *bodies, forces)) for p in points], {})
    assert table["order"].sel(scheme=list(claimed)).values.tolist() == list(claimed.values())
    observed = table["observed_order"].isel(owner=0, contact=0).sel(scheme=list(claimed)).values
    # Asked for: within 0.1. Measured 0.96, 2.00, 2.99, 2.96, 4.00.
    assert observed == pytest.approx(list(claimed.values()), abs=0.1)


def test_third_order_at_a_tenth_of_a_millisecond(ride, contents, forces) -> None:
    """1 GN/m, 0.1 ms: contact forces within 1e-5, asked for; measured 2.5e-6."""
    bodies = [contents[name] for name in FMUS[Owner.MASTER]]
    (point,) = grid(["interface-jacobian-radau-2"], [1e-4], [Owner.MASTER]).points()
    assert point.scheme.order == 3
    assert measure(*ride, point, *bodies, forces).error < 1e-5


def test_elsewhere_both_the_runs_and_what_they_are_held_to_stand_there(
    ride, contents, forces
) -> None:
    """Between two railseats forces are others, and a good scheme is as good."""
    journey, stop = ride
    between = replace(journey, position=3.125)
    theirs = reference(between, stop, STIFF, *(contents[name] for name in FMUS[Owner.MASTER]))
    (point,) = grid(["jacobi-quadratic"], [1e-4]).points()
    pair = [contents[name] for name in FMUS[point.owner]]
    # Measured 1.3e-4, and 1.6e-2 where the run stands at the usual place.
    assert measure(between, stop, point, *pair, theirs).error < 5e-4
    assert measure(journey, stop, point, *pair, theirs).error > 1e-2


def test_a_run_that_diverges_is_measured(ride, contents, forces) -> None:
    """Contact in the vehicle, 0.2 ms: it grows, and it is said that it stopped and why."""
    (point,) = grid(["jacobi-linear"], [2e-4], [Owner.VEHICLE]).points()
    found = measure(*ride, point, *(contents[n] for n in FMUS[Owner.VEHICLE]), forces)
    assert found.error > 1.0
    assert found.growth > 1.05


# --- what is kept -------------------------------------------------------------------------------

FOUND = Measurement(
    error=np.inf, reference_error=1e-10, growth=np.nan, evaluations=2.5, wall=0.1, steps=3,
    open_steps=1, fallbacks="", stopped="diverged",
)  # fmt: skip


def test_folder_gives_back_what_it_keeps(tmp_path) -> None:
    """Infinity, NaN and text; other points, other settings and broken files are not mixed up."""
    first, second = grid(["jacobi-constant"], [1e-4, 2e-4]).points()
    folder = Folder(tmp_path / "study", {"time": 1.0})
    folder.keep(first, FOUND)
    again = Folder(tmp_path / "study", {"time": 1.0})
    assert repr(again.find(first)) == repr(FOUND)  # NaN is unequal to itself
    assert again.find(second) is None
    with pytest.raises(StudyError, match=r"time was 1\.0, now it is 2\.0"):
        Folder(tmp_path / "study", {"time": 2.0})
    (file,) = (tmp_path / "study" / "points").iterdir()
    file.write_text(file.read_text()[:20])
    assert again.find(first) is None


def test_settings_tell_models_apart(ride, exported, tmp_path) -> None:
    """By what is in the files: a model exported again has the same bytes (tests/fmus)."""
    ours = settings_of(*ride, exported)
    assert ours["railcosim"] == version("railcosim")
    same = {name: Path(shutil.copy(path, tmp_path)) for name, path in exported.items()}
    assert settings_of(*ride, same) == ours
    same["Track"].write_bytes(exported["Track"].read_bytes() + b" ")
    assert settings_of(*ride, same) != ours
    there = settings_of(replace(ride[0], position=3.125), ride[1], exported)
    assert there == {**ours, "position": 3.125}


def test_table_and_its_files(tmp_path) -> None:
    """Every run is in its place, what was not run is empty, and the files open."""
    a, b = grid(["jacobi-constant", "jacobi-linear"], [1e-4]).points()
    c = replace(a, step=5e-5)
    rows = [
        (a, replace(FOUND, error=0.02, stopped="")),
        (b, FOUND),
        (c, replace(FOUND, error=0.01)),
    ]
    table = table_of(rows, {"time": 1.0})
    assert table["error"].dims == DIMS
    where = {"scheme": "jacobi-constant", "owner": "track", "contact": "1e9"}
    assert table["error"].sel(where).values.tolist() == [0.01, 0.02]
    assert np.isnan(table["error"].sel(where | {"scheme": "jacobi-linear", "step": 5e-5}))
    assert table["observed_order"].sel(where).item() == pytest.approx(1.0)
    netcdf, text = save_table(table, tmp_path)
    assert load(netcdf)["error"].sel(where).values.tolist() == [0.01, 0.02]
    assert len(text.read_text().splitlines()) == 4


@pytest.mark.parametrize("order", [1, 2, 4])
def test_observed_order(order) -> None:
    """Only what lies between the reference's error and the first coarse guesses counts."""
    step = np.array([1e-6, 1e-5, 2e-5, 4e-5, 8e-5, 1.6e-4])
    error = 1e-3 * (step / 2e-5) ** order
    error[0] = 3e-10  # the reference is not known so well
    error[-1] = np.inf
    table = xr.Dataset(
        {
            "error": (DIMS, error.reshape(1, 1, 1, -1)),
            "reference_error": (DIMS, np.full((1, 1, 1, 6), 1e-9)),
        },
        {"step": step},
    )
    assert observed_order(table).item() == pytest.approx(order)


# --- here, and on a cluster ----------------------------------------------------------------------


def test_here_every_point_is_measured_and_what_fails_is_said_of_its_point(
    ride, contents, forces
) -> None:
    """In processes of their own, as in this one."""
    good, bad = grid(["jacobi-constant"], [1e-4, 2e-4]).points()
    told: list[tuple[float, float]] = []
    results = measured_here(
        studied(ride, contents),
        [good, replace(bad, step=-1.0)],
        lambda *share: told.append(share),
    )
    found = {point.step: result for point, result in results}
    assert isinstance(found[-1.0], ValueError)
    assert told[-1] == (2.0, 2.0)
    here = measure(*ride, good, *(contents[name] for name in FMUS[good.owner]), forces)
    # Other processes place arrays elsewhere, and sums are then rounded otherwise.
    assert found[good.step].error == pytest.approx(here.error, rel=1e-6)


def test_here_what_cannot_be_solved_is_said_of_all_points_that_need_it(ride, contents) -> None:
    points = grid(["jacobi-constant"], [1e-4, 2e-4]).points()
    broken = {**contents, "Vehicle": b"no FMU"}
    found = list(measured_here(studied(ride, broken), points, lambda done, total: None))
    assert [point for point, _ in found] == points
    assert all("not a readable zip archive" in str(result) for _, result in found)


@pytest.fixture
def cluster():
    """Two worker processes that know nothing of this one but an address."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        silence_logs="CRITICAL",
    ) as cluster:  # fmt: skip
        yield cluster


def test_a_killed_worker_loses_nothing(ride, contents, forces, cluster) -> None:
    """SIGKILL to a worker that is at work: every point comes home, and as without it."""
    names = ["jacobi-constant", "jacobi-linear", "gauss-seidel-linear-vehicle-first"]
    points = grid(names, [2e-5, 1e-5]).points()  # long enough to be met at work
    killed, found = [], []
    with connect(cluster.scheduler_address) as client:
        before = client.run(os.getpid)

        def kill(done: float, total: float) -> None:
            for worker, tasks in client.processing().items():
                if not killed and any("measure" in str(task) for task in tasks):
                    killed.append(before[worker])
                    os.kill(before[worker], signal.SIGKILL)

        for point, result in measured(client, studied(ride, contents), points, kill):
            assert isinstance(result, Measurement), result
            found.append((point, result))
        client.wait_for_workers(2, timeout=300)
        assert killed[0] not in client.run(os.getpid).values()
    assert sorted(str(p) for p, _ in found) == sorted(str(p) for p in points)
    point, result = found[-1]
    here = measure(*ride, point, *(contents[name] for name in FMUS[point.owner]), forces)
    # Other processes place arrays elsewhere, and sums are then rounded otherwise.
    assert here.error == pytest.approx(result.error, rel=1e-6)


def test_what_fails_on_a_worker_is_said_of_its_point(ride, contents, cluster) -> None:
    """A point that cannot be run does not stop the others."""
    good, bad = grid(["jacobi-constant"], [1e-4, 2e-4]).points()
    broken = replace(bad, step=-1.0)
    with connect(cluster.scheduler_address) as client:
        results = measured(
            client, studied(ride, contents), [good, broken], lambda done, total: None
        )
        found = {point.step: result for point, result in results}
    assert isinstance(found[good.step], Measurement)
    assert isinstance(found[-1.0], ValueError)


def test_nobody_at_the_address(monkeypatch) -> None:
    """One sentence, with what to do."""
    monkeypatch.setattr(
        "railcosim.analysis.schemes.cluster.PATIENCE", 0.5
    )  # s; nobody will ever answer
    with (
        pytest.raises(ClusterError, match="start one with: dask scheduler"),
        connect("tcp://127.0.0.1:9"),
    ):
        pass
