"""Track.fmu under the vehicle of another tool: exudyn, a multibody code, with its own contact.

The vehicle (`exudyn_model.py`) has the numbers of our vehicle and nothing else of ours. Track.fmu
is driven by plain FMI 2.0 calls. What both vehicles do at 250 km/h over the same irregularity is
compared, with two steps each, so that one sees what the steps leave. Takes one to three minutes.

    pip install exudyn
    python examples/exudyn_vehicle.py [PICTURE] [--fmus FOLDER] [--time SECONDS]
"""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

from railcosim.analysis.pair import FADE_IN, FORCES, WHEELS, WHEELSETS, Journey
from railcosim.analysis.time_run import Plan, run_pair
from railcosim.cli.options import progress
from railcosim.fmus.export import contact_defaults, export
from railcosim.master.schemes.jacobi import jacobi
from railcosim.plots.chart import Chart, Curve, Panel
from railcosim.plots.picture import save_picture
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

try:
    from exudyn_model import ExudynVehicle
except ModuleNotFoundError as missing:
    sys.exit(f"{missing}; exudyn is a multibody code: pip install exudyn")

SPEED = 250 / 3.6  # m/s
STEPS = (2e-5, 1e-5)  # s, of exudyn and Track.fmu
OUR_STEPS = (5e-5, 2.5e-5)  # s, of Vehicle.fmu and TrackWithContact.fmu
SAMPLE = 1e-4  # s, a multiple of all of them: when the vehicles are compared
QUANTITIES = {  # columns of the samples
    "contact forces": slice(0, 8),
    "car body acceleration": [8],
    "car body displacement": [9],
    "car body pitch": [10],
}


class TrackFmu:
    """Track.fmu by plain FMI 2.0 Co-Simulation."""

    def __init__(self, path: Path, unpacked: str) -> None:
        about = fmpy.read_model_description(str(path))
        fmpy.extract(str(path), unpacked)
        variables = {v.name: v for v in about.modelVariables}
        places = [variables[f"{w}.position"] for w in WHEELSETS]
        self.start = np.array([float(v.start) for v in places])  # m
        self.u = [v.valueReference for v in places]
        self.u += [variables[f"{w}.force_z"].valueReference for w in WHEELS]
        self.y = [variables[f"{w}.rail_z"].valueReference for w in WHEELS]
        self.input_hold = variables["input_hold"].valueReference
        self.fmu = FMU2Slave(
            guid=about.guid,
            unzipDirectory=unpacked,
            modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName="track",
        )

    def settle(self, force: np.ndarray) -> np.ndarray:
        """Rest under static forces; returns the rail's deflection under the wheels, m, down."""
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.setInteger([self.input_hold], [1])  # inputs go on along their last two values
        self.fmu.setReal(self.u, [*self.start, *force])
        self.fmu.exitInitializationMode()
        return np.array(self.fmu.getReal(self.y))

    def step(self, t: float, h: float, force: np.ndarray) -> np.ndarray:
        """From t to t + h with the forces and positions at t; returns the deflection at t + h."""
        self.fmu.setReal(self.u, [*(self.start + SPEED * t), *force])
        self.fmu.doStep(currentCommunicationPoint=t, communicationStepSize=h)
        return np.array(self.fmu.getReal(self.y))

    def close(self) -> None:
        """End the FMU."""
        self.fmu.terminate()
        self.fmu.freeInstance()


def exudyn_run(path: Path, p: Vehicle, journey: Journey, step: float, stop: float) -> np.ndarray:
    """Run exudyn on Track.fmu: the track steps first, and the vehicle onto the rail's new place."""
    with TemporaryDirectory() as unpacked, progress(f"exudyn, {1e3 * step:g} ms") as update:
        track, vehicle = TrackFmu(path, unpacked), ExudynVehicle(p, contact_defaults(p).C)
        irregularity = journey.profile.under(track.start, SPEED, FADE_IN)
        vehicle.put_rails(track.settle(np.full(8, p.wheel_load)) + irregularity(0.0))
        vehicle.settle()
        z_0, samples = vehicle.carbody()[1], []

        def before(t: float) -> None:  # t: the END of the step
            rail_z = track.step(t - step, step, vehicle.forces())
            vehicle.put_rails(rail_z + irregularity(t))

        def after(t: float) -> None:
            if round(t / step) % round(SAMPLE / step) == 0:
                acceleration, z, pitch = vehicle.carbody()
                samples.append([*vehicle.forces(), acceleration, z - z_0, pitch])
                update(t, stop)

        vehicle.roll(step, stop, before, after)
        track.close()
    return np.array(samples)


