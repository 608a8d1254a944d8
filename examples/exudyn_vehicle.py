"""Track.fmu under the vehicle of another tool: exudyn, a multibody code, with its own contact.

The vehicle (`exudyn_model.py`) has the numbers of our vehicle and nothing else of ours. Track.fmu
is driven by plain FMI 2.0 calls. What both vehicles do at 250 km/h over the same irregularity is
compared, with two steps each, so that one sees what the steps leave. Takes a minute or two.

    pip install exudyn
    python examples/exudyn_vehicle.py [PICTURE] [--fmus FOLDER] [--time SECONDS]
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.cli.options import progress
from railcosim.fmus.content import contact_defaults
from railcosim.fmus.export import export
from railcosim.master.course import Course
from railcosim.master.schemes.jacobi import jacobi
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.plots.chart import Chart, Curve, Panel
from railcosim.plots.picture import save_picture
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

FORCES = Layout().names(FORCE)
WHEELS = Layout().wheels
WHEELSETS = Layout().axles

try:
    from exudyn_model import ExudynVehicle
except ModuleNotFoundError as missing:
    sys.exit(f"{missing}; exudyn is a multibody code: pip install exudyn")

SPEED = 250 / 3.6  # m/s
OUR_STEPS = (5e-5, 2.5e-5)  # s, of Vehicle.fmu and TrackWithContact.fmu
SAMPLE = 1e-4  # s, when the vehicles are compared
PROBE = 1e3  # N, of a trial step; the track is linear, so any will do
QUANTITIES = {  # columns of the samples
    "contact forces": slice(0, 8),
    "acceleration": [8],  # of the car body, as the next two
    "displacement": [9],
    "pitch": [10],
}

Heights = Callable[[float], np.ndarray]  # of the rails' surface at a time, m, down


class TrackFmu:
    """Track.fmu by plain FMI 2.0 Co-Simulation.

    Forces and motions are those of these names at all wheels, wheel by wheel.
    """

    def __init__(
        self,
        path: Path,
        unpacked: str,
        given: tuple[str, ...] = ("force_z",),
        answers: tuple[str, ...] = ("rail_z",),
        speed: float = SPEED,
    ) -> None:
        self.speed = speed
        about = fmpy.read_model_description(str(path))
        fmpy.extract(str(path), unpacked)
        variables = {v.name: v for v in about.modelVariables}
        places = [variables[f"{w}.position"] for w in WHEELSETS]
        self.start = np.array([float(v.start) for v in places])  # m
        self.u = [v.valueReference for v in places]
        self.u += [variables[f"{w}.{name}"].valueReference for w in WHEELS for name in given]
        self.y = [variables[f"{w}.{name}"].valueReference for w in WHEELS for name in answers]
        self.input_hold = variables["input_hold"].valueReference
        self.fmu = FMU2Slave(
            guid=about.guid,
            unzipDirectory=unpacked,
            modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName="track",
        )
        self.fmu.instantiate()

    def settle(self, force: np.ndarray) -> np.ndarray:
        """Rest under static forces; returns the rail's answers, as `step` does."""
        self.fmu.reset()  # so that it can come to rest more than once
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.setReal(self.u, [*self.start, *force])
        self.fmu.exitInitializationMode()
        return self.answers()

    def answers(self) -> np.ndarray:
        """The rail's motions under the wheels: as they are called, m and down."""
        return np.array(self.fmu.getReal(self.y))

    def step(self, t: float, h: float, inputs_at: float, force: np.ndarray) -> np.ndarray:
        """From t to t + h, with the inputs of one instant; returns the answers at t + h."""
        self.fmu.setReal(self.u, [*(self.start + self.speed * inputs_at), *force])
        self.fmu.doStep(currentCommunicationPoint=t, communicationStepSize=h)
        return self.answers()

    def hold(self, how: int) -> None:
        """Say how inputs go over a step."""
        self.fmu.setInteger([self.input_hold], [how])

    def close(self) -> None:
        """End the FMU."""
        self.fmu.terminate()
        self.fmu.freeInstance()


