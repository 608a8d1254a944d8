"""The largest stable step, predicted from the linear FMUs and found by running the FMUs.

Every scheme, owner of the contact and contact stiffness, wheels held; Hertz's law is linearised at
the static load for the prediction, and kicked a little for the simulation. The last column is of
one wheel on a rail of finite elements, another model: it is there for orientation. The owner of
the contact integrates it exactly in the prediction; its `internal_step` is 0.02 ms here, so that it
nearly does. Takes most of an hour.

    OPENBLAS_NUM_THREADS=1 python benchmarks/stability.py [OWNER[,OWNER] [K_H[,K_H] [SCHEME,...]]]

K_H is in N/m, or hertz.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

from railcosim.analysis.catalogue import FMUS, Owner, members
from railcosim.analysis.growth import Bench, Kick
from railcosim.analysis.linear_pair import Part, linear_parts
from railcosim.analysis.pair import Journey, open_pair
from railcosim.analysis.stability import LONGEST, Contact, Coupling, Window, static_stiffness
from railcosim.fmus.export import export
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

INTERNAL_STEP = 2e-5  # s
STIFFNESS = ("1e8", "1e9", "8e9", "hertz")  # N/m
KICK = {True: 1e-8, False: 1e-6}  # m, by whether the law is nonlinear
MOST = {True: 1e3, False: 1e6}  # growth of the forces; of a kick of 10 N to 10 kN
KNOWN = {  # one wheel on a rail of finite elements, ms, at 0.1, 1 and 8 GN/m
    ("vehicle", "jacobi-constant"): (2.3, 0.41, 0.057),
    ("vehicle", "jacobi-linear"): (1.8, 0.26, 0.033),
    ("vehicle", "jacobi-quadratic"): (1.4, 0.24, 0.038),
    ("track", "jacobi-constant"): (3.8, 1.35, 0.45),
    ("track", "jacobi-linear"): (3.6, 0.96, 0.33),
    ("track", "jacobi-quadratic"): (2.4, 0.57, 0.18),
    ("track", "gauss-seidel-linear-vehicle-first"): (math.inf, 3.4, 3.2),
    ("track", "gauss-seidel-linear-track-first"): (math.inf, 2.2, 0.69),
    ("vehicle", "iqn-ils-linear"): (math.inf, 0.98, 0.22),
    ("track", "iqn-ils-linear"): (math.inf, math.inf, math.inf),
    ("track", "iqn-ils-quadratic"): (math.inf, math.inf, math.inf),
}
console = Console(width=130)


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
    folder: Path, parts: tuple[Part, ...], owner: Owner, stiffness: str, names: list[str]
) -> Table:
    """All schemes with one owner and one stiffness."""
    nonlinear = stiffness == "hertz"
    parameters: dict[str, float | bool] = {"contact.nonlinear": nonlinear}
    if nonlinear:
        k = static_stiffness(folder / "Vehicle.fmu", folder / "Track.fmu", parameters)
    else:
        k = float(stiffness)
        parameters["contact.stiffness"] = k
    table = Table(title=f"contact in {owner.value}, {stiffness}: largest stable step, ms")
    for heading in ("scheme", "predicted", "simulated", "difference", "one wheel, other rail"):
        table.add_column(heading, justify="left" if heading == "scheme" else "right")
    kick = Kick(KICK[nonlinear])
    journey = Journey(speed=50.0, held=True, profile=kick)
    files = (folder / f"{name}.fmu" for name in FMUS[owner])
    inside = {**parameters, "internal_step": INTERNAL_STEP}
    with open_pair(*files, inside, journey) as pair:
        contact = Contact(parts, owner, k)
        bench = Bench(pair, kick, MOST[nonlinear], contact.exact)
        for name in names:
            member = members()[name]
            if owner not in member.owners:
                continue
            begun = time.perf_counter()
            first = first_fast(Coupling(contact, member.scheme))
            predicted, end = (first.begin, first.end) if first else (math.inf, math.inf)
            found = bench.limit(member.scheme, predicted, end) if predicted > 0.0 else math.nan
            both = math.isinf(predicted) and math.isinf(found)
            difference = 0.0 if both else 100 * (found / predicted - 1) if predicted else math.nan
            known = KNOWN.get((owner.value, name), ())
            column = ("1e8", "1e9", "8e9").index(stiffness) if not nonlinear else 3
            cells = (name, ms(predicted), ms(found), f"{difference:+.2f} %",
                     ms(1e-3 * known[column]) if column < len(known) else "")  # fmt: skip
            table.add_row(*cells)
            spent = time.perf_counter() - begun
            print(owner.value, stiffness, *cells, f"{spent:.0f} s", file=sys.stderr, flush=True)
    return table


def main() -> None:
    """Print the tables."""
    given = [argument.split(",") for argument in sys.argv[1:]]
    owners = given[0] if given else [owner.value for owner in Owner]
    stiffness = given[1] if len(given) > 1 else STIFFNESS
    names = given[2] if len(given) > 2 else list(members())
    with TemporaryDirectory() as folder:
        export(Vehicle(), Track(), Path(folder))
        files = (Path(folder) / f"{name}.fmu" for name in ("Vehicle", "Track"))
        parts = linear_parts(*files, lambda done, total: None)
        for owner in owners:
            for k in stiffness:
                console.print(one_side(Path(folder), parts, Owner(owner), k, names))


if __name__ == "__main__":
    main()
