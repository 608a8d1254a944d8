"""Track.fmu in space under a vehicle of another tool, exudyn, with its own law of rolling wheels.

The vehicle (`exudyn_spatial_model.py`) has the numbers of our vehicle and nothing else of ours: its
wheels are cones that creep by Kalker's linear law, bounded by friction. Track.fmu gives way in y,
z and roll and is driven by plain FMI 2.0 calls. Both run at 120 km/h where the same rails
bend. Takes some minutes.

    pip install exudyn
    python examples/exudyn_spatial.py [PICTURE] [--fmus FOLDER] [--time SECONDS]
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from exudyn_track import (
    WHEELS,
    Times,
    TrackFmu,
    masters_run,
    print_row,
    run_example,
    save_comparison,
)

from railcosim.analysis.pair.pair import Journey
from railcosim.cli.progress import progress
from railcosim.mechanics.ports import Layout, Y, Z
from railcosim.track.irregularity import Profile
from railcosim.vehicle.multibody import SPATIAL, build_multibody
from railcosim.vehicle.on_rails import cones_of
from railcosim.vehicle.parameters import Vehicle

try:
    from exudyn_model import roll
    from exudyn_spatial_model import BALANCE, ExudynSpatialVehicle, Wheels
except ModuleNotFoundError as missing:
    sys.exit(f"{missing}; exudyn is a multibody code: pip install exudyn")

SPEED = 120 / 3.6  # m/s, below the critical one
SAMPLE = 1e-3  # s, when they are compared
OUR_STEPS = (5e-5, 2.5e-5)  # s, of Vehicle.fmu and TrackWithContact.fmu
THEIR_STEPS = (2e-4, 1e-4)  # s
LATERAL = 4e-3  # m, out of line
WAVE = 12.0  # m, on which it is
GIVEN = ("force_y", "force_z", "moment_x")
MOVED = ("rail_y", "rail_z", "rail_roll")
RATES = ("rail_vy", "rail_vz", "rail_vroll")
QUANTITIES = {  # columns of the samples
    "aside": slice(0, 4),  # of the wheelsets, as the yaw
    "yaw": slice(4, 8),
    "force aside": slice(8, 16),  # of wheels on rails, as the force down
    "force down": slice(16, 24),
}
NO_GYROSCOPES = {"contact.axle_inertia": 0.0}  # axles of exudyn's vehicle turn as if they did not
PROBES = np.diag([1e3, 1e3, 1e2])  # N, N, N m of trial steps; the track is linear


class Coupled:
    """The vehicle steps onto rails that give way; then the track steps under the forces found.

    Over a step, the rails' places and rates at its end are linear in the forces at its end. Trial
    steps from a saved state tell how: creep is a damper so stiff that it must know how the rail
    moves while it is pushed.
    """

    def __init__(self, track: TrackFmu, vehicle: ExudynSpatialVehicle, uneven) -> None:
        self.track, self.vehicle, self.uneven = track, vehicle, uneven

    def rest(self, rounds: int = 6) -> None:
        """Find where both rest together: forces spread the rails, which changes them a little."""
        vehicle = self.vehicle
        vehicle.on_rails[:] = [0.0, vehicle.load, 0.0]
        vehicle.rails.uneven = self.uneven(0.0)
        for _ in range(rounds):
            vehicle.rails.q = self._motions(self.track.settle(vehicle.on_rails.ravel()))[0]
            vehicle.settle()
        self.track.hold(2)  # inputs go along the line to those set, which are of a step's end

    def before(self, t: float, h: float) -> None:
        """Find the rails at t under no forces, and how far and how fast they give way to them."""
        fmu, force, rails = self.track.fmu, self.vehicle.on_rails.copy(), self.vehicle.rails
        state = fmu.getFMUState()
        steps = []
        for probe in (np.zeros(3), *PROBES):
            answers = self.track.step(t - h, h, t, (force + probe).ravel())
            fmu.setFMUState(state)
            steps.append(self._motions(answers))
        fmu.freeFMUState(state)
        (q, v), *probed = steps
        sizes = PROBES.sum(axis=0)
        rails.q_by_force = np.stack(
            [(p[0] - q) / s for p, s in zip(probed, sizes, strict=True)], axis=-1
        )
        rails.v_by_force = np.stack(
            [(p[1] - v) / s for p, s in zip(probed, sizes, strict=True)], axis=-1
        )
        rails.q = q - np.einsum("nij,nj->ni", rails.q_by_force, force)
        rails.v = v - np.einsum("nij,nj->ni", rails.v_by_force, force)
        rails.uneven = self.uneven(t)

    def after(self, t: float, h: float) -> None:
        """Step the track under the forces at t."""
        self.track.step(t - h, h, t, self.vehicle.on_rails.ravel())

    @staticmethod
    def _motions(answers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        moved = answers.reshape(len(WHEELS), 6)
        return moved[:, :3], moved[:, 3:]


def out_of_line(length: float) -> Profile:
    """Both rails aside by a single bend, three metres ahead of the first wheelset."""
    x = np.arange(0.0, length + 1.0, 0.05)
    part = np.clip((x - 3.0) / WAVE, 0.0, 1.0)
    aside = LATERAL * np.sin(np.pi * part) ** 2
    level = np.zeros_like(x)
    return Profile(
        name="a bend", x=x, left=level, right=level, left_y=aside, right_y=aside,
        level_beyond=True,
    )  # fmt: skip


def wheels_of(p: Vehicle) -> Wheels:
    """The numbers of our vehicle's wheels, at their static load."""
    cone = cones_of(build_multibody(p, SPATIAL), p.rolling.conicity)[0]
    f = [float(x) for x in cone.patch.creep_coefficients(np.array(p.wheel_load))]
    return Wheels(
        radius=cone.radius, half_distance=cone.half_distance, conicity=cone.conicity,
        head_radius=cone.head_radius, hertz=float(cone.patch.ellipse.C), load=p.wheel_load,
        f11=f[0], f22=f[1], f23=f[2], f33=f[3], friction=p.rolling.friction, speed=SPEED,
    )  # fmt: skip


