"""Limits of pairs of public FMUs: predicted, and as runs of them have it.

    python benchmarks/public_pairs.py FOLDER [--keep WHY]

In FOLDER are the repositories of OMSimulator (2940ef11) and libcosim (52cc8251), or what of them
holds FMUs. Nothing is downloaded. A pair is run twice with another start; the difference of both
runs is free motion, and how fast that grows, per second, is found 1 % below and above the limit, or
farther off, until it is on both sides of none. What has died away is not looked at: what is left is
noise of solvers, which grows and falls as it likes.
"""

from __future__ import annotations

import csv
import sys
import tempfile
import time
import warnings
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from railcosim.analysis.schemes.black_boxes import system_stability
from railcosim.analysis.schemes.catalogue import members
from railcosim.analysis.schemes.exponentials import fastest
from railcosim.master.component import ComponentError, FloatArray
from railcosim.master.connections import Connection
from railcosim.master.fmi.description import describe_file
from railcosim.master.ssp import Part, initialise, open_ssp, write_ssp
from railcosim.master.system import System

CONSOLE = Console(width=120)
KEPT = Path(__file__).with_suffix(".csv")
COLUMNS = ("pair", "scheme", "predicted", "simulated", "way", "when", "why")
STEPS, LATE = 240, 60
"""Steps of a run, and from which on growth is looked for."""
LARGE, TOLERANCE = 1e9, 1e-9
GONE = 1e-5
"""Of a motion at its largest: what is left below that is solvers' noise, no motion."""
APART = 0.01, 0.05, 0.2, 0.5
"""Parts of the limit below and above it."""


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two public FMUs, how they are wired, and what is changed to set them moving.

    Those without Model Exchange are linearised by pulses of `amplitude` nominal values over `step`.
    """

    name: str
    files: Mapping[str, str]
    schemes: tuple[str, ...]
    nudged: tuple[str, str, float]
    wires: tuple[tuple[str, str], ...] = ()
    starts: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    law: str = ""
    step: float | None = None
    amplitude: float = 1e-3


def sprung(stiffness: float, damping: float, motion: str, rate: str, force: str, along: int) -> str:
    """A spring and a damper between ``left`` and ``right``; `along` is the sign of their forces."""
    return f"""[[contact]]
