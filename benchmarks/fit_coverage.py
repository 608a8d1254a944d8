"""How often the intervals of `railcosim fit` hold, and a curve that is not ours.

    python benchmarks/fit_coverage.py [--trials 400]
    python benchmarks/fit_coverage.py --published data_analytical_methods.csv

Of every trial the receptance of the true track gets independent errors of 5 % and 0.05 rad; counted
is how often the true number is within its 95 % interval, parameter by parameter.

--published fits rolland's table (BSD-3-Clause, github.com/mantelmax/rolland, tests/data),
|mobility| of a Timoshenko UIC60 rail on 241 single supports: of one layer (made with 300 MN/m and a
loss factor of 0.25) and of two (under it 162 kg on 50 MN/m with a loss factor of 1).
"""

from __future__ import annotations

import argparse
import csv
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy import stats

from railcosim import Track, track_receptance
from railcosim.analysis.fitting.fit import Problem, fit
from railcosim.analysis.fitting.identified import identified
from railcosim.analysis.fitting.measured import read_measured
from railcosim.track.parameters import Fastening, Layer, Rail, Slab

NOISE = 0.05
GROUND = Track(slab=Slab(present=False))
CASES = {
    "rails on fastenings on rigid ground, 40 to 1500 Hz": (
        GROUND, ("fastening.stiffness", "fastening.damping"), np.geomspace(40, 1500, 20)
    ),
    "the paper's track, 20 to 400 Hz": (
        Track(), ("fastening.stiffness", "fastening.damping", "foundation.stiffness"),
        np.geomspace(20, 400, 16),
    ),
}  # fmt: skip
RAIL = Rail(
    young_modulus=2.1e11, mass_per_length=60.2, area=76.7e-4, poisson_ratio=2.1 / 1.62 - 1,
    shear_coefficient=0.4, second_moment=3.0383e-5, loss_factor=0.02,
)  # fmt: skip
NO_SLAB = Slab(present=False, length=0.6, joint=0.0)
PADS = Fastening(stiffness=1e8, damping=0.0, loss_factor=0.1, spacing=0.6)
BLOCK = Layer(name="block", kind="block", mass=300.0, stiffness=2e7, damping=0.0, loss_factor=0.3)
OF_PADS = ("fastening.stiffness", "fastening.loss_factor")
OF_BLOCKS = ("block.mass", "block.stiffness", "block.loss_factor")
# Started far from what made them, by column.
THEIRS = {
    "TSDiscr1LSupp": (Track(rail=RAIL, fastening=PADS, slab=NO_SLAB), OF_PADS),
    "TSDiscr2LSupp": (
        Track(rail=RAIL, fastening=PADS, slab=NO_SLAB, layers=(BLOCK,)), (*OF_PADS, *OF_BLOCKS)
    ),
}  # fmt: skip


def covered(name: str, trials: int, folder: Path) -> None:
    """Count, searching from the true track: what is tried are intervals, not the search."""
    track, free, frequency = CASES[name]
    H = track_receptance(track, frequency)["receptance"].values
    inside, began = np.zeros(len(free)), time.process_time()
    for seed in range(trials):
        errors = np.random.default_rng(seed).standard_normal((2, H.size))
        noisy = H * np.exp(NOISE * (errors[0] + 1j * errors[1]))
        table = np.column_stack([frequency, noisy.real, noisy.imag])
        np.savetxt(folder / "m.csv", table, delimiter=",", comments="",
                   header="f (Hz),real (m/N),imag (m/N)")  # fmt: skip
        measured = read_measured(folder / "m.csv", track, both_rails=True)
        problem = Problem(track, free, (measured,), lambda: None)
        found = problem.solved(np.zeros(len(free)), 1e-6)
        J = problem.jacobian(found.x)
        known = identified(list(free), J, found.fun, problem.runs, [""] * len(free))
        inside += np.abs(found.x) < known.half_width
    low, high = stats.binom.ppf([0.025, 0.975], trials, 0.95)
    spent = (time.process_time() - began) / trials
    print(f"{name}: {trials} trials, by chance {low:.0f} to {high:.0f}; {spent:.2g} s of CPU each")
    for key, count in zip(free, inside, strict=True):
        print(f"  {key}: {count:.0f} within ({count / trials:.3f})")


def published(source: Path, folder: Path) -> None:
    """Fit what rolland printed, 60 to 900 Hz."""
    with source.open() as file:
        rows = list(csv.DictReader(file))
    for column, (track, free) in THEIRS.items():
        table = np.array([[float(row["Frequency"]), float(row[column])] for row in rows])
        table = table[(table[:, 0] >= 60) & (table[:, 0] <= 900)][::10]
        np.savetxt(folder / "p.csv", table, delimiter=",", comments="",
                   header="f (Hz),magnitude (m/s/N)")  # fmt: skip
        found = fit(folder / "p.csv", track, free=free)
        print(f"{column}: {len(table)} frequencies, rms {found.attrs['rms']:.2g} dB, "
              f"neighbours {found.attrs['neighbours']:.2f}")  # fmt: skip
        for key in found["parameter"].values:
            one = found.sel(parameter=key)
            value, low, high = (float(one[n]) for n in ("value", "lower", "upper"))
            print(f"  {key}: {value:.5g} ({low:.5g} to {high:.5g})")
        print(f"  {found.attrs['not_identified']}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--trials", type=int, default=400)
    parser.add_argument("--published", type=Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        if arguments.published:
            published(arguments.published, Path(scratch))
        else:
            for case in CASES:
                covered(case, arguments.trials, Path(scratch))
