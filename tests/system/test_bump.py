"""A bump at a known place: which wheelset it meets when, in time, in frequency and in ride."""

import numpy as np
import pytest

from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.response.frequency import coupled, response
from railcosim.analysis.response.ride import densities
from railcosim.master.course import Course
from railcosim.master.schemes.jacobi import jacobi
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.track.irregularity import QUALITIES, Profile

FORCES = Layout().names(FORCE)

pytestmark = pytest.mark.slow  # a run in time and a frequency response on the same dip

SPEED = 130.0  # m/s, so that a short run sees all wheelsets over it
K_H, STEP, STOP = 1e9, 1e-4, 0.2
AT, WIDTH, DEPTH = 4.0, 0.4, 1e-4  # m, of a Gaussian
FRONT, REAR = "bogie[1].az", "bogie[2].az"


@pytest.fixture(scope="module")
def run(exported):
    """Wheels held, 1 GN/m in the track."""
    x = np.linspace(0.0, SPEED * STOP, 3000)
    z = DEPTH * np.exp(-(((x - AT) / WIDTH) ** 2) / 2)
    profile = Profile(name="dip", x=x, left=z, right=z)
    dataset, stopped = run_pair(
        exported.folder / "Vehicle.fmu", exported.folder / "TrackWithContact.fmu",
        {"contact.nonlinear": False, "contact.stiffness": K_H},
        Journey(speed=SPEED, held=True, profile=profile),
        Course(scheme=jacobi(degree=2), step=STEP, stop=STOP),
        lambda done, total: None,
    )  # fmt: skip
    assert stopped is None
    return dataset


def test_the_first_wheelset_is_hit_first(run, models) -> None:
    """The last one feels little when the dip is under the first one, and much when it is there."""
    first, last = (
        np.abs(
            run[f"wheelset[{i}].left.force_z"].values - float(run[f"wheelset[{i}].left.force_z"][0])
        )
        for i in (1, 4)
    )
    place = SPEED * run["time"].values
    under_first = np.abs(place - AT) < 2 * WIDTH
    under_last = np.abs(place - AT - (models.positions[0] - models.positions[3])) < 2 * WIDTH
    assert last[under_first].max() < 0.1 * first[under_first].max()
    assert last[under_last].max() > 0.5 * first[under_first].max()


def test_frequency_response_has_the_lags_of_the_run(run, models) -> None:
    """Contact forces and bogies of the run from the response to irregularity, by Fourier series."""
    period, highest = 4.0, 300.0  # s, of the series; Hz: the dip has nothing above
    frequency = np.arange(1, round(period * highest)) / period
    omega = 2 * np.pi * frequency
    # Of a Gaussian in time around t_0, by hand: d T sqrt(2 pi) exp(-(omega T)^2 / 2 - i omega t_0).
    T, t_0 = WIDTH / SPEED, AT / SPEED
    spectrum = DEPTH * T * np.sqrt(2 * np.pi) * np.exp(-((omega * T) ** 2) / 2 - 1j * omega * t_0)
    spectrum *= 2 / period
    system = coupled(models, omega, K_H)
    values = response(system, "irregularity_z", models.positions, SPEED)
    points = slice(None, None, 20)
    waves = np.exp(1j * np.outer(run["time"].values[points], omega))

    def predicted(output, power=0):
        column = values[:, system.rows([output])[0]]
        return (waves @ (spectrum * column * (1j * omega) ** power)).real

    for name in FORCES:
        ours = run[name].values[points] - float(run[name][0])
        theirs = predicted(name)
        # The scheme errs by 1e-4, the series by the car body's mean: what it leaves out at 0 Hz.
        assert np.sqrt(np.mean((ours - theirs) ** 2)) < 0.01 * ours.std(), name
    for name in (FRONT, REAR):
        ours, theirs = (
            run[name].values[points],
            predicted(f"vehicle.{name.removesuffix('.az')}.z", 2),
        )
        assert np.sqrt(np.mean((ours - theirs) ** 2)) < 0.01 * ours.std(), name


def test_ride_is_the_response_squared_and_knows_front_from_rear(models) -> None:
    frequency = np.geomspace(1.0, 50.0, 60)
    omega, quality = 2 * np.pi * frequency, QUALITIES["german-low"]
    found = densities(models, frequency, K_H, SPEED, quality)
    system = coupled(models, omega, K_H)
    values = response(system, "irregularity_z", models.positions, SPEED)
    S = quality.vertical.density(omega / SPEED) * 2 * np.pi / SPEED
    for name in (FRONT, REAR):
        row = system.rows([f"vehicle.{name.removesuffix('.az')}.z"])[0]
        assert found[name].values == pytest.approx(np.abs(omega**2 * values[:, row]) ** 2 * S)
    ratio = found[FRONT] / found[REAR]
    assert float(np.abs(np.log(ratio)).max()) > 0.1  # exchanged, they would not be the same
