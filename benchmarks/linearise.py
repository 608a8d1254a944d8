"""Linearising both FMUs in three ways: what it takes, and how exact it is.

    python benchmarks/linearise.py

Errors are differences to the directional derivatives, for all eight contact forces and 0.1 to
2000 Hz: of the displacements (and of other units, in the second table) relative to the largest
response of the same unit to the same force at the same frequency; of the driving points relative to
themselves. The estimate is what the model says of its own displacements. Then the coupled response
from black boxes against one monolithic system, solved directly: both state spaces and the contact
springs in one sparse matrix.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.sparse import block_array, csc_array, eye_array
from scipy.sparse.linalg import splu

from railcosim.analysis.response.frequency import coupled
from railcosim.analysis.response.models import Models, pulses, wheelset_positions
from railcosim.fmus.export import WITH_STATES, export
from railcosim.master.component import FloatArray
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.linear.linear_fmu import DIFFERENCES, EXACT, Wanted, Way
from railcosim.master.linear.linear_form import LinearForm, alike, error_estimate
from railcosim.master.linear.operating_point import OperatingPoint
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.state_space import StateSpace
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

FORCES = Layout().names(FORCE)
WHEELS = Layout().wheels
WHEELSETS = Layout().axles

BANDS = ((0.1, 5.0), (5.0, 200.0), (200.0, 2000.0))  # Hz
# Also close to the rail's first resonance and to the one between two railseats, undamped.
FREQUENCY = np.unique(
    np.r_[np.geomspace(0.1, 2000.0, 400), np.arange(40, 70, 0.5), np.arange(1045, 1067, 0.25)]
).clip(max=2000.0)
OMEGA = 2 * np.pi * FREQUENCY
STIFFNESSES = (0.1e9, 1e9, 8e9)  # N/m


def wanted(name: str, folder: Path) -> Wanted:
    """Forces to all motions, wheelsets where the vehicle stands."""
    with FmuComponent.load(folder / f"{name}.fmu") as fmu:
        outputs = [v.name for v in fmu.outputs if not v.name.endswith(".position")]
    if name == "Vehicle":
        return Wanted(inputs=FORCES, outputs=outputs, parameters={"speed": 0.0})
    places = wheelset_positions(folder / "Vehicle.fmu").tolist()
    at = {f"{w}.position": x for w, x in zip(WHEELSETS, places, strict=True)}
    return Wanted(inputs=FORCES, outputs=outputs, at=at)


@contextmanager
def counted() -> Iterator[Counter[str]]:
    """Count steps, evaluations and derivatives of FMUs."""
    counter: Counter[str] = Counter()
    kept = {}

    def wrap(owner: type, name: str, what: str) -> None:
        original: Callable[..., Any] = getattr(owner, name)

        def call(*arguments: Any) -> Any:
            counter[what] += 1
            return original(*arguments)

        kept[owner, name] = original
        setattr(owner, name, call)

    wrap(FmuComponent, "do_step", "steps")
    wrap(OperatingPoint, "evaluate", "evaluations")
    wrap(OperatingPoint, "derivative", "derivatives")
    try:
        yield counter
    finally:
        for (owner, name), original in kept.items():
            setattr(owner, name, original)


def bands(frequency: FloatArray, relative: FloatArray) -> FloatArray:
    """Largest in each band."""
    return np.array(
        [relative[(frequency >= low) & (frequency <= high)].max() for low, high in BANDS]
    )


def errors(model: LinearForm, true: ComplexArray) -> dict[str, FloatArray]:
    """Largest error in each band: by unit, and of the driving points."""
    difference = np.abs(model.frequency_response(OMEGA) - true)
    found = {}
    for like in alike(model.outputs):
        size = np.abs(true[:, like]).max(axis=1, keepdims=True)
        relative = (difference[:, like] / size).max(axis=(1, 2))
        found[model.outputs[like[0]].unit] = bands(FREQUENCY, relative)
    names = [v.name for v in model.outputs]
    motion = "wheel_z" if f"{WHEELS[0]}.wheel_z" in names else "rail_z"
    rows = [names.index(f"{wheel}.{motion}") for wheel in WHEELS]
    own = difference[:, rows, range(8)] / np.abs(true[:, rows, range(8)])
    found["driving points"] = bands(FREQUENCY, own.max(axis=1))
    return found


def monolithic(vehicle: StateSpace, track: StateSpace, k_H: float, omega: FloatArray) -> Any:
    """Wheels, rails and contact forces for a unit gap at each contact, (n_omega, 24, 8).

    Unknown are the states of both and the forces F = k_H (wheel - rail - gap), all at once.
    """
    n = len(FORCES)
    v, t = ([v.name for v in model.outputs] for model in (vehicle, track))
    C_v = csc_array(vehicle.C[[v.index(f"{w}.wheel_z") for w in WHEELS]])
    C_t = csc_array(track.C[[t.index(f"{w}.rail_z") for w in WHEELS]])
    one_v, one_t = (eye_array(model.A.shape[0], format="csc") for model in (vehicle, track))
    right = np.zeros((vehicle.A.shape[0] + track.A.shape[0] + n, n), dtype=complex)
    right[-n:] = -np.eye(n)
    found = []
    for w in omega:
        system = block_array(
            [
                [1j * w * one_v - vehicle.A, None, csc_array(-vehicle.B)],
                [None, 1j * w * one_t - track.A, csc_array(-track.B)],
                [-C_v, C_t, eye_array(n) / k_H],
            ],
            format="csc",
        )
        x = splu(system).solve(right)
        states = vehicle.A.shape[0]
        found.append(np.vstack([C_v @ x[:states], C_t @ x[states:-n], x[-n:]]))
    return np.array(found)


def coupled_errors(models: Models, true: Models, k_H: float) -> dict[str, FloatArray]:
    """Coupled response of black boxes against the monolithic one, by what is observed."""
    assert isinstance(true.vehicle, StateSpace)
    assert isinstance(true.track, StateSpace)
    few = slice(None, None, 4)
    exact = monolithic(true.vehicle, true.track, k_H, OMEGA[few])
    ours = coupled(models, OMEGA[few], k_H)
    columns = ours.columns([f"{w}.irregularity_z" for w in WHEELS])
    found = {}
    for k, (name, output) in enumerate(
        {"wheels": "Vehicle.{}.wheel_z", "rails": "Track.{}.rail_z", "forces": "{}.force_z"}.items()
    ):
        rows = ours.rows([output.format(w) for w in WHEELS])
        theirs = exact[:, 8 * k : 8 * k + 8]
        size = np.abs(theirs).max(axis=1, keepdims=True)
        error = np.abs(ours.values[:, rows][:, :, columns] - theirs) / size
        found[name] = bands(FREQUENCY[few], error.max(axis=(1, 2)))
    return found


def measured(
    folder: Path, name: str, way: Way, true: LinearForm | None
) -> tuple[LinearForm, list[str], dict[str, FloatArray]]:
    """A linear model, what it took, and its errors."""
    with counted() as counter:
        begun = perf_counter()
        model = way(folder / f"{name}.fmu", name, wanted(name, folder), lambda done, total: None)
        spent = perf_counter() - begun
    cost = ", ".join(f"{number} {what}" for what, number in counter.items())
    if "steps" in counter:
        cost = f"{counter['steps'] / len(FORCES):.0f} steps an input"
    reference = model if true is None else true
    moved = [output.unit == "m" for output in model.outputs]
    estimate = error_estimate(model, OMEGA[::8])[moved].max()
    row = [name, way.description, cost, f"{spent:.1f}", f"{estimate:.0e}"]
    return model, row, errors(model, reference.frequency_response(OMEGA))


def table(title: str, headings: list[str]) -> Table:
    """Without rows; the last three columns are the bands."""
    made = Table(title=title)
    for heading in [*headings, *(f"{low:g}-{high:g} Hz" for low, high in BANDS)]:
        made.add_column(heading)
    return made


def main() -> None:
    """Print the tables."""
    console = Console(width=140)
    costs = table("Largest error of a displacement", ["FMU", "way", "cost", "s", "estimate"])
    units = table("Pulses: largest error by unit", ["FMU", "what"])
    both = table("Coupled: black boxes against monolithic", ["k_H (GN/m)", "what"])
    found: dict[tuple[str, str], LinearForm] = {}
    with TemporaryDirectory() as place:
        folder = Path(place)
        export(Vehicle(), Track(), folder, runtime=WITH_STATES)
        for name in ("Vehicle", "Track"):
            for way in (EXACT, DIFFERENCES, pulses(4)):
                true = found.get((name, EXACT.description))
                model, row, error = measured(folder, name, way, true)
                found[name, way.description] = model
                costs.add_row(*row, *(f"{e:.0e}" for e in error["m"]))
            for unit, worst in error.items():
                units.add_row(name, unit, *(f"{e:.0e}" for e in worst))
        positions = wheelset_positions(folder / "Vehicle.fmu")
    true, boxes = (
        Models(found["Vehicle", way.description], found["Track", way.description], positions, {})
        for way in (EXACT, pulses(4))
    )
    for k_H in STIFFNESSES:
        for what, worst in coupled_errors(boxes, true, k_H).items():
            both.add_row(f"{k_H / 1e9:g}", what, *(f"{e:.0e}" for e in worst))
    for one in (costs, units, both):
        console.print(one)


if __name__ == "__main__":
    main()
