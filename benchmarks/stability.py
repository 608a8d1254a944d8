r"""The largest stable step, predicted from the linear FMUs and found by running the FMUs.

Every train, scheme, owner of the contact and contact stiffness, wheels held; Hertz's law is
linearised at the static load for the prediction. The motion that is predicted to grow fastest is
driven softly and left alone, just below and just above the predicted limit; where growth passes 1/s
is the simulated one. `at ms` is the step above, with the growth predicted and measured there. The
owner of the contact integrates it exactly in the prediction; at 8 GN/m and in space its
`internal_step` is 0.02 ms here, so that it nearly does. Rows are added to a table as they are
found; those it has are left out.

In space wheels roll, under Hertz's law and creep that friction bounds, both linear for the
prediction: there is no other stiffness than hertz. What learns within a step is not predicted: the
step is that up to which nothing was seen to grow after a kick.

    OPENBLAS_NUM_THREADS=1 python benchmarks/stability.py TABLE.csv \
        [TRAINS [OWNERS [K_H [SCHEMES]]]]

Several of a kind with commas; K_H is in N/m, as 1e8,1e9,8e9, or hertz.
"""

from __future__ import annotations

import csv
import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from railcosim.analysis.pair.contact import Stiffness
from railcosim.analysis.pair.linear_pair import Part, linear_parts
from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.analysis.pair.static_load import static_stiffness
from railcosim.analysis.schemes.catalogue import members
from railcosim.analysis.schemes.disturbed import Disturbance
from railcosim.analysis.schemes.growth import Bench, kicked_steps
from railcosim.analysis.schemes.run_limit import CERTAIN, limit_in_runs
from railcosim.analysis.schemes.stability import FAST, LONGEST, Coupling, SprungPair, Window
from railcosim.fmus.export import WITH_STATES, export
from railcosim.master.schemes import Scheme
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.parameters import Coupler, Vehicle
from railcosim.vehicle.train import Train, train_of

INTERNAL_STEP = {"8e9": 2e-5}  # s, of the owner of the contact; else its default,
IN_SPACE = 2e-5  # or this: with 0.1 ms `jacobi-quadratic` is stable to 1.3 % longer steps there
STIFFNESS = ("1e8", "1e9", "8e9", "hertz")  # N/m
FIRST_STEP = LONGEST / 1.5**14  # s: 0.034 ms, of schemes that are not predicted
ANY = (2e-6, 5e-6, 1e-5, 2e-5, 5e-5, 1e-4)  # s: steps of schemes that are said to grow at any
# What pairs in space run by until their axles have found their speed, at 0.1 ms.
SETTLING = {
    Owner.TRACK: "gauss-seidel-linear-vehicle-first",
    Owner.VEHICLE: "iqn-ils-linear",
    Owner.MASTER: "interface-jacobian",
}
HEADINGS = (
    "train", "contact in", "N/m", "scheme", "predicted ms", "simulated ms", "difference %",
    "at ms", "predicted 1/s", "measured 1/s", "CPU s",
)  # fmt: skip


# Of other trains, on a ring shorter than is promised: both sides have the same one.
SHORT = {"highest_slab_frequency": 800, "highest_frequency": 3000}
WAGON, LOCOMOTIVE = Path("wagon"), Path(__file__).parents[1] / "examples" / "locomotive.toml"
SOFT = Coupler(stiffness=2e5, damping=1e4)


@dataclass(frozen=True)
class Case:
    """A train on a ring, and how it is met."""

    stock: Callable[[], Vehicle | Train]
    mesh: Mesh
    dimension: str = "vertical"
    speed: float = 50.0  # m/s

    @property
    def aside(self) -> bool:
        """Whether its wheels roll."""
        return self.dimension == "spatial"


# That of tests/system/test_spatial_stability.py; 30 m/s, since the vehicle hunts from 40 on.
TINY = Mesh(cells=6, elements_per_bay=2, highest_slab_frequency=200, highest_frequency=400)
TRAINS = {
    "vehicle": Case(Vehicle, Mesh()),
    "wagon": Case(lambda: read_stock(WAGON), Mesh(cells=6, **SHORT)),
    "locomotive": Case(lambda: read_stock(LOCOMOTIVE), Mesh(cells=6, **SHORT)),
    "two wagons": Case(lambda: several(2, WAGON), Mesh(cells=8, **SHORT)),
    "eight vehicles": Case(lambda: several(8, Path("paper")), Mesh(cells=40, **SHORT)),
    "spatial vehicle": Case(Vehicle, TINY, "spatial", 30.0),
    "spatial vehicle, full track": Case(Vehicle, Mesh(), "spatial", 30.0),
}


def several(count: int, kind: Path) -> Train:
    """Several of one kind, coupled."""
    return replace(train_of(read_stock(kind, count)), coupler=SOFT)


def ms(step: float) -> str:
    """A step for the table."""
    return "inf" if math.isinf(step) else f"{1e3 * step:.4g}"


def first_fast(coupling: Coupling) -> Window | None:
    """The first window of fast growth: most are early, so the search goes on only as needed."""
    for longest in LONGEST * np.array([0.01, 0.03, 0.1, 0.3, 1.0]):
        found = coupling.limit(float(longest)).windows
        window = next((w for w in found if math.isfinite(w.fast)), None)
        # One that ends where the search did may only look so.
        if window is not None and (longest == LONGEST or window.fast < 0.9 * longest):
            return window
    return None