stiffness = {stiffness}
damping = {damping}
motion = {{ "left.{motion}" = 1, "right.{motion}" = -1 }}
rate = {{ "left.{rate}" = 1, "right.{rate}" = -1 }}
force = {{ "left.{force}" = {-along}, "right.{force}" = {along} }}
"""


OMS, TRUCK = "testsuite/tests/resources", "tests/data/fmi2/quarter_truck"
DRIVE = f"{OMS}/dcmotor/resources/edrive_mass.fmu"
MASSES = f"{OMS}/DualMassOscillator.System"
CAR = f"{OMS}/QuarterCarModel.DisplacementForce"
BOTH = "left", "right"
ALIKE = {"absTolerance": 1e-7, "relTolerance": 1e-7}
PAIRS = (
    Pair(
        name="OMSimulator, DC motor and drive (Dymola), emf.k = 0.5",
        files={"machine": f"{OMS}/dcmotor/resources/emachine_model.fmu", "drive": DRIVE},
        wires=(("drive.wA", "machine.w"), ("machine.M", "drive.M_A")),
        starts={"machine": {"emf.k": 0.5}},
        schemes=(
            "jacobi-constant", "jacobi-linear", "gauss-seidel-constant-machine-first",
            "gauss-seidel-linear-machine-first", "gauss-seidel-linear-drive-first",
        ),
        nudged=("machine", "U", 1.0),
    ),
    Pair(
        name="OMSimulator, two drives (Dymola) on a spring in the master",
        files=dict.fromkeys(BOTH, DRIVE),
        law=sprung(2.0, 0.02, "phiA", "wA", "M_A", 1),
        schemes=("jacobi-constant", "nepce"),
        nudged=("left", "M_B", 1.0),
    ),
    Pair(
        name="libcosim, two chassis on a spring in the master",
        files=dict.fromkeys(BOTH, f"{TRUCK}/Chassis.fmu"),
        law=sprung(2e4, 2e3, "position", "velocity", "force", -1),
        starts=dict.fromkeys(BOTH, ALIKE),
        schemes=("jacobi-constant", "nepce"),
        nudged=("left", "initialPositionY", 1e-3),
        step=1e-2,
        amplitude=1e3,
    ),
    Pair(
        name="OMSimulator, dual mass oscillator (OpenModelica)",
        files={"left": f"{MASSES}1", "right": f"{MASSES}2"},
        wires=(("left.x1", "right.x1"), ("left.v1", "right.v1"), ("right.F", "left.F")),
        schemes=(
            "jacobi-constant", "jacobi-linear", "gauss-seidel-constant-left-first",
            "gauss-seidel-linear-right-first",
        ),
        nudged=("left", "x1_start", 1.0),
    ),
    Pair(
        name="OMSimulator, quarter car (OpenModelica)",
        files={"chassis": f"{CAR}.Chassis", "wheel": f"{CAR}.Wheel"},
        wires=(
            ("chassis.z_c", "wheel.z_c"), ("chassis.der_z_c", "wheel.der_z_c"),
            ("wheel.F", "chassis.F"),
        ),
        schemes=(
            "jacobi-constant", "gauss-seidel-constant-chassis-first",
            "gauss-seidel-constant-wheel-first", "gauss-seidel-linear-chassis-first",
        ),
        nudged=("wheel", "z", 0.1),
    ),
)  # fmt: skip


def found_in(folder: Path, suffix: str, into: Path) -> Path:
    """An FMU by the end of its path; of a folder that holds one unpacked, packed."""
    places = [p for p in folder.rglob(Path(suffix).name) if p.as_posix().endswith(suffix)]
    if not places:
        raise FileNotFoundError(f"{folder}: has no {suffix}")
    place = places[0]
    if place.is_file():
        return place
    packed = into / f"{place.name}.fmu"
    with zipfile.ZipFile(packed, "w") as archive:
        for file in sorted(place.rglob("*")):
            if file.is_file():
                archive.write(file, file.relative_to(place))
    return packed


def packed(pair: Pair, folder: Path, into: Path) -> tuple[Path, Path, Path | None]:
    """The pair as an SSP file, once more with another start, and its law."""
    files = {name: describe_file(found_in(folder, s, into)) for name, s in pair.files.items()}
    wires = [Connection(*a.split(".", 1), *b.split(".", 1)) for a, b in pair.wires]
    owner, nudged, by = pair.nudged
    law = into / "law.toml"
    law.write_text(pair.law, encoding="utf-8")
    paths = []
    for name, more in (("pair", {}), ("nudged", {owner: {nudged: by}})):
        parts = [
            Part(
                name=part, description=description,
                starts={**pair.starts.get(part, {}), **more.get(part, {})},
            )
            for part, description in files.items()
        ]  # fmt: skip
        paths.append(write_ssp(into / f"{name}.ssp", parts, wires))
    return paths[0], paths[1], law if pair.law else None


def rows(path: Path, law: Path | None, scheme: str, h: float) -> FloatArray:
    """Outputs at communication points, until they are out of all bounds."""
    with open_ssp(path, law=law) as loaded:
        system = System(loaded.components, loaded.connections)
        initialise(system, loaded.fmus, 0.0, (STEPS + 1) * h, TOLERANCE)
        known = members(tuple(fmu.name for fmu in loaded.fmus))
        stepper = known[scheme].scheme.start(system)
        system.begin(0.0)
        found = np.empty((STEPS, len(system.outputs)))
        for n in range(STEPS):
            stepper.step(n * h, h)
            found[n] = system.outputs
            if not np.abs(found[n]).max() < LARGE:
                return found[:n]
        return found


def growth(paths: Sequence[Path], law: Path | None, scheme: str, h: float) -> float:
    """Rate (1/s) of the fastest-growing motion with steps of h (s)."""
    try:
        one, other = (rows(path, law, scheme, h) for path in paths)
    except ComponentError:
        return np.inf
    if min(len(one), len(other)) < STEPS:
        return np.inf
    # What stands, or runs at one speed, is no motion that grows.
    free = np.diff(other - one, n=2, axis=0)
    size = np.abs(free).max(axis=1)
    there = int(np.flatnonzero(size > GONE * size.max())[-1]) + 1
    if there < 2 * LATE:
        return float(np.log(GONE)) / (there * h)
    free = free[LATE:there]
    size = np.abs(free).max(axis=0)
    free = free[:, size > 1e-9 * size.max()]
    return fastest((free / np.abs(free).max(axis=0)).astype(complex)) / h


def limit(paths: Sequence[Path], law: Path | None, scheme: str, guess: float) -> float:
    """Step (s) at which runs begin to grow; NaN if it is not within a half of the guess."""
    for apart in APART:
        low, high = guess * (1.0 - apart), guess * (1.0 + apart)
        a, b = (growth(paths, law, scheme, h) for h in (low, high))
        if a < 0.0 < b:
            for _ in range(6 if apart > APART[0] or not np.isfinite(b) else 0):
                middle = 0.5 * (low + high)
                rate = growth(paths, law, scheme, middle)
                low, high, a, b = (low, middle, a, rate) if rate > 0 else (middle, high, rate, b)
            return low + (high - low) * (a / (a - b) if np.isfinite(b) else 0.5)
    return np.nan


def measured(pair: Pair, folder: Path) -> list[list[str]]:
    """By scheme: limits predicted and simulated, and how the FMUs were linearised."""
    with tempfile.TemporaryDirectory() as into:
        *paths, law = packed(pair, folder, Path(into))
        stable = system_stability(
            paths[0], pair.schemes, law=law, step=pair.step, amplitude=pair.amplitude
        )
        way = " and ".join(sorted({*stable.ways.values(), *stable.doubts.values()}))
        made = []
        for scheme in pair.schemes:
            predicted = stable.limits[scheme].step
            simulated = limit(paths, law, scheme, predicted) if np.isfinite(predicted) else np.nan
            made.append([pair.name, scheme, f"{predicted:.4g}", f"{simulated:.4g}", way])
        return made


def main() -> None:
    """Print all, beside what was kept last; keep it if asked."""
    warnings.simplefilter("ignore")
    folder, keep = Path(sys.argv[1]), sys.argv[3:4] if "--keep" in sys.argv else []
    before: dict[tuple[str, str], dict[str, str]] = {}
    if KEPT.is_file():
        with KEPT.open(newline="", encoding="utf-8") as file:
            before = {(row["pair"], row["scheme"]): row for row in csv.DictReader(file)}
    table = Table("pair", "scheme", "predicted, s", "simulated, s", "off by", "kept last")
    made: list[list[str]] = []
    for pair in track(PAIRS, "pairs", console=CONSOLE):
        try:
            made += measured(pair, folder)
        except (ValueError, OSError, ComponentError) as error:
            table.add_row(pair.name, "-", "refused", " ".join(str(error).split())[:90])
    for name, scheme, predicted, simulated, _ in made:
        last = before.get((name, scheme))
        was = f"{last['predicted']}, {last['simulated']}" if last else "new"
        off = f"{float(predicted) / float(simulated) - 1.0:+.1%}"
        table.add_row(name, scheme, predicted, simulated, off, was)
    CONSOLE.print(table)
    if keep:
        is_new = not KEPT.is_file()
        today = [time.strftime("%Y-%m-%d"), *keep]
        with KEPT.open("a", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerows([COLUMNS] * is_new + [[*row, *today] for row in made])


if __name__ == "__main__":
    main()