class Explicit:
    """The track steps first, with forces that go on along their last two values.

    Then the vehicle steps onto the rail's new place.
    """

    input_hold = 1  # inputs go on from those set, which are of the step's beginning

    def __init__(self, track: TrackFmu, vehicle: ExudynVehicle, irregularity: Heights) -> None:
        self.track, self.vehicle, self.irregularity = track, vehicle, irregularity
        track.hold(self.input_hold)

    def before(self, t: float, h: float) -> None:
        """Find the rail's place at t, the END of the step."""
        rail_z = self.track.step(t - h, h, t - h, self.vehicle.forces())
        self.vehicle.put_rails(rail_z + self.irregularity(t), np.zeros(8))

    def after(self, t: float, h: float) -> None:
        """Nothing is left to do."""


class Implicit(Explicit):
    """The vehicle steps onto a rail that gives way; then the track steps under the forces found.

    Over a step, the rail's place at its end is linear in the forces at its end. Two trial steps
    from a saved state tell how. In so short a time a force reaches no other wheel.
    """

    input_hold = 2  # inputs go along the line to those set, which are of the step's end

    def before(self, t: float, h: float) -> None:
        """Find the rail's place at t without forces, and how far it gives way to them."""
        fmu, force = self.track.fmu, self.vehicle.forces()
        state = fmu.getFMUState()
        loaded_z = self.track.step(t - h, h, t, force)
        fmu.setFMUState(state)
        gives = (self.track.step(t - h, h, t, force + PROBE) - loaded_z) / PROBE
        fmu.setFMUState(state)
        fmu.freeFMUState(state)
        self.vehicle.put_rails(loaded_z - gives * force + self.irregularity(t), gives)

    def after(self, t: float, h: float) -> None:
        """Step the track under the forces at t."""
        self.track.step(t - h, h, t, self.vehicle.forces())


@dataclass(frozen=True)
class Times:
    """Step, end and interval of samples, a multiple of the step; s."""

    step: float
    stop: float
    sample: float = SAMPLE

    @property
    def every(self) -> int:
        """Of how many steps one is a sample."""
        return round(self.sample / self.step)


def exudyn_run(
    path: Path, p: Vehicle, journey: Journey, coupling: type[Explicit], times: Times
) -> np.ndarray:
    """Roll exudyn's vehicle over Track.fmu; returns samples, shape (n, 11)."""
    step, stop = times.step, times.stop
    with TemporaryDirectory() as unpacked, progress(f"exudyn, {1e3 * step:g} ms") as update:
        track, vehicle = TrackFmu(path, unpacked), ExudynVehicle(p, contact_defaults(p).C[0])
        irregularity = journey.profile.under(track.start, SPEED)
        rail_z = track.settle(np.full(8, p.wheel_load))
        vehicle.put_rails(rail_z + irregularity(0.0), np.zeros(8))
        vehicle.settle()
        z_0, samples = vehicle.carbody()[1], []
        coupled = coupling(track, vehicle, irregularity)

        def after(t: float) -> None:
            if t > 0:  # exudyn also calls it at the start
                coupled.after(t, step)
            if round(t / step) % times.every == 0:
                acceleration, z, pitch = vehicle.carbody()
                samples.append([*vehicle.forces(), acceleration, z - z_0, pitch])
                update(t, stop)

        vehicle.roll(step, stop, lambda t: coupled.before(t, step), after)
        track.close()
    return np.array(samples)


def our_run(fmus: Path, journey: Journey, times: Times) -> np.ndarray:
    """Our vehicle on a track that owns the contact, coupled by our master."""
    parameters = {"contact.nonlinear": True, "internal_step": times.step}
    course = Course(scheme=jacobi(degree=1), step=times.step, stop=times.stop)
    with progress(f"railcosim, {1e3 * times.step:g} ms") as update:
        run, stopped = run_pair(
            fmus / "Vehicle.fmu", fmus / "TrackWithContact.fmu", parameters, journey, course, update
        )
    if stopped is not None:
        raise stopped
    z = run["carbody.z"] - run["carbody.z"][0]
    columns = [*(run[f] for f in FORCES), run["carbody.az"], z, run["carbody.pitch"]]
    return np.stack(columns, axis=1)[:: times.every]


