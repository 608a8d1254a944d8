"""The largest stable step, predicted from the linear FMUs and found by running the FMUs.

Every scheme, owner of the contact and contact stiffness, wheels held; Hertz's law is linearised at
the static load for the prediction, and kicked a little for the simulation. The owner of the contact
integrates it exactly in the prediction; at 8 GN/m its `internal_step` is 0.01 ms here, so that it
nearly does. Rows are added to a table as they are found; those it has are left out. All of them
take about an hour of one core.

    OPENBLAS_NUM_THREADS=1 python benchmarks/stability.py TABLE.csv [OWNERS [K_H [SCHEMES]]]

Several of a kind with commas; K_H is in N/m, as 1e8,1e9,8e9, or hertz.
"""

from __future__ import annotations

import csv
import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from railcosim.analysis.pair.linear_pair import Part, linear_parts
from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.analysis.schemes.catalogue import members
from railcosim.analysis.schemes.growth import Bench, Kick
from railcosim.analysis.schemes.stability import (
    LONGEST,
    Coupling,
    SprungPair,
    Window,
    static_stiffness,
)
from railcosim.fmus.export import export
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

INTERNAL_STEP = {"8e9": 1e-5}  # s, of the owner of the contact; else its default
STIFFNESS = ("1e8", "1e9", "8e9", "hertz")  # N/m
KICK = {True: 1e-8, False: 1e-6}  # m, by whether the law is nonlinear
MOST = {True: 1e3, False: 1e6}  # growth of the forces; of a kick of 10 N to 10 kN
HEADINGS = ("contact in", "N/m", "scheme", "predicted ms", "simulated ms", "difference %", "CPU s")


def ms(step: float) -> str:
    """A step for the table."""
    return "inf" if math.isinf(step) else f"{1e3 * step:.4g}"


def first_fast(coupling: Coupling) -> Window | None:
    """The first window of fast growth: most are early, so the search goes on only as needed."""
    for longest in LONGEST * np.array([0.01, 0.03, 0.1, 0.3, 1.0]):
        found = coupling.limit(float(longest)).windows
        window = next((w for w in found if w.is_fast), None)
        # One that ends where the search did may only look so.
        if window is not None and (longest == LONGEST or window.begin < 0.9 * longest):
            return window
    return None


def one_side(
    folder: Path,
    parts: tuple[Part, ...],
    owner: Owner,
    stiffness: str,
    names: list[str],
    done: set[tuple[str, ...]],
) -> Iterator[tuple[str, ...]]:
    """Rows of all schemes with one owner and one stiffness, without those done."""
    nonlinear = stiffness == "hertz"
    parameters: dict[str, float | bool] = {"contact.nonlinear": nonlinear}
    if nonlinear:
        k = float(
            np.max(static_stiffness(folder / "Vehicle.fmu", folder / "Track.fmu", parameters))
        )
    else:
        k = float(stiffness)
        parameters["contact.stiffness"] = k
    kick = Kick(KICK[nonlinear])
    journey = Journey(speed=50.0, held=True, profile=kick)
    files = (folder / f"{name}.fmu" for name in FMUS[owner])
    if stiffness in INTERNAL_STEP and owner is not Owner.MASTER:
        parameters["internal_step"] = INTERNAL_STEP[stiffness]
    with open_pair(*files, parameters, journey) as pair:
        springs = SprungPair(parts, owner, k)
        bench = Bench(pair, kick, MOST[nonlinear], springs.exact)
        for name in names:
            member = members()[name]
            if owner not in member.owners:
                continue
            if (owner.value, stiffness, name) in done:
                continue
            begun = time.process_time()
            first = first_fast(Coupling(springs, member.scheme))
            predicted, end = (first.begin, first.end) if first else (math.inf, math.inf)
            found = bench.limit(member.scheme, predicted, end) if predicted > 0.0 else math.nan
            both = math.isinf(predicted) and math.isinf(found)
            difference = 0.0 if both else 100 * (found / predicted - 1) if predicted else math.nan
            spent = time.process_time() - begun
            yield (owner.value, stiffness, name, ms(predicted), ms(found), f"{difference:+.2f}",
                   f"{spent:.0f}")  # fmt: skip


def main() -> None:
    """Append to the table what it lacks."""
    table = Path(sys.argv[1])
    given = [argument.split(",") for argument in sys.argv[2:]]
    owners = given[0] if given else [owner.value for owner in Owner]
    stiffness = given[1] if len(given) > 1 else STIFFNESS
    names = given[2] if len(given) > 2 else [n for n, member in members().items() if member.linear]
    if not table.exists():
        table.write_text(",".join(HEADINGS) + "\n")
    with table.open() as file:
        done = {tuple(row[:3]) for row in csv.reader(file)}
    with TemporaryDirectory() as folder, table.open("a", buffering=1) as file:
        write = csv.writer(file, lineterminator="\n").writerow
        export(Vehicle(), Track(), Path(folder))
        files = (Path(folder) / f"{name}.fmu" for name in ("Vehicle", "Track"))
        parts = linear_parts(*files, lambda done, total: None)
        for owner in owners:
            for k in stiffness:
                for row in one_side(Path(folder), parts, Owner(owner), k, names, done):
                    write(row)


if __name__ == "__main__":
    main()
