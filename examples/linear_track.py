"""The linear model inside Track.fmu by Model Exchange, with FMPy and SciPy alone.

Directional derivatives give A, B, C and D to rounding; the receptance of the rail under a wheel
follows at any frequency. Any tool that imports FMI 2.0 for Model Exchange can do the same.

    python examples/linear_track.py [PICTURE [TRACK_FMU]]
"""

import shutil
import sys
import tempfile
import time
from pathlib import Path

import fmpy
import matplotlib.pyplot as plt
import numpy as np
from fmpy.fmi2 import FMU2Model
from scipy.sparse import coo_array, eye_array
from scipy.sparse.linalg import splu


def told(places, first=20):
    """Go through them; say after the first how long all of them take, if it is some seconds."""
    begun = time.monotonic()
    for k, place in enumerate(places):
        if k == first:
            more = (time.monotonic() - begun) / first * (len(places) - first)
            if more > 2:
                print(f"{len(places)} evaluations: about {more:.0f} s more", flush=True)
        yield place


class LinearFmu:
    """An FMU at rest under its inputs, `start` (a dict) or their start values."""

    def __init__(self, path, start=None):
        self.description = fmpy.read_model_description(str(path), validate=False)
        self.folder = fmpy.extract(str(path))
        self.fmu = FMU2Model(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.modelExchange.modelIdentifier,
        )
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        for name, value in (start or {}).items():
            self.fmu.setReal([self.reference[name]], [value])
        self.fmu.exitInitializationMode()
        self.fmu.enterContinuousTimeMode()

    def derivative(self, unknowns, seed):
        """Change of the unknowns per change of the knowns in `seed` (a dict)."""
        return self.fmu.getDirectionalDerivative(
            [self.reference[name] for name in unknowns],
            [self.reference[name] for name in seed],
            list(seed.values()),
        )

    def state_space(self, inputs, outputs):
        """A (sparse), B, C, D.

        States whose derivatives have nothing in common are seeded together: the two parts of a
        complex mode act on each other alone, so A takes two calls, not six thousand.
        """
        unknowns = self.description.derivatives
        rates = [unknown.variable.name for unknown in unknowns]
        states = [unknown.variable.derivative.name for unknown in unknowns]
        place = {name: k for k, name in enumerate(states)}
        touched = [[] for _ in states]  # rates by state
        for row, unknown in enumerate(unknowns):
            for known in unknown.dependencies:
                if known.name in place:
                    touched[place[known.name]].append(row)
        entries, left = [], list(range(len(states)))
        while left:
            group, taken = [], set()
            for k in left:
                if taken.isdisjoint(touched[k]):
                    group.append(k)
                    taken.update(touched[k])
            left = sorted(set(left) - set(group))
            change = self.derivative(rates, {states[k]: 1.0 for k in group})
            entries += [(change[row], row, k) for k in group for row in touched[k]]
        values, rows, columns = zip(*entries, strict=True)
        A = coo_array((values, (rows, columns)), shape=(len(states), len(states))).tocsc()
        B = np.array([self.derivative(rates, {name: 1.0}) for name in inputs]).T
        C = np.array([self.derivative(outputs, {name: 1.0}) for name in told(states)]).T
        D = np.array([self.derivative(outputs, {name: 1.0}) for name in inputs]).T
        return A, B, C, D

    def receptance(self, frequency, inputs, outputs):
        """C (i omega - A)^-1 B + D, shape (n_frequency, n_outputs, n_inputs)."""
        A, B, C, D = self.state_space(inputs, outputs)
        one = eye_array(A.shape[0], format="csc")
        return np.array(
            [
                C @ splu(2j * np.pi * f * one - A).solve(B.astype(complex)) + D
                for f in told(frequency)
            ]
        )

    def close(self):
        """Free the instance and its folder."""
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


def main(picture="linear_track.png", path=None):
    """Print and plot the receptance of the rail under wheel 4, a railseat."""
    with tempfile.TemporaryDirectory() as folder:
        if path is None:
            from railcosim.fmus.export import WITH_STATES, export  # noqa: PLC0415 (only to have an FMU)
            from railcosim.track.parameters import Track  # noqa: PLC0415
            from railcosim.vehicle.parameters import Vehicle  # noqa: PLC0415

            print("exporting Track.fmu", flush=True)
            path = export(Vehicle(), Track(), Path(folder), runtime=WITH_STATES)["Track"]
        fmu = LinearFmu(path)
        frequency = np.union1d(np.geomspace(5, 1500, 300), np.arange(1040, 1075, 1.0))  # Hz
        sides = [f"wheelset[4].{side}" for side in ("left", "right")]
        H = fmu.receptance(frequency, [f"{side}.force_z" for side in sides], [f"{sides[0]}.rail_z"])
        print(f"{len(fmu.description.derivatives)} states")
        fmu.close()
    both = np.abs(H[:, 0].sum(axis=1))  # a unit force on each rail
    low = frequency < 100
    print(f"first resonance: {frequency[low][both[low].argmax()]:.1f} Hz")
    figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
    axes.loglog(frequency, np.abs(H[:, 0, 0]), label="force on the same rail")
    axes.loglog(frequency, np.abs(H[:, 0, 1]), "--", label="force on the other rail")
    axes.set(xlabel="frequency (Hz)", ylabel="|receptance| (m/N)", title="rail at a railseat")
    axes.margins(x=0)
    axes.grid(visible=True, which="both", alpha=0.3)
    axes.legend()
    figure.savefig(picture, dpi=150)


if __name__ == "__main__":
    main(*sys.argv[1:])
