"""Track.fmu by plain calls, and what both vehicles of exudyn on it are run and shown with."""

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import fmpy
import numpy as np
import xarray as xr
from fmpy.fmi2 import FMU2Slave

from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.cli.progress import progress
from railcosim.fmus.export import export
from railcosim.master.course import Course
from railcosim.master.schemes.jacobi import jacobi
from railcosim.mechanics.ports import Layout
from railcosim.plots.chart import Chart, Curve, Panel
from railcosim.plots.picture import save_picture
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

WHEELS = Layout().wheels
WHEELSETS = Layout().axles


class TrackFmu:
    """Track.fmu by plain FMI 2.0 Co-Simulation.

    Forces and motions are those of these names at all wheels, wheel by wheel.
    """

    def __init__(
        self,
        path: Path,
        unpacked: str,
        speed: float,
        given: Sequence[str],
        answers: Sequence[str],
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


@dataclass(frozen=True)
class Times:
    """Step, end and interval of samples, a multiple of the step; s."""

    step: float
    stop: float
    sample: float

    @property
    def every(self) -> int:
        """Of how many steps one is a sample."""
        return round(self.sample / self.step)


def masters_run(
    fmus: Path, journey: Journey, times: Times, parameters: Mapping[str, float]
) -> xr.Dataset:
    """Our vehicle on a track that owns the contact, coupled by our master."""
    course = Course(scheme=jacobi(degree=1), step=times.step, stop=times.stop)
    with progress(f"railcosim, {1e3 * times.step:g} ms") as update:
        run, stopped = run_pair(
            fmus / "Vehicle.fmu", fmus / "TrackWithContact.fmu",
            {**parameters, "internal_step": times.step}, journey, course, update,
        )  # fmt: skip
    if stopped is not None:
        raise stopped
    return run


def print_row(name: str, width: int, found: Sequence[tuple[float, float]]) -> None:
    """A line of a table: RMS and largest difference of each quantity, in percent."""
    print(f"{name:{width}}" + "".join(f"{f'{rms:.3f} {most:7.3f}':>18}" for rms, most in found))


def save_comparison(
    title: str, t: np.ndarray, shown: Mapping[str, tuple[np.ndarray, np.ndarray]], path: Path
) -> None:
    """Draw ours and theirs of each quantity, by its label."""
    rows = tuple(
        (
            Panel(
                x_label="time (s)", y_label=label, x_range=(0.0, t[-1]),
                curves=(
                    Curve(name="railcosim", x=t, y=ours),
                    Curve(name="exudyn", x=t, y=theirs, dashed=True),
                ),
            ),
        )
        for label, (ours, theirs) in shown.items()
    )  # fmt: skip
    save_picture(Chart(title=title, rows=rows, share_x=True), path)


def run_example(
    compare: Callable[[Path, float, Path], None],
    about: str, picture: str, shortest: float, dimension: str,
) -> None:  # fmt: skip
    """Read the command line, make FMUs if none are given, and compare."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("picture", nargs="?", type=Path, default=Path(picture))
    parser.add_argument("--fmus", type=Path, help="folder of exported FMUs; made if not given")
    parser.add_argument("--time", type=float, default=1.0, help="how long, s")
    options = parser.parse_args()
    if not shortest <= options.time < np.inf:
        parser.error(f"--time {options.time:g}: must be at least {shortest:g} s")
    with TemporaryDirectory() as made:
        if options.fmus is None:
            options.fmus = Path(made)
            export(Vehicle(), Track(), options.fmus, dimension=dimension)
        for name in ("Track", "Vehicle", "TrackWithContact"):
            if not (options.fmus / f"{name}.fmu").is_file():
                sys.exit(
                    f"{options.fmus / name}.fmu: no such file; make it by: railcosim export "
                    f"--dimension {dimension} --out {options.fmus}"
                )
        compare(options.fmus, options.time, options.picture)