def one_side(
    folder: Path,
    case: Case,
    parts: tuple[Part, ...],
    owner: Owner,
    stiffness: str,
    names: Sequence[str],
) -> Iterator[tuple[str, ...]]:
    """Rows of all schemes with one owner and one stiffness."""
    nonlinear = stiffness == "hertz"
    parameters: dict[str, float | bool] = {"contact.nonlinear": nonlinear}
    k: Stiffness
    if nonlinear:
        pair = folder / "Vehicle.fmu", folder / "Track.fmu"
        k = static_stiffness(*pair, parameters, speed=case.speed)
    else:
        k = float(stiffness)
        parameters["contact.stiffness"] = k
    disturbance = Disturbance()
    journey = Journey(speed=case.speed, held=True, profile=disturbance)
    cars, rails = (folder / f"{name}.fmu" for name in FMUS[owner])
    internal = IN_SPACE if case.aside else INTERNAL_STEP.get(stiffness)
    if internal is not None and owner is not Owner.MASTER:
        parameters["internal_step"] = internal
    with open_pair(cars, rails, parameters, journey) as pair:
        springs = SprungPair(parts, owner, k)
        rolls = members()[SETTLING[owner]].scheme if case.aside else None
        bench = Bench(pair, disturbance, rolls)
        for name in names:
            member = members()[name]
            begun = time.process_time()
            if member.linear:
                coupling = Coupling(springs, member.scheme)
                told = figures(bench, coupling, member.scheme, first_fast(coupling))
            else:
                told = seen(bench, member.scheme, springs.exact + FAST)
            yield (owner.value, stiffness, name, *told, f"{time.process_time() - begun:.0f}")


def figures(
    bench: Bench, coupling: Coupling, scheme: Scheme, first: Window | None
) -> tuple[str, ...]:
    """What a row says of a scheme."""
    if first is not None and first.fast <= 0.0:
        return at_any(bench, coupling, scheme)
    found = limit_in_runs(bench, scheme, coupling, first)
    predicted = first.fast if first else math.inf
    both = math.isinf(predicted) and math.isinf(found.step)
    difference = 0.0 if both else 100.0 * (found.step / predicted - 1.0)
    return (ms(predicted), ms(found.step), f"{difference:+.2f}",
            ms(found.at), f"{found.predicted:.4g}", f"{found.measured:.4g}")  # fmt: skip


def at_any(bench: Bench, coupling: Coupling, scheme: Scheme) -> tuple[str, ...]:
    """The same of a scheme that is said to grow at any step: whether it does at each of `ANY`.

    After a kick, which ends as a mixture of all that grows. The step simulated is the longest at
    which nothing grew, and the rates are those of the first.
    """
    found = [(h, coupling.growth(h), bench.kicked(scheme, h)) for h in ANY]
    held = max((h for h, _, measured in found if measured <= coupling.fast), default=0.0)
    at, predicted, measured = found[0]
    return ("0", ms(held), "", ms(at), f"{predicted:.4g}", f"{measured:.4g}")


def seen(bench: Bench, scheme: Scheme, most: float) -> tuple[str, ...]:
    """The same of a scheme that learns within a step: the longest of some steps, one after another.

    The next is half as long again; it grew there, at the rate told, or `LONGEST` was reached.
    """
    held, h, rate = 0.0, FIRST_STEP, -math.inf
    while h <= LONGEST * 1.0001:
        rate = bench.kicked(scheme, h)
        if rate > most and rate * kicked_steps(h) * h > 2.0 * CERTAIN:  # else beats of others
            return ("", ms(held), "", ms(h), "", f"{rate:.4g}")
        held, h = h, 1.5 * h
    return ("", "inf", "", ms(held), "", f"{rate:.4g}")


def lacking(
    done: set[tuple[str, ...]], train: str, owner: Owner, k: str, names: Sequence[str]
) -> list[str]:
    """Schemes of which the table has no row."""
    known = members()
    return [
        name
        for name in names
        if owner in known[name].owners and (train, owner.value, k, name) not in done
    ]


def main() -> None:
    """Append to the table what it lacks."""
    table = Path(sys.argv[1])
    every = [list(TRAINS), [owner.value for owner in Owner], list(STIFFNESS),
             [name for name, member in members().items() if member.linear]]  # fmt: skip
    given = [argument.split(",") for argument in sys.argv[2:]]
    trains, owners, stiffness, names = [*given, *every[len(given) :]]
    if not table.exists():
        table.write_text(",".join(HEADINGS) + "\n")
    with table.open() as file:
        done = {tuple(row[:4]) for row in csv.reader(file)}
    for train in trains:
        wanted = {
            (owner, k): some
            for owner in map(Owner, owners)
            for k in stiffness
            if (some := lacking(done, train, owner, k, names))
        }
        if not wanted:
            continue
        with TemporaryDirectory() as folder, table.open("a", buffering=1) as file:
            write = csv.writer(file, lineterminator="\n").writerow
            case = TRAINS[train]
            export(
                case.stock(), Track(mesh=case.mesh), Path(folder),
                dimension=case.dimension, runtime=WITH_STATES,
            )  # fmt: skip
            cars, rails = (Path(folder) / f"{name}.fmu" for name in FMUS[Owner.MASTER])
            parts = linear_parts(cars, rails, lambda done, total: None)
            for (owner, k), some in wanted.items():
                for row in one_side(Path(folder), case, parts, owner, k, some):
                    write((train, *row))


if __name__ == "__main__":
    main()