def differences(theirs: np.ndarray, ours: np.ndarray, p: Vehicle) -> dict[str, list[float]]:
    """RMS and largest difference of each quantity over those of its dynamic part, in percent."""
    at_rest = np.array([p.wheel_load] * 8 + [0.0] * 3)
    found = {}
    for quantity, columns in QUANTITIES.items():
        error, dynamic = (theirs - ours)[:, columns], (ours - at_rest)[:, columns]
        rms = np.sqrt(np.mean(error**2) / np.mean(dynamic**2))
        largest = np.abs(error).max() / np.abs(dynamic).max()
        found[quantity] = [100 * float(rms), 100 * float(largest)]
    return found


def print_row(name: str, found: dict[str, list[float]]) -> None:
    """A line of the table."""
    cells = (f"{rms:.3f} {largest:7.3f}" for rms, largest in found.values())
    print(f"{name:26}" + "".join(f"{cell:>16}" for cell in cells))


def save_comparison(theirs: np.ndarray, ours: np.ndarray, path: Path) -> None:
    """Draw the contact force of a wheel and the car body's acceleration, of both vehicles."""
    t = SAMPLE * np.arange(len(ours))

    def row(label: str, ours: np.ndarray, theirs: np.ndarray) -> tuple[Panel]:
        curves = (
            Curve(name="railcosim", x=t, y=ours),
            Curve(name="exudyn", x=t, y=theirs, dashed=True),
        )
        return (Panel(x_label="time (s)", y_label=label, curves=curves, x_range=(0.0, t[-1])),)

    rows = (
        row("contact force, wheelset 1, left (kN)", 1e-3 * ours[:, 0], 1e-3 * theirs[:, 0]),
        row("car body acceleration, down (m/s²)", ours[:, 8], theirs[:, 8]),
    )
    title = "Vehicles of railcosim and exudyn on the same track, 250 km/h, german-low"
    save_picture(Chart(title=title, rows=rows, share_x=True), path)


def compare(fmus: Path, stop: float, picture: Path) -> None:
    """Run both vehicles, print how far they are apart and draw them."""
    for name in ("Track", "Vehicle", "TrackWithContact"):
        if not (fmus / f"{name}.fmu").is_file():
            sys.exit(f"{fmus / name}.fmu: no such file; make it by: railcosim export --out {fmus}")
    p, profile = Vehicle(), synthesise("german-low", SPEED * stop)
    journey = Journey(speed=SPEED, held=False, profile=profile)
    coarse, ours = (our_run(fmus, journey, Times(step, stop)) for step in OUR_STEPS)
    print("difference to railcosim with 0.025 ms: RMS and largest, % of the dynamic part")
    print(f"{'':26}" + "".join(f"{quantity:>16}" for quantity in QUANTITIES))
    print_row("railcosim, 0.05 ms", differences(coarse, ours, p))
    for coupling, step in ((Explicit, 1e-5), (Explicit, 5e-6), (Implicit, 1e-4), (Implicit, 5e-5)):
        theirs = exudyn_run(fmus / "Track.fmu", p, journey, coupling, Times(step, stop))
        name = f"exudyn, {coupling.__name__.lower()}, {1e3 * step:g} ms"
        print_row(name, differences(theirs, ours, p))
    save_comparison(theirs, ours, picture)


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("picture", nargs="?", type=Path, default=Path("exudyn.png"))
    parser.add_argument("--fmus", type=Path, help="folder of exported FMUs; made if not given")
    parser.add_argument("--time", type=float, default=1.0, help="how long, s")
    options = parser.parse_args()
    if not SAMPLE <= options.time < np.inf:
        parser.error(f"--time {options.time:g}: must be at least {SAMPLE:g} s")
    with TemporaryDirectory() as made:
        if options.fmus is None:
            options.fmus = Path(made)
            export(Vehicle(), Track(), options.fmus)
        compare(options.fmus, options.time, options.picture)


if __name__ == "__main__":
    main()
