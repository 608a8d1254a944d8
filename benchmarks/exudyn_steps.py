"""How long may steps be with Track.fmu in another tool? Error of the contact forces, as a table.

The vehicle of `examples/exudyn_vehicle.py`, at 250 km/h over german-low for 1 s, coupled in four
ways with steps of several lengths; and our vehicle on TrackWithContact.fmu. The reference is this
last pair with steps of 0.01 ms. A coupling hammers where contacts open. Takes two or three minutes.

    pip install exudyn
    OPENBLAS_NUM_THREADS=1 python benchmarks/exudyn_steps.py [FOLDER_WITH_FMUS]
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from math import lcm
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

from railcosim.analysis.pair.pair import Journey
from railcosim.fmus.export import export
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from exudyn_track import Times
from exudyn_vehicle import SPEED, Explicit, Implicit, differences, exudyn_run, our_run

STOP = 1.0  # s
SAMPLE = 1e-4  # s; where a step does not fit into it, the next multiple in which it does
FINEST = 1e-5  # s, of the reference; half of it moves forces by 0.01 %


class VehicleFirst(Implicit):
    """The vehicle steps onto a rail that goes on along its last two places; then the track."""

    before_last: np.ndarray | None = None

    def before(self, t: float, h: float) -> None:
        """Extrapolate the rail's place to t, the END of the step."""
        last = self.track.answers()
        moved = 0.0 if self.before_last is None else last - self.before_last
        self.vehicle.put_rails(last + moved + self.irregularity(t), np.zeros(8))
        self.before_last = last


class Held(Explicit):
    """The track steps first, under inputs that stay as they were at the step's beginning."""

    input_hold = 0


COUPLINGS: dict[str, tuple[type[Explicit], tuple[float, ...]]] = {  # and steps, ms
    "explicit, 1": (Explicit, (0.005, 0.01, 0.02, 0.05)),
    "implicit, 2": (Implicit, (0.02, 0.05, 0.08, 0.1, 0.2, 0.4, 1)),
    "vehicle first, 2": (VehicleFirst, (0.005, 0.01, 0.02)),
    "inputs held, 0": (Held, (0.005, 0.01)),
}
OUR_STEPS = (0.02, 0.05, 0.08, 0.1, 0.2)  # ms
Column = tuple[Callable[[Times], np.ndarray], tuple[float, ...]]  # what to run, and steps


def errors(columns: dict[str, Column], reference: np.ndarray, p: Vehicle) -> Table:
    """Run everything: a line of the table for each step."""
    steps = sorted({step for _, its_steps in columns.values() for step in its_steps})
    cells = {(name, step): "" for name in columns for step in steps}
    for name, (run, its_steps) in columns.items():
        for step in its_steps:
            every = lcm(round(1e6 * SAMPLE), round(1e3 * step)) // round(1e6 * SAMPLE)
            found = run(Times(1e-3 * step, STOP, every * SAMPLE))
            rms, _ = differences(found, reference[::every], p)[0]  # of contact forces
            opens = found[:, :8].min() <= 0  # forces of the reference stay above 50 kN
            cells[name, step] = "hammers" if opens else f"{rms:.2f}"
    table = Table(title="Dynamic contact forces: RMS error in %, by coupling and input_hold")
    for heading in ("step, ms", *columns):
        table.add_column(heading, justify="right")
    for step in steps:
        table.add_row(f"{step:g}", *(cells[name, step] for name in columns))
    return table


def main() -> None:
    """Print the table."""
    p, profile = Vehicle(), synthesise("german-low", SPEED * STOP)
    journey = Journey(speed=SPEED, held=False, profile=profile)
    with TemporaryDirectory() as folder:
        place = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(folder)
        if len(sys.argv) == 1:
            export(p, Track(), place)
        columns: dict[str, Column] = {
            name: (partial(exudyn_run, place / "Track.fmu", p, journey, coupling), steps)
            for name, (coupling, steps) in COUPLINGS.items()
        }
        ours = partial(our_run, place, journey)
        columns["our vehicle"] = ours, OUR_STEPS
        Console().print(errors(columns, ours(Times(FINEST, STOP, SAMPLE)), p))


if __name__ == "__main__":
    main()
