"""Track.fmu under the vehicle of another tool: exudyn, a multibody code, with its own contact.

The vehicle (`exudyn_model.py`) has the numbers of our vehicle and nothing else of ours. Track.fmu
is driven by plain FMI 2.0 calls. What both vehicles do at 250 km/h over the same irregularity is
compared, with two steps each, so that one sees what the steps leave. Takes a minute or two.

    pip install exudyn
    python examples/exudyn_vehicle.py [PICTURE] [--fmus FOLDER] [--time SECONDS]
"""

import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from exudyn_track import Times, TrackFmu, masters_run, print_row, run_example, save_comparison

from railcosim.analysis.pair.pair import Journey
from railcosim.cli.progress import progress
from railcosim.fmus.start import contact_defaults
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.track.irregularity import synthesise
from railcosim.vehicle.parameters import Vehicle

FORCES = Layout().names(FORCE)

try:
    from exudyn_model import ExudynVehicle, roll, settle
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


def exudyn_run(
    path: Path, p: Vehicle, journey: Journey, coupling: type[Explicit], times: Times
) -> np.ndarray:
    """Roll exudyn's vehicle over Track.fmu; returns samples, shape (n, 11)."""
    step, stop = times.step, times.stop
    with TemporaryDirectory() as unpacked, progress(f"exudyn, {1e3 * step:g} ms") as update:
        track = TrackFmu(path, unpacked, SPEED, ("force_z",), ("rail_z",))
        vehicle = ExudynVehicle(p, contact_defaults(p).C[0])
        irregularity = journey.profile.under(track.start, SPEED)
        rail_z = track.settle(np.full(8, p.wheel_load))
        vehicle.put_rails(rail_z + irregularity(0.0), np.zeros(8))
        settle(vehicle.mbs)
        z_0, samples = vehicle.carbody()[1], []
        coupled = coupling(track, vehicle, irregularity)

        def after(t: float) -> None:
            if t > 0:  # exudyn also calls it at the start
                coupled.after(t, step)
            if round(t / step) % times.every == 0:
                acceleration, z, pitch = vehicle.carbody()
                samples.append([*vehicle.forces(), acceleration, z - z_0, pitch])
                update(t, stop)

        roll(vehicle.mbs, step, stop, lambda t: coupled.before(t, step), after)
        track.close()
    return np.array(samples)


def our_run(fmus: Path, journey: Journey, times: Times) -> np.ndarray:
    """Our vehicle on a track that owns the contact, coupled by our master."""
    run = masters_run(fmus, journey, times, {"contact.nonlinear": True})
    z = run["carbody.z"] - run["carbody.z"][0]
    columns = [*(run[f] for f in FORCES), run["carbody.az"], z, run["carbody.pitch"]]
    return np.stack(columns, axis=1)[:: times.every]


def differences(theirs: np.ndarray, ours: np.ndarray, p: Vehicle) -> list[tuple[float, float]]:
    """RMS and largest difference of each quantity over those of its dynamic part, in percent."""
    at_rest = np.array([p.wheel_load] * 8 + [0.0] * 3)
    found = []
    for columns in QUANTITIES.values():
        error, dynamic = (theirs - ours)[:, columns], (ours - at_rest)[:, columns]
        rms = np.sqrt(np.mean(error**2) / np.mean(dynamic**2))
        largest = np.abs(error).max() / np.abs(dynamic).max()
        found.append((100 * float(rms), 100 * float(largest)))
    return found


def compare(fmus: Path, stop: float, picture: Path) -> None:
    """Run both vehicles, print how far they are apart and draw them."""
    p, profile = Vehicle(), synthesise("german-low", SPEED * stop)
    journey = Journey(speed=SPEED, held=False, profile=profile)
    coarse, ours = (our_run(fmus, journey, Times(h, stop, SAMPLE)) for h in OUR_STEPS)
    print("difference to railcosim with 0.025 ms: RMS and largest, % of the dynamic part")
    print(f"{'':26}" + "".join(f"{quantity:>18}" for quantity in QUANTITIES))
    print_row("railcosim, 0.05 ms", 26, differences(coarse, ours, p))
    for coupling, step in ((Explicit, 1e-5), (Explicit, 5e-6), (Implicit, 1e-4), (Implicit, 5e-5)):
        theirs = exudyn_run(fmus / "Track.fmu", p, journey, coupling, Times(step, stop, SAMPLE))
        name = f"exudyn, {coupling.__name__.lower()}, {1e3 * step:g} ms"
        print_row(name, 26, differences(theirs, ours, p))
    shown = {
        "contact force, wheelset 1, left (kN)": (1e-3 * ours[:, 0], 1e-3 * theirs[:, 0]),
        "car body acceleration, down (m/s²)": (ours[:, 8], theirs[:, 8]),
    }
    title = "Vehicles of railcosim and exudyn on the same track, 250 km/h, german-low"
    save_comparison(title, SAMPLE * np.arange(len(ours)), shown, picture)


if __name__ == "__main__":
    run_example(compare, __doc__.splitlines()[0], "exudyn.png", SAMPLE, "vertical")