def exudyn_run(path: Path, p: Vehicle, profile: Profile, times: Times) -> np.ndarray:
    """Roll exudyn's vehicle over Track.fmu; samples as `QUANTITIES` has them."""
    with TemporaryDirectory() as unpacked, progress(f"exudyn, {1e3 * times.step:g} ms") as update:
        track = TrackFmu(path, unpacked, SPEED, GIVEN, MOVED + RATES)
        vehicle = ExudynSpatialVehicle(p, wheels_of(p))
        surface = profile.under(track.start, SPEED, (Z, Y))

        def uneven(t: float) -> np.ndarray:
            z, y = surface(t).reshape(len(WHEELS), 2).T
            return np.stack([y, z, np.zeros_like(y)], axis=1)

        coupled, samples = Coupled(track, vehicle, uneven), []
        coupled.rest()

        def after(t: float) -> None:
            if t > 0:  # exudyn also calls it at the start
                coupled.after(t, times.step)
            if round(t / times.step) % times.every == 0:
                y, _, _, yaw = vehicle.moves().T
                forces = vehicle.on_rails[:, :2].T
                samples.append(np.concatenate([y, yaw, *forces]))
                update(t, times.stop)

        step = times.step
        roll(vehicle.mbs, step, times.stop, lambda t: coupled.before(t, step), after, BALANCE)
        track.close()
    return np.array(samples)


def our_run(fmus: Path, p: Vehicle, profile: Profile, times: Times) -> np.ndarray:
    """Our vehicle on a track that owns the contact: as `QUANTITIES` has it, shape (n, 24)."""
    run = masters_run(fmus, Journey(speed=SPEED, held=False, profile=profile), times, NO_GYROSCOPES)
    wheels, radius = [f"{axle}.left" for axle in Layout().axles], p.wheelset.radius
    y = [run[f"{w}.wheel_y"] + radius * run[f"{w}.wheel_roll"] for w in wheels]  # of the axle
    yaw = [run[f"{w}.wheel_yaw"] for w in wheels]
    forces = [run[f"{w}.{force}"] for force in GIVEN[:2] for w in WHEELS]
    return np.stack([*y, *yaw, *forces], axis=1)[:: times.every]


def differences(theirs: np.ndarray, ours: np.ndarray) -> list[tuple[float, float]]:
    """RMS and largest difference of each quantity over those of its change, in percent."""
    found = []
    for columns in QUANTITIES.values():
        error, change = (theirs - ours)[:, columns], (ours - ours[0])[:, columns]
        rms = np.sqrt(np.mean(error**2) / np.mean(change**2))
        largest = np.abs(error).max() / np.abs(change).max()
        found.append((100 * float(rms), 100 * float(largest)))
    return found


def compare(fmus: Path, stop: float, picture: Path) -> None:
    """Run both vehicles, print how far they are apart and draw them."""
    p, profile = Vehicle(), out_of_line(SPEED * stop)
    coarse, ours = (our_run(fmus, p, profile, Times(h, stop, SAMPLE)) for h in OUR_STEPS)
    print("difference to railcosim with 0.025 ms: RMS and largest, % of the change")
    print(f"{'':20}" + "".join(f"{quantity:>18}" for quantity in QUANTITIES))
    print_row("railcosim, 0.05 ms", 20, differences(coarse, ours))
    for step in THEIR_STEPS:
        theirs = exudyn_run(fmus / "Track.fmu", p, profile, Times(step, stop, SAMPLE))
        print_row(f"exudyn, {1e3 * step:g} ms", 20, differences(theirs, ours))
    shown = {
        "wheelset 1 to the right (mm)": (1e3 * ours[:, 0], 1e3 * theirs[:, 0]),
        "its yaw (mrad)": (1e3 * ours[:, 4], 1e3 * theirs[:, 4]),
        "left wheel on its rail, to the right (kN)": (1e-3 * ours[:, 8], 1e-3 * theirs[:, 8]),
    }
    title = "Vehicles of railcosim and exudyn where the same rails bend, 120 km/h"
    save_comparison(title, SAMPLE * np.arange(len(ours)), shown, picture)


if __name__ == "__main__":
    run_example(compare, __doc__.splitlines()[0], "exudyn-space.png", SAMPLE, "spatial")
