"""A folder of anybody's FMUs, run here and by FMPy, one by one: what was equal, what was refused.

    python benchmarks/public.py FOLDER [TABLE.csv]

Each FMU for Co-Simulation, FMI 2.0 or 3.0, runs by itself over its default experiment, inputs at
their start values, at most `MOST` communication steps; once in this master, once in FMPy's
`simulate_fmu`, each in a process of its own. Their code is run. Files of the same bytes are one.
Nothing is downloaded: FMUs of public projects are where you have put them.
"""

from __future__ import annotations

import contextlib
import csv
import hashlib
import os
import subprocess
import sys
import tempfile
import warnings
import zipfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

CONSOLE = Console()
LIMIT = 60.0
"""Seconds that a run may take."""
MOST = 500
"""Communication steps of a run."""
CLOSE = 1e-9
"""Difference that counts as none, of the largest value of an output."""


@dataclass(frozen=True)
class Span:
    """Start, stop and step of a run, s."""

    start: float
    stop: float
    step: float

    @classmethod
    def of(cls, experiment: object) -> Span:
        """A default experiment, shortened to `MOST` steps; 1 s in 100 steps where it is silent."""
        values = (getattr(experiment, name, None) for name in ("startTime", "stopTime", "stepSize"))
        start, stop, step = (None if v is None else float(v) for v in values)
        begin = start or 0.0
        end = begin + 1.0 if stop is None or stop <= begin else stop
        step = (end - begin) / 100 if step is None or not 0 < step <= end - begin else step
        n = min(round((end - begin) / step), MOST)
        return cls(begin, begin + n * step, step)


Told = tuple[list[str], NDArray[np.float64], bool]
"""Names of the outputs, a row each step, and whether the FMU ended the run."""


def here(path: Path, span: Span) -> Told:
    """What this master gets of an FMU."""
    from railcosim.master.cosimulation import cosimulate  # noqa: PLC0415  (not in FMPy's process)
    from railcosim.master.fmi.fmu import FmuComponent  # noqa: PLC0415
    from railcosim.master.pace import FixedStep  # noqa: PLC0415
    from railcosim.master.schemes.jacobi import jacobi  # noqa: PLC0415
    from railcosim.master.ssp import initialise  # noqa: PLC0415
    from railcosim.master.system import System  # noqa: PLC0415

    with FmuComponent.load(path, name="a") as fmu:
        system, pace = System([fmu], []), FixedStep(span.step)
        initialise(system, [fmu], span.start, pace.reach(span.start, span.stop))
        points = cosimulate(system, jacobi(degree=0), pace, span.stop, span.start)
        rows = np.array([point.outputs for point in points])
        return [v.name for v in fmu.outputs], rows, bool(points.ended)


def fmpys(path: Path, span: Span) -> Told:
    """The same by FMPy."""
    description = fmpy.read_model_description(path, validate=False)
    names = [
        v.name
        for v in description.modelVariables
        if v.causality == "output" and v.type not in {"String", "Binary", "Clock"} and not v.alias
    ]
    experiment = description.defaultExperiment
    tolerance = getattr(experiment, "tolerance", None)
    result = fmpy.simulate_fmu(
        str(path),
        validate=False,
        start_time=span.start,
        stop_time=span.stop,
        step_size=span.step,
        output_interval=span.step,
        relative_tolerance=None if tolerance is None else float(tolerance),
        fmi_type="CoSimulation",
        output=names,
        set_input_derivatives=False,
    )
    shapes = {v.name: v.shape or () for v in description.modelVariables}
    flat = [
        f"{name}[{','.join(str(i + 1) for i in index)}]" if shapes[name] else name
        for name in names
        for index in np.ndindex(shapes[name])
    ]
    none = np.empty(0)
    rows = [
        np.concatenate([none, *(np.ravel(row[name]).astype(float) for name in names)])
        for row in result
    ]
    return flat, np.array(rows).reshape(len(rows), len(flat)), False


def calls(path: Path, span: Span) -> Told:
    """FMPy's calls with steps of one length: its `simulate_fmu` has them differ by rounding."""
    description, folder = fmpy.read_model_description(path, validate=False), fmpy.extract(path)
    outputs = [v for v in description.modelVariables if v.causality == "output"]
    outputs = [v for v in outputs if v.type not in {"String", "Binary", "Clock"}]
    tolerance = getattr(description.defaultExperiment, "tolerance", None)
    is_third = description.fmiVersion.startswith("3.")
    fmu = (FMU3Slave if is_third else FMU2Slave)(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="a",
    )
    fmu.instantiate()
    stop = span.stop * (1 + 1e-15)
    told = (None if tolerance is None else float(tolerance), span.start, stop)
    if is_third:
        fmu.enterInitializationMode(*told)
    else:
        fmu.setupExperiment(*told)
        fmu.enterInitializationMode()
    fmu.exitInitializationMode()

    def row() -> list[float]:
        values: list[float] = []
        for v in outputs:
            kind = {"Enumeration": "Int64" if is_third else "Integer"}.get(v.type, v.type)
            size = {"nValues": int(np.prod(v.shape))} if is_third else {}
            values += map(float, getattr(fmu, f"get{kind}")([v.valueReference], **size))
        return values

    rows = [row()]
    for k in range(round((span.stop - span.start) / span.step)):
        fmu.doStep(span.start + k * span.step, span.step)
        rows.append(row())
    names = [
        f"{v.name}[{','.join(str(i + 1) for i in index)}]" if v.shape else v.name
        for v in outputs
        for index in np.ndindex(v.shape or ())
    ]
    return names, np.array(rows), False


