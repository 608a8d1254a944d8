"""Numbers that a change of structure must not change, against those stored beside this file.

No answer of their own: whether a number is true is asked elsewhere. Here is asked whether it is
still the same, over everything that a rebuilding touches: the four FMUs and their descriptions, the
numpy twins, responses, a map, largest stable steps, and every scheme on the pair.

    python tests/frozen/test_frozen.py            how far each is from what is stored, and the bits
    python tests/frozen/test_frozen.py --store    store them anew, with a reason in the commit
    python tests/frozen/test_frozen.py --words    the descriptions only
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import platform
import sys
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from railcosim.analysis.pair.export_pair import export_pair
from railcosim.analysis.pair.linear_pair import linear_parts
from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.analysis.response.frequency import coupled, on_rigid_track, response
from railcosim.analysis.response.models import linear_models
from railcosim.analysis.response.plane import plane, transfer
from railcosim.analysis.schemes.catalogue import members
from railcosim.analysis.schemes.stability import Coupling, SprungPair
from railcosim.fmus.export import WITH_STATES
from railcosim.master.component import Hold
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.parameters import Vehicle

HERE = Path(__file__).parent
ARRAYS, WORDS = HERE / "frozen.npz", HERE / "frozen.json"
SPEED, STIFFNESS = 250 / 3.6, 1e9  # m/s, N/m
NAMES = ("Vehicle", "Track", "VehicleWithContact", "TrackWithContact")

# Of the largest number of an array. On the machine (processor, numpy, scipy) that stored them, only
# the order of sums may change: 1e-14 a step, some tens of steps, contacts that multiply by ten.
# Elsewhere eigenvectors are rounded otherwise, and then to the single precision of the mode shapes.
SAME_MACHINE, OTHER_MACHINE = 1e-11, 1e-6

Arrays = dict[str, np.ndarray]


def machine() -> str:
    """What decides how sums and eigenvectors are rounded."""
    cpu = Path("/proc/cpuinfo")
    model = cpu.read_text(encoding="utf-8") if cpu.is_file() else platform.processor()
    lines = [line for line in model.splitlines() if line.startswith(("model name", "flags"))][:2]
    words = [*lines, np.__version__, sys.modules["scipy"].__version__, sys.platform]
    return hashlib.sha256("\n".join(words).encode()).hexdigest()[:16]


def swings(count: int, t: float) -> np.ndarray:
    """Irregular numbers of magnitude 1 at a time (s), another for each of `count`."""
    k = np.arange(1, count + 1)
    return np.sin(900.0 * t * np.sqrt(k) + k) + 0.5 * np.sin(5300.0 * t / np.sqrt(k) + k**2)


def rolling(path: Path) -> Arrays:
    """An FMU alone: 60 steps of three kinds of hold, then steps of other lengths."""
    scale = {"force_z": 2e4, "wheel_z": 1e-4, "rail_z": 1e-4, "irregularity_z": 2e-5}
    with FmuComponent.load(path) as fmu:
        fmu.enter_initialization(0.0)
        quantity = [v.name.rpartition(".")[2] for v in fmu.inputs]
        start = np.array([v.start for v in fmu.inputs])
        start += [{"wheel_z": 1.5e-3, "rail_z": -1e-4}.get(q, 0.0) for q in quantity]
        run = np.array([SPEED if q == "position" else 0.0 for q in quantity])
        size = np.array([scale.get(q, 0.0) for q in quantity])
        fmu.set_inputs(start)
        fmu.exit_initialization()
        t, rows = 0.0, [fmu.get_outputs()]
        for k in range(75):
            h = 1e-4 if k < 60 else 1.7e-4 + 1e-5 * k
            fmu.set_hold(list(Hold)[k // 20 % 3])
            fmu.set_inputs(start + run * t + size * swings(start.size, t))
            fmu.do_step(t, h)
            t += h
            if k % 5 == 4:
                rows.append(fmu.get_outputs())
        rates, change = fmu.output_rates(), fmu.step_derivative()
        assert rates is not None
        assert change is not None
        size[run > 0] = 1e-3  # m: how an input counts among the others
        return {"run": np.array(rows), "rates": rates, "change": change * size}


def twins(path: Path) -> Arrays:
    """The reference run of the numpy twin, which the FMU carries as a table."""
    with zipfile.ZipFile(path) as archive:
        text = archive.read(f"documentation/{path.stem}_ref.csv").decode()
    return {"twin": np.array(list(csv.reader(io.StringIO(text)))[1::20], dtype=float)[:, 1:]}


def responses(folder: Path) -> Arrays:
    """A frequency response, and a map."""
    models = linear_models(folder / "Vehicle.fmu", folder / "Track.fmu", lambda a, b: None)
    omega = 2 * np.pi * np.geomspace(0.5, 1500, 12)
    systems = {
        "coupled": coupled(models, omega, STIFFNESS),
        "rigid": on_rigid_track(models, omega, STIFFNESS),
    }
    found = {
        f"{name}.{excitation}": response(system, excitation, models.positions, SPEED)
        for name, system in systems.items()
        for excitation in ("wheelset[4].force_z", "wheelset[2].irregularity_z", "irregularity_z")
    }
    outputs = ["vehicle.carbody.z", "vehicle.bogie[1].pitch", "track.wheelset[4].left.rail_z"]
    table = transfer(lambda w: coupled(models, w, STIFFNESS), outputs, 1.0, 60.0)
    wavelength, speed = np.geomspace(2.0, 20.0, 5), np.array([25.0, 60.0, 100.0])
    found["map"] = plane(table, models.positions, wavelength, speed)
    return found | {"positions": models.positions}


def stable_steps(folder: Path) -> Arrays:
    """Growth at some steps, and largest stable steps: edges, by bisection to 0.05 %."""
    parts = linear_parts(folder / "Vehicle.fmu", folder / "Track.fmu", lambda a, b: None)
    known, found = members(), {}
    for owner, name in (
        (Owner.TRACK, "jacobi-linear"),
        (Owner.VEHICLE, "gauss-seidel-linear-vehicle-first"),
        (Owner.MASTER, "jacobi-linear"),
        (Owner.MASTER, "interface-jacobian-hermite"),
    ):
        coupling = Coupling(SprungPair(parts, owner, STIFFNESS), known[name].scheme)
        growth = [coupling.growth(h) for h in (1e-5, 1e-4, 4e-4)]
        found[f"growth.{owner}.{name}"] = np.array(growth)
        if owner is Owner.TRACK:
            windows = coupling.limit(longest=5e-4).windows
            edges = [(w.begin, w.end, w.growth) for w in windows]
            found[f"edges.{owner}.{name}"] = np.array(edges).ravel()
    return found


def coupled_runs(folder: Path) -> Arrays:
    """Every scheme on the rolling pair, 30 steps of 0.05 ms from the same rest."""
    journey = Journey(speed=SPEED, held=False, profile=synthesise("german-low", 2.0))
    found: Arrays = {}
    for owner in Owner:
        vehicle, track = (folder / f"{name}.fmu" for name in FMUS[owner])
        with open_pair(vehicle, track, {"contact.nonlinear": True}, journey) as pair:
            system, rest = pair.system, pair.system.save_state()
            for name, member in members().items():
                if member.owners[0] is not owner and name != "jacobi-linear":
                    continue
                system.restore_state(rest)
                step = 5e-5 if member.owners[0] is owner else 5e-6  # else it grows
                rows = [
                    p.outputs.copy() for p in cosimulate(system, member.scheme, step, 30 * step)
                ]
                found[f"scheme.{owner}.{name}"] = np.array(rows[::15])
    return found


def words(folder: Path) -> dict[str, object]:
    """Names in their order, and a digest of what depends on what, of each description."""
    found: dict[str, object] = {}
    for name in NAMES:
        with zipfile.ZipFile(folder / f"{name}.fmu") as archive:
            root = ElementTree.fromstring(archive.read("modelDescription.xml"))
            bus = archive.read("terminalsAndIcons/terminalsAndIcons.xml")
        variables = [v.attrib for v in root.find("ModelVariables")]  # type: ignore[union-attr]
        # States' names are numbered; those of the interface are the users'.
        shown = [v for v in variables if v["causality"] != "local"]
        structure = [(e.tag, sorted(e.attrib.items())) for e in root.find("ModelStructure").iter()]  # type: ignore[union-attr]
        told = [{k: v for k, v in row.items() if k not in ("name", "nominal")} for row in shown]
        found[name] = {
            "variables": [v["name"] for v in shown],
            "described": _digest(told),
            "structure": _digest(structure),
            "terminals": _digest(bus.decode()),
        }
    return found


def _digest(thing: object) -> str:
    return hashlib.sha256(json.dumps(thing, sort_keys=True).encode()).hexdigest()[:16]


def numbers(folder: Path) -> Arrays:
    """All of them."""
    found = {}
    for name in NAMES:
        path = folder / f"{name}.fmu"
        found |= {f"{name}.{k}": v for k, v in (rolling(path) | twins(path)).items()}
    return found | responses(folder) | stable_steps(folder) | coupled_runs(folder)


def exported_into(folder: Path) -> Path:
    """FMUs on the shortest ring with room to spare."""
    mesh = Mesh(cells=6, highest_slab_frequency=800, highest_frequency=1500)
    export_pair(Vehicle(), Track(mesh=mesh), folder, runtime=WITH_STATES)
    return folder


def differences(old: Arrays, new: Arrays) -> dict[str, float]:
    """Of each array, relative to the largest number in its column (along the last axis)."""
    found = {}
    for name, array in old.items():
        now = new.get(name)
        if now is None or now.shape != array.shape:
            found[name] = np.inf
            continue
        size = np.abs(array, where=np.isfinite(array), out=np.zeros(array.shape))
        most = size.max(initial=1e-300)
        column = size.max(axis=tuple(range(max(1, array.ndim - 1))), keepdims=True, initial=0.0)
        column[column < 1e-12 * most] = most  # of rounding: held against the largest of all
        same = (now == array) | (np.isnan(now) & np.isnan(array))
        off = np.where(same, 0.0, np.subtract(now, array, where=~same, out=np.zeros_like(array)))
        found[name] = float((np.abs(off) / column).max(initial=0.0))
    return found | {name: np.inf for name in new if name not in old}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Whole FMUs: those of other tests come without what people look at."""
    return exported_into(tmp_path_factory.mktemp("frozen"))


