"""Cost in the frequency domain beside the peers', in one run and one table.

    python benchmarks/frequency.py [--rolland PYTHON] [--paper] [--keep WHY]

PYTHON is an interpreter that has rolland (3.12 or newer); this one if not given. With --paper,
`railcosim paper` is timed as well, quick and in full. Beside each of our costs stands what it was
when `frequency.csv` was last written, by --keep; WHY is what has changed. Machines are made
comparable by a yardstick: numpy alone, which no change of ours makes faster.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from kept import Memory, seconds, shown
from rich.console import Console
from rich.table import Table

from railcosim.analysis.response.frequency import coupled, response
from railcosim.analysis.response.models import Models, linear_models
from railcosim.analysis.response.plane import plane, transfer
from railcosim.analysis.response.rolling_pair import rolling_of
from railcosim.fmus.export import WITH_STATES, export
from railcosim.mechanics.law import LinearContact
from railcosim.mechanics.ports import Layout
from railcosim.paper.maps import OUTPUTS
from railcosim.reference.contacts import Pressing
from railcosim.reference.frequency import frequency_response, linearised
from railcosim.reference.monolithic import assemble
from railcosim.track.irregularity.quantities import QUANTITIES
from railcosim.track.parameters import Track
from railcosim.track.receptance import BOTH, Point, infinite_receptance
from railcosim.vehicle.parameters import Vehicle

K_H, SAMPLE, GRID = 1e9, 20, 400
VEHICLE = [f"vehicle.bogie[{j}].{q}" for j in (1, 2) for q in ("z", "pitch")]
MOUNTS = (100, 160)  # 160: as many as our ring has
Rows = list[tuple[str, str, str]]


def frequency_domain(models: Models, memory: Memory) -> Rows:
    """The coupled response and the map, against a direct solve of everything each time."""
    omega = 2 * np.pi * np.geomspace(0.14, 1111, 2000)
    force = "wheelset[4].force_z"
    one = seconds(lambda: response(coupled(models, omega, K_H), force, models.positions, 1.0), 9)
    one /= omega.size
    every_input = seconds(lambda: coupled(models, omega, K_H).values, 9) / omega.size
    mono = assemble(Vehicle(), Track(), models.positions)
    springs = linearised(mono, Pressing(LinearContact(k_H=K_H)), models.positions)
    load = mono.wheels[[3]].toarray().T
    few = omega[:: omega.size // SAMPLE]
    solve = seconds(lambda: frequency_response(mono, few, springs, load), 1) / few.size
    wavelength, speed = np.linspace(0.1, 20, GRID), np.linspace(10, 400, GRID) / 3.6
    outputs = [*OUTPUTS, *VEHICLE]
    ends = float(speed[0] / wavelength[-1]), float(speed[-1] / wavelength[0])

    def whole() -> None:
        table = transfer(lambda w: coupled(models, w, K_H), outputs, *ends)
        plane(table, models.positions, wavelength, speed)

    mapped = seconds(whole, 5)
    every = solve * GRID**2
    ours = {
        "coupled FRF, a frequency, 8 wheels, one excitation": one,
        "coupled FRF, a frequency, 8 wheels, all inputs": every_input,
        f"map {GRID} x {GRID}, {len(outputs)} responses": mapped,
    }
    return [
        *((what, shown(cost), memory.beside(what, cost)) for what, cost in ours.items()),
        (f"direct solve of {mono.K.shape[0]} unknowns, a frequency", f"{1e3 * solve:.0f} ms",
         f"{solve / one:.0f} x"),
        ("map, one direct solve a grid point (from a sample)", f"{every / 3600:.1f} h",
         f"{every / mapped:.0f} x"),
    ]  # fmt: skip


def in_space(folder: Path, memory: Memory) -> Rows:
    """The coupled response of wheels that roll: the four irregularities at once, all outputs."""
    fmus = export(Vehicle(), Track(), folder, dimension="spatial", runtime=WITH_STATES)
    models = linear_models(fmus["Vehicle"], fmus["Track"], lambda done, total: None)
    contact = rolling_of(Vehicle(), [fmus["Vehicle"]], models.vehicle).at(100 / 3.6)
    omega = 2 * np.pi * np.geomspace(0.14, 1111, 500)
    wheels = Layout(len(models.positions)).wheels
    gaps = [f"{wheel}.irregularity_{direction}" for wheel in wheels for direction in "zy"]
    loads = np.random.default_rng(1).standard_normal((1, len(gaps), len(QUANTITIES)))
    cost = seconds(lambda: coupled(models, omega, contact).to(gaps, loads), 9) / omega.size
    outputs = len(coupled(models, omega[:1], contact).outputs)
    what = f"in space: a frequency, {len(QUANTITIES)} excitations, {outputs} outputs"
    return [(what, shown(cost), memory.beside(what, cost))]


def receptances(python: str) -> Rows:
    """The rail on a rigid slab: rolland's Green's functions beside our finite elements."""
    frequency = np.geomspace(10, 1500, 200)
    omega, slabs = 2 * np.pi * frequency, Track()
    rigid = replace(slabs, slab=replace(slabs.slab, present=False))
    seat = Point(x=3.5 * slabs.fastening.spacing)
    rows: Rows = []
    for name, track, point in (
        ("rail on slabs, endless, loads on both rails", slabs, replace(seat, side=BOTH)),
        ("rail on slabs, endless", slabs, seat),
        ("rail on rigid slab, endless", rigid, seat),
    ):
        of = partial(infinite_receptance, track, omega, [point], [seat])
        time = seconds(of, 9) / frequency.size
        rows.append((f"{name}, a frequency", f"{1e3 * time:.2f} ms", ""))
    ours = of()[:, 0, 0]
    script = Path(__file__).with_name("rolland_receptance.py")
    for mounts in MOUNTS:
        command = [python, str(script), str(mounts), *(repr(float(f)) for f in frequency)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            why = (done.stderr.strip().splitlines() or ["?"])[-1]
            return [*rows, ("rolland: did not run", why[:50], "")]
        cost, *theirs = (float(x) for x in done.stdout.split())
        difference = np.max(np.abs(np.abs(ours) / theirs - 1))
        rows.append(
            (f"rolland, {mounts} mounts (differs by {difference:.1e} at most)", f"{cost:.2f} ms",
             f"{cost / (1e3 * time):.2f} x")
        )  # fmt: skip
    return rows


def paper(folder: Path) -> Rows:
    """The whole paper."""
    command = [str(Path(sys.executable).with_name("railcosim")), "paper"]
    rows = []
    for options in (["--quick"], []):
        begun = perf_counter()
        out = str(folder / f"paper{len(options)}")
        subprocess.run([*command, *options, "--out", out], check=True, capture_output=True)
        name = " ".join(["railcosim paper", *options])
        rows.append((name, f"{perf_counter() - begun:.0f} s", ""))
    return rows


def main() -> None:
    """Print the table."""
    arguments = sys.argv[1:]
    python = sys.executable
    memory = Memory(Path(__file__).with_suffix(".csv"))
    if "--rolland" in arguments:
        python = arguments[arguments.index("--rolland") + 1]
    with TemporaryDirectory(prefix="railcosim_") as name:
        folder = Path(name)
        fmus = export(Vehicle(), Track(), folder, runtime=WITH_STATES)
        begun = perf_counter()
        models = linear_models(fmus["Vehicle"], fmus["Track"], lambda done, total: None)
        rows: Rows = [("linearise both FMUs, once", f"{perf_counter() - begun:.0f} s", "")]
        rows += frequency_domain(models, memory)
        rows += in_space(folder / "space", memory)
        rows += receptances(python)
        if "--paper" in arguments:
            rows += paper(folder)
    table = Table(title=f"Frequency domain; {os.cpu_count()} cores, one thread")
    for heading in ("what", "cost", "against"):
        table.add_column(heading, justify="left" if heading == "what" else "right")
    for row in rows:
        table.add_row(*row)
    Console().print(table)
    if "--keep" in arguments:
        memory.keep(arguments[arguments.index("--keep") + 1])


if __name__ == "__main__":
    main()