WAYS = {"here": here, "fmpy": fmpys, "calls": calls}


def one(way: str, path: Path, target: Path) -> None:
    """Run one FMU in this process, and write what came out."""
    span = Span.of(fmpy.read_model_description(path, validate=False).defaultExperiment)
    names, rows, ended = WAYS[way](path, span)
    np.savez(target, names=np.array(names, dtype=str), rows=rows, ended=ended)


@dataclass(frozen=True)
class Outcome:
    """What a run in a process of its own gave: values by output, or why there are none."""

    values: dict[str, NDArray[np.float64]]
    why: str
    ended: bool = False
    """Whether the FMU ended it."""


def ran(way: str, path: Path) -> Outcome:
    """Run one FMU in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "rows.npz"
        command = [sys.executable, __file__, "--one", way, str(path.absolute()), str(target)]
        try:
            done = subprocess.run(
                command, capture_output=True, timeout=LIMIT, check=False, cwd=folder
            )
        except subprocess.TimeoutExpired:
            return Outcome({}, f"took more than {LIMIT:g} s")
        if not target.is_file():
            said = done.stderr.decode(errors="replace").strip().splitlines()
            ended = "" if done.returncode >= 0 else f"ended by signal {-done.returncode} "
            last = said[-1] if said else f"status {done.returncode}"
            last = last.replace(str(path.absolute()), path.name).replace(tempfile.gettempdir(), "")
            return Outcome({}, ended + last.removeprefix("railcosim.master.fmi.archive."))
        with np.load(target) as file:
            values = dict(zip(file["names"].tolist(), file["rows"].T, strict=True))
            return Outcome(values, "", bool(file["ended"]))


def compared(path: Path) -> tuple[str, str]:
    """Verdict of one FMU, and what there is to say."""
    unsuitable = _unsuitable(path)
    if unsuitable:
        return "unsuitable", unsuitable
    ours, theirs = ran("here", path), ran("fmpy", path)
    if ours.why or theirs.why:
        verdicts = {(True, True): "neither", (True, False): "only FMPy", (False, True): "only here"}
        return verdicts[bool(ours.why), bool(theirs.why)], ours.why or theirs.why
    verdict, why = _difference(ours, theirs)
    if verdict == "differs" and _difference(ours, ran("calls", path))[0] != "differs":
        return "equal to its calls", f"and not to simulate_fmu: {why}"
    return verdict, why


def _difference(ours: Outcome, theirs: Outcome) -> tuple[str, str]:
    """By how much the outputs of two runs differ."""
    if not theirs.values:
        return ("differs", theirs.why) if theirs.why else ("equal", "has no output")
    worst, which = 0.0, ""
    for name, rows in theirs.values.items():
        found, n = ours.values.get(name, np.empty(0)), len(rows)
        # Of an FMU that ended the run, FMPy has one row from within the step that was not made.
        expected = rows[:-1] if ours.ended and len(found) == n - 1 else rows
        if len(found) != len(expected):
            return "differs", f"{name}: {len(found)} rows and not {n}"
        size = max(float(np.abs(expected).max()), np.finfo(float).tiny)
        difference = float(np.abs(found - expected).max()) / size
        if not difference <= worst:
            worst, which = difference, name
    if worst == 0.0:
        return "equal", ""
    verdict = "equal to 1e-9" if worst <= CLOSE else "differs"
    return verdict, f"{which} by {worst:.3g} of its largest value"


def _unsuitable(path: Path) -> str:
    """Why an FMU is not one that either could run; empty if it is."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
        description = fmpy.read_model_description(path, validate=False)
    except Exception as error:  # of any kind: strangers' files
        return f"cannot be read: {' '.join(str(error).split())[:100]}"
    if description.fmiVersion == "1.0":
        return "FMI 1.0"
    if description.coSimulation is None:
        return "Model Exchange only"
    platform = fmpy.platform if description.fmiVersion == "2.0" else fmpy.platform_tuple
    ours = f"binaries/{platform}/"
    if not any(n.startswith(ours) and n.endswith(fmpy.sharedLibraryExtension) for n in names):
        return f"no binary for {platform}"
    return ""


def main() -> None:
    """Print a table of verdicts, and write a row each FMU."""
    if sys.argv[1:2] == ["--one"]:
        way, given, target = sys.argv[2:]
        with warnings.catch_warnings(), contextlib.redirect_stdout(sys.stderr):
            warnings.simplefilter("ignore")
            one(way, Path(given), Path(target))
        return
    folder = Path(sys.argv[1])
    counts: Counter[str] = Counter()
    table = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(os.devnull)
    with table.open("w", newline="", encoding="utf-8", buffering=1) as file:
        rows = csv.writer(file)
        rows.writerow(("fmu", "verdict", "why"))
        seen: dict[bytes, Path] = {}
        for path in track(sorted(folder.rglob("*.fmu")), "running", console=CONSOLE):
            first = seen.setdefault(hashlib.sha256(path.read_bytes()).digest(), path)
            same = "the same as", str(first.relative_to(folder))
            verdict, why = compared(path) if first is path else same
            counts[verdict] += 1
            rows.writerow((str(path.relative_to(folder)), verdict, why))
    for verdict, n in counts.most_common():
        CONSOLE.print(f"{n:4} {verdict}")


if __name__ == "__main__":
    main()
