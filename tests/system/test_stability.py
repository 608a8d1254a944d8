"""Predicted largest stable steps and errors against runs of the FMUs; a ring of six cells."""

import math

import numpy as np
import pytest

from railcosim.analysis.pair.linear_pair import linear_parts
from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.analysis.pair.static_load import static_stiffness
from railcosim.analysis.response.models import wheelset_positions
from railcosim.analysis.schemes.advised import STEPS, longest_step
from railcosim.analysis.schemes.catalogue import members
from railcosim.analysis.schemes.disturbed import Disturbance
from railcosim.analysis.schemes.exponentials import fastest
from railcosim.analysis.schemes.force_error import ForceError, excitation
from railcosim.analysis.schemes.growth import Bench
from railcosim.analysis.schemes.motion import fastest_motion
from railcosim.analysis.schemes.run_limit import limit_in_runs
from railcosim.analysis.schemes.stability import FAST, RATE, Coupling, SprungPair
from railcosim.master.cosimulation import cosimulate
from railcosim.master.linear.model_exchange import linear_model
from railcosim.master.linear.receptance import frequency_response
from railcosim.mechanics.ports import Layout
from railcosim.track.irregularity import QUALITIES, synthesise

WHEELS = Layout().wheels

pytestmark = (
    pytest.mark.slow
)  # limits searched, and runs of thousands of steps to hold them against

SPEED = 250 / 3.6  # m/s
LINEAR = {"contact.nonlinear": False, "contact.stiffness": 1e9}
HERTZ = {"contact.nonlinear": True}
INTERNAL = {"internal_step": 2e-5}  # s: the owner of the contact nearly integrates it exactly


@pytest.fixture(scope="module")
def parts(exported):
    folder = exported.folder
    return linear_parts(folder / "Vehicle.fmu", folder / "Track.fmu", lambda done, total: None)


def files(exported, owner):
    return [exported.folder / f"{name}.fmu" for name in FMUS[owner]]


def stiffness(exported, parameters):
    if not parameters["contact.nonlinear"]:
        return parameters["contact.stiffness"]
    return static_stiffness(*files(exported, Owner.MASTER), parameters)


def test_left_and_right_are_two_problems(parts) -> None:
    assert [part.name for part in parts] == ["both wheels alike", "wheels against each other"]
    # Wheels of one wheelset cannot move against each other, the rails can.
    omega = np.array([100.0])
    assert not parts[1].vehicle.frequency_response(omega).any()
    assert np.abs(parts[1].track.response(1j * omega)).max() > 1e-9


def test_fewer_modes_answer_as_the_track_does(exported, parts) -> None:
    """Limits are promised to 1 %, and move by about as much as what the wheels feel.

    That is the response of the FMU's matrices to a tenth of it, at any frequency.
    """
    omega = 2 * np.pi * np.geomspace(5.0, 1e4, 500)
    model = linear_model(exported.folder / "Track.fmu", name="track")
    track = frequency_response(model, omega)
    forces, rails = ([f"{w}.{what}" for w in WHEELS] for what in ("force_z", "rail_z"))
    G = track.values[:, track.rows(rails[:4])][:, :, track.columns(forces)]
    for part, sign in zip(parts, (1, -1), strict=True):
        whole = G[:, :, :4] + sign * G[:, :, 4:]
        assert len(part.track.poles) < model.A.shape[0]
        error = np.abs(part.track.response(1j * omega) - whole).max(axis=(1, 2))
        assert (error / np.abs(whole).max(axis=(1, 2))).max() < 1e-3  # found 3e-4


@pytest.mark.parametrize(
    ("owner", "name", "parameters"),
    [
        (Owner.VEHICLE, "jacobi-linear", LINEAR),
        (Owner.TRACK, "jacobi-quadratic", LINEAR),
        (Owner.MASTER, "gauss-seidel-linear-track-first", LINEAR),
        (Owner.MASTER, "picard-constant", LINEAR),  # where it no longer converges
        (Owner.VEHICLE, "picard-linear", LINEAR),  # one after the other
        (Owner.VEHICLE, "jacobi-quadratic", HERTZ),
        (Owner.MASTER, "jacobi-quadratic", HERTZ),
    ],
)
def test_predicted_limit_is_that_of_runs(exported, parts, owner, name, parameters):
    springs = SprungPair(parts, owner, stiffness(exported, parameters))
    assert springs.exact == 0.0  # coupled exactly, nothing grows
    scheme = members()[name].scheme
    coupling = Coupling(springs, scheme)
    predicted = next(w for w in coupling.limit(longest=2e-3).windows if math.isfinite(w.fast))
    disturbance = Disturbance()
    journey = Journey(speed=SPEED, held=True, profile=disturbance)
    with open_pair(*files(exported, owner), {**parameters, **INTERNAL}, journey) as pair:
        found = limit_in_runs(Bench(pair, disturbance), scheme, coupling, predicted)
    assert found.step == pytest.approx(predicted.fast, rel=0.01)  # what is promised
    # Of what is driven at the limit or near it; more would be another motion.
    slack = 0.1 if found.predicted > 0.0 else 0.0  # 1/s; below 0 a logarithm of convergence
    assert found.measured == pytest.approx(found.predicted, rel=0.05, abs=slack)


def test_the_fastest_of_few_motions_is_told() -> None:
    """Also if another is a hundred times stronger, and of the same frequency."""
    n = np.arange(40)[:, None]
    slow, fast = np.exp((-0.02 + 0.3j) * n), np.exp((0.01 + 0.3j) * n)
    series = slow * [10.0, 3.0j] + fast * [0.1, 0.2]
    assert fastest(series) == pytest.approx(0.01, abs=1e-9)
    assert fastest(slow * [10.0, 3.0j]) == pytest.approx(-0.02, abs=1e-9)