def our_run(fmus: Path, journey: Journey, step: float, stop: float) -> np.ndarray:
    """Our vehicle on a track that owns the contact, coupled by our master."""
    plan = Plan(
        vehicle=fmus / "Vehicle.fmu",
        track=fmus / "TrackWithContact.fmu",
        parameters={"contact.nonlinear": True, "internal_step": step},
        journey=journey,
        scheme=jacobi(extrapolation=1),
        step=step,
        stop=stop,
    )
    with progress(f"railcosim, {1e3 * step:g} ms") as update:
        run, stopped = run_pair(plan, update)
    if stopped is not None:
        raise stopped
    z = run["carbody.z"] - run["carbody.z"][0]
    columns = [*(run[f] for f in FORCES), run["carbody.az"], z, run["carbody.pitch"]]
    every = round(SAMPLE / step)
    return np.stack(columns, axis=1)[::every]


def print_differences(name: str, theirs: np.ndarray, ours: np.ndarray, wheel_load: float) -> None:
    """Of each quantity: RMS and largest difference over those of its dynamic part, in percent."""
    at_rest = np.array([wheel_load] * 8 + [0.0] * 3)
    for quantity, columns in QUANTITIES.items():
        error, dynamic = (theirs - ours)[:, columns], (ours - at_rest)[:, columns]
        rms = np.sqrt(np.mean(error**2) / np.mean(dynamic**2))
        largest = np.abs(error).max() / np.abs(dynamic).max()
        print(f"{name:22} {quantity:22} {100 * rms:8.3f} {100 * largest:8.3f}")


def save_comparison(theirs: np.ndarray, ours: np.ndarray, path: Path) -> None:
    """Draw the contact force of a wheel and the car body's acceleration, of both vehicles."""
    t = SAMPLE * np.arange(len(ours))
    rows = []
    for label, column, factor in (
        ("contact force, wheelset 1, left (kN)", 0, 1e-3),
        ("car body acceleration, down (m/s²)", 8, 1.0),
    ):
        curves = (
            Curve(name="railcosim", x=t, y=factor * ours[:, column]),
            Curve(name="exudyn", x=t, y=factor * theirs[:, column], dashed=True),
        )
        span = (0.0, float(t[-1]))
        rows.append((Panel(x_label="time (s)", y_label=label, curves=curves, x_range=span),))
    title = "Vehicles of railcosim and exudyn on the same track, 250 km/h, german-low"
    save_picture(Chart(title=title, rows=tuple(rows), share_x=True), path)


def compare(fmus: Path, stop: float, picture: Path) -> None:
    """Run both vehicles, print how far they are apart and draw them."""
    for name in ("Track", "Vehicle", "TrackWithContact"):
        if not (fmus / f"{name}.fmu").is_file():
            sys.exit(f"{fmus / name}.fmu: no such file; make it by: railcosim export --out {fmus}")
    p, profile = Vehicle(), synthesise("german-low", SPEED * stop + FADE_IN)
    journey = Journey(speed=SPEED, held=False, profile=profile)
    coarse, ours = (our_run(fmus, journey, step, stop) for step in OUR_STEPS)
    print("difference to railcosim with 0.025 ms, % of the dynamic part:  RMS  largest")
    print_differences("railcosim, 0.05 ms", coarse, ours, p.wheel_load)
    for step in STEPS:
        theirs = exudyn_run(fmus / "Track.fmu", p, journey, step, stop)
        print_differences(f"exudyn, {1e3 * step:g} ms", theirs, ours, p.wheel_load)
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