def test_the_same_words(folder: Path) -> None:
    """Names, order, units, ranges, starts, dependencies and terminals of the four FMUs."""
    stored = json.loads(WORDS.read_text(encoding="utf-8"))
    for name, known in words(folder).items():
        assert known == stored["words"][name], name


@pytest.mark.parametrize("kind", [rolling, twins], ids=lambda f: f.__name__)
def test_the_same_fmus(folder: Path, kind: Callable[[Path], Arrays]) -> None:
    found = {}
    for name in NAMES:
        found |= {f"{name}.{k}": v for k, v in kind(folder / f"{name}.fmu").items()}
    _hold(found)


@pytest.mark.parametrize("kind", [responses, stable_steps, coupled_runs], ids=lambda f: f.__name__)
def test_the_same_pair(folder: Path, kind: Callable[[Path], Arrays]) -> None:
    _hold(kind(folder))


def _hold(found: Arrays) -> None:
    here = json.loads(WORDS.read_text(encoding="utf-8"))["machine"] == machine()
    with np.load(ARRAYS) as stored:
        old = {name: stored[name] for name in found}
    off = differences(old, found)
    # A bisection that rounds otherwise ends within the 0.05 % that an edge is known to; growth is
    # the logarithm of a number near 1 over a step of 10 microseconds; soon after rest accelerations
    # and speeds are differences of numbers a hundred times as large.
    special = {"edges": 1e-3, "growth": OTHER_MACHINE, "scheme": 1e-9 if here else OTHER_MACHINE}
    usual = SAME_MACHINE if here else OTHER_MACHINE
    wrong = {n: x for n, x in off.items() if not x <= special.get(n.partition(".")[0], usual)}
    assert not wrong, wrong


def main() -> None:
    """Compare with what is stored, or store."""
    with tempfile.TemporaryDirectory() as place:
        folder = exported_into(Path(place))
        told = words(folder)
        if "--words" in sys.argv:
            content = json.loads(WORDS.read_text(encoding="utf-8")) | {"words": told}
            WORDS.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
            return
        found = numbers(folder)
    if "--store" in sys.argv:
        np.savez_compressed(ARRAYS, **found)
        content = {"machine": machine(), "words": told}
        WORDS.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        return
    with np.load(ARRAYS) as stored:
        old = dict(stored)
    for name, off in differences(old, found).items():
        same = name in found and name in old and np.array_equal(old[name], found[name], True)
        print(f"{'same bits' if same else f'{off:9.1e}'}  {name}")
    stored_words = json.loads(WORDS.read_text(encoding="utf-8"))["words"]
    print("words:", {name: told[name] == known for name, known in stored_words.items()})


if __name__ == "__main__":
    main()