def test_a_window_below_longer_stable_steps_is_found_and_runs_grow_in_it(exported, parts) -> None:
    k_H, scheme = 8e9, members()["interface-jacobian-radau-2"].scheme
    coupling = Coupling(SprungPair(parts, Owner.MASTER, k_H), scheme)
    (window,) = coupling.limit(longest=2.8e-4).windows  # s
    # Growth is fast at once: within what an edge is known to.
    assert window.begin <= window.fast < 1.001 * window.begin
    assert window.end < 1.03 * window.begin  # steps a few per cent apart would jump over it
    inside, outside = 0.5 * (window.begin + window.end), 1.01 * window.end
    disturbance = Disturbance()
    journey = Journey(speed=SPEED, held=True, profile=disturbance)
    parameters = {"contact.nonlinear": False, "contact.stiffness": k_H}
    with open_pair(*files(exported, Owner.MASTER), parameters, journey) as pair:
        bench = Bench(pair, disturbance)
        grown = bench.growth(scheme, inside, fastest_motion(coupling, inside))
        # Its own mirror image is driven with it, and of nearly the same frequency.
        assert grown == pytest.approx(coupling.growth(inside), rel=0.05)
        assert bench.kicked(scheme, outside) < 0.0
    assert coupling.growth(outside) < 0.0


def test_slow_growth_is_growth(parts) -> None:
    """A scheme drives the least damped mode of the track a little, long before anything is seen."""
    coupling = Coupling(SprungPair(parts, Owner.VEHICLE, 1e9), members()["jacobi-linear"].scheme)
    h = 4.5e-5  # s
    assert RATE < coupling.growth(h) < FAST
    assert not coupling.is_stable(h)
    assert coupling.is_stable(h / 2)


def test_law_solved_in_the_master_is_stable_at_every_step_that_is_used(parts) -> None:
    scheme = members()["interface-jacobian"].scheme
    limit = Coupling(SprungPair(parts, Owner.MASTER, 1e9), scheme).limit(longest=1e-3)
    assert math.isinf(limit.step)
    assert limit.evaluations == 2


def test_iterations_that_take_too_long_end_what_is_stable(parts) -> None:
    """With all that they agree on at the end of a step, nothing would grow at any."""
    coupling = Coupling(SprungPair(parts, Owner.MASTER, 1e9), members()["picard-constant"].scheme)
    (window,) = coupling.limit(longest=2e-3).windows
    assert math.isinf(window.end)
    assert coupling.contracts(window.begin) == pytest.approx(coupling.contraction, rel=0.01)
    assert coupling.contraction**49 == pytest.approx(1e-9)


@pytest.mark.parametrize(
    ("owner", "name"), [(Owner.TRACK, "jacobi-quadratic"), (Owner.MASTER, "interface-jacobian")]
)
def test_predicted_error_is_that_of_a_run(exported, parts, owner, name) -> None:
    k_H, accuracy, duration = LINEAR["contact.stiffness"], 3e-3, 0.5
    source = excitation(
        QUALITIES["german-low"].vertical, SPEED, wheelset_positions(exported.folder / "Vehicle.fmu")
    )
    scheme = members()[name].scheme
    coupling = Coupling(SprungPair(parts, owner, k_H), scheme)
    option = longest_step(name, owner, coupling, accuracy, ForceError(parts, k_H, source))
    assert option.error <= accuracy < option.errors[np.searchsorted(STEPS, 1.1 * option.step)]

    def run(owner, scheme, step):
        profile = synthesise("german-low", SPEED * duration)
        journey = Journey(speed=SPEED, held=True, profile=profile)
        with open_pair(*files(exported, owner), {**LINEAR, **INTERNAL}, journey) as pair:
            where = [i for i, n in enumerate(pair.system.names) if n.endswith(".force_z")]
            points = cosimulate(pair.system, scheme, step, duration)
            return np.array([point.outputs[where] for point in points])

    # Of fourth order: with half the step its own error is a thousandth of the one to be seen.
    exact = run(Owner.MASTER, members()["interface-jacobian-conserving-4"].scheme, option.step / 2)
    error = run(owner, scheme, option.step) - exact[::2]
    begun = len(error) // 3  # the irregularity fades in over 10 m
    measured = np.sqrt((error[begun:] ** 2).mean() / ((exact[::2] - exact[0])[begun:] ** 2).mean())
    # Half a second is one draw of a random process, dominated by two or three resonances.
    assert measured == pytest.approx(option.error, rel=0.35)


@pytest.mark.parametrize(("owner", "step"), [(Owner.TRACK, 1e-4), (Owner.VEHICLE, 5e-6)])
def test_nothing_grows_inside_the_owner_of_a_stiff_contact(exported, owner, step) -> None:
    """With an internal step of 0.1 ms and 8 GN/m, wheels kicked against each other come to rest.

    With forces along a line over it, those of the track would grow by 260/s.
    """
    disturbance = Disturbance()
    journey = Journey(speed=50.0, held=True, profile=disturbance)
    stiff = {"contact.nonlinear": False, "contact.stiffness": 8e9, "internal_step": 1e-4}
    with open_pair(*files(exported, owner), stiff, journey) as pair:
        scheme = members()["gauss-seidel-linear-vehicle-first"].scheme
        assert Bench(pair, disturbance).kicked(scheme, step) < 0.0
