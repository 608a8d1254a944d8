"""What a master costs by itself: two FMUs that do nothing, ours beside FMPy, libcosimpy, ecospy.

OPENBLAS_NUM_THREADS=1 python benchmarks/overhead.py [--keep WHY]

Every contestant is a process of its own, the peers each in an environment that pip makes at first
use and that is kept under the temporary directory. All step the same FMU, Jacobi, in turns of a
few milliseconds, and the least of the turns counts: other work on the machine only adds. The FMU
counts what it is asked, and its last outputs are held against the recursion computed here.

The last table has the same FMU by FMI 2.0 and 3.0, both in our master. ecospy's threads wait for
each other, so it is there a second time, kept to one core. Beside each cost stands what it was when
`overhead.csv` was last written, by --keep.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import tempfile
import venv
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

import fmpy
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Table

from railcosim.compiling.compilers import FLAGS, compiler_for
from railcosim.compiling.platforms import local_platform

HERE = Path(__file__).with_name("overhead")
TURNS, STEPS = 400, 250
IDENTIFIER = "mixer"
SOURCES = {2: "mixer.c", 3: "mixer3.c"}
PEERS = {
    "libcosimpy": ("libcosimpy==0.0.6",),
    "ecospy": ("ecospy==0.7.2",),  # and Debian's libtbb12
}
CONSOLE = Console()
Beside = Callable[[str, float], str]


class Failed(RuntimeError):  # noqa: N818 (it says what happened)
    """A contestant could not be had, or gave up."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """What a runner is given, as JSON.

    Attributes
    ----------
    fmu : str
        The FMU file, to be instantiated twice, as `a` and `b`.
    inputs, outputs : int
        How many each instance has; output i of one feeds input i of the other.
    record : bool
        Whether all outputs are kept at all communication points.
    step : float
        Communication step, s.
    steps : int
        How many will be asked for in all.
    """

    fmu: str
    inputs: int
    outputs: int
    record: bool = False
    step: float = 1e-4
    steps: int = TURNS * STEPS


@dataclass(frozen=True)
class Contestant:
    """Who steps: a label, the runner in `overhead/`, its environment (ours if not given), cores."""

    label: str
    runner: str
    peer: str = ""
    on_one_core: bool = False


OURS = Contestant("railcosim", "railcosim")
CONTESTANTS = (
    Contestant("six calls by ctypes, shared arrays (floor)", "floor"),
    OURS,
    Contestant("FMPy, fmi2SetReal ... with shared arrays", "fmpy_arrays"),
    Contestant("FMPy, setReal ... with lists", "fmpy_lists"),
    Contestant("libcosimpy", "libcosimpy", "libcosimpy"),
    Contestant("ecospy", "ecospy", "ecospy"),
    Contestant("ecospy, on one core", "ecospy", "ecospy", on_one_core=True),
)


class Running:
    """A contestant at work.

    Raises
    ------
    Failed
        If it does not start.
    """

    def __init__(self, contestant: Contestant, job: Job, folder: Path) -> None:
        python = environment(contestant.peer) if contestant.peer else sys.executable
        self.job = job
        self.seconds: list[float] = []
        self._folder = folder
        folder.mkdir()
        given = folder / "job.json"
        given.write_text(json.dumps(asdict(job)), encoding="utf-8")
        self._errors = (folder / "errors").open("w", encoding="utf-8")
        self._process = subprocess.Popen(
            [python, str(HERE / f"run_{contestant.runner}.py"), str(given)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, text=True,
            # What importers unpack and leave behind goes with our folder.
            env=os.environ | {"MIXER_COUNTS": str(folder / "counts"), "TMPDIR": str(folder)},
        )  # fmt: skip
        if contestant.on_one_core:  # before it has other threads, which do as this one
            os.sched_setaffinity(self._process.pid, {min(os.sched_getaffinity(0))})
        self.version = self._answer()

    def step(self, steps: int) -> None:
        """Let it step, and note the time."""
        assert self._process.stdin
        try:
            self._process.stdin.write(f"{steps}\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise Failed(self._why()) from None
        self.seconds.append(float(self._answer()))

    def finish(self) -> tuple[float, float]:
        """Let it end; check what its FMUs were given; give the values set and got a step."""
        self._process.communicate()
        self._errors.close()
        if self._process.returncode:
            raise Failed(self._why())
        rows = sorted((self._folder / "counts").read_text().splitlines())
        counts = np.array([[float(word) for word in row.split()[1:]] for row in rows])
        n = self.job.steps
        counts = counts[counts[:, 0] == n]  # an importer may try others first
        if len(counts) != 2:
            raise Failed(f"{len(counts)} of its FMUs in place of 2 made {n} steps")
        # Rounding alone: the recursion forgets its start by a factor of two each step.
        if not np.allclose(counts[:, 3:], expected(self.job), rtol=1e-14, atol=0):
            raise Failed("its FMUs ended elsewhere: not Jacobi, or values were not passed on")
        _, values_set, values_got = counts[:, :3].sum(axis=0) / n
        return values_set, values_got

    def _answer(self) -> str:
        assert self._process.stdout
        line = self._process.stdout.readline().strip()
        if not line:
            self._process.wait()
            raise Failed(self._why())
        return line

    def _why(self) -> str:
        lines = (self._folder / "errors").read_text(encoding="utf-8").strip().splitlines()
        return lines[-1] if lines else f"exit status {self._process.returncode}"


def environment(peer: str) -> str:
    """The Python that has a peer; made at first use."""
    key = hashlib.sha256(repr((PEERS[peer], sys.version)).encode()).hexdigest()[:8]
    folder = Path(tempfile.gettempdir()) / "railcosim-peers" / f"{peer}-{key}"
    python, ready = folder / "bin" / "python", folder / "ready"
    if not ready.exists():
        with CONSOLE.status(f"installing {peer}"):
            venv.create(folder, with_pip=True, clear=True)
            pip = [str(python), "-m", "pip", "install", "--quiet", *PEERS[peer]]
            done = subprocess.run(pip, capture_output=True, text=True, check=False)
        if done.returncode:
            raise Failed(f"pip install {' '.join(PEERS[peer])} failed: {done.stderr[-300:]}")
        ready.touch()
    return str(python)


def expected(job: Job) -> NDArray[np.float64]:
    """The last outputs of both instances, shape (2, outputs), by the recursion in mixer.c."""
    i = np.arange(job.outputs)
    y = np.zeros((2, job.outputs))
    for k in range(max(job.steps - 100, 0), job.steps):
        u = y[::-1, : job.inputs]
        y = 0.5 * u[:, (i + 1) % job.inputs] + i + (k + 1) % 8
    return y


def make_fmu(folder: Path, inputs: int, outputs: int, fmi: int = 2) -> Path:
    """Compile the mixer for so many inputs and outputs, and pack it."""
    folder.mkdir()
    platform = local_platform()
    library = folder / f"{IDENTIFIER}{platform.suffix}"
    headers = Path(fmpy.__file__).parent / "c-code"
    subprocess.run(
        [*compiler_for(platform).command, *FLAGS, f"-I{headers}", f"-DINPUTS={inputs}",
         f"-DOUTPUTS={outputs}", "-o", str(library), str(HERE / SOURCES[fmi])],
        check=True,
    )  # fmt: skip
    path = folder / f"{IDENTIFIER}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        describe = {2: model_description, 3: model_description_3}[fmi]
        archive.writestr("modelDescription.xml", describe(inputs, outputs))
        where = {2: platform.fmi2, 3: platform.fmi3}[fmi]
        archive.write(library, f"binaries/{where}/{library.name}")
    return path


def model_description(inputs: int, outputs: int) -> str:
    """Nothing depends at once on an input; inputs have the first value references."""
    variables = [
        f'<ScalarVariable name="u[{i}]" valueReference="{i}" causality="input">'
        '<Real start="0"/></ScalarVariable>'
        for i in range(inputs)
    ] + [
        f'<ScalarVariable name="y[{i}]" valueReference="{inputs + i}" causality="output">'
        "<Real/></ScalarVariable>"
        for i in range(outputs)
    ]
    unknowns = "".join(
        f'<Unknown index="{inputs + i + 1}" dependencies=""/>' for i in range(outputs)
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{IDENTIFIER}" guid="{IDENTIFIER}"
    numberOfEventIndicators="0" variableNamingConvention="structured">
  <CoSimulation modelIdentifier="{IDENTIFIER}" canGetAndSetFMUstate="true"
      canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>{"".join(variables)}</ModelVariables>
  <ModelStructure><Outputs>{unknowns}</Outputs>
    <InitialUnknowns>{unknowns}</InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""


def model_description_3(inputs: int, outputs: int) -> str:
    """The same for FMI 3.0; reference 0 is time."""
    variables = [
        f'<Float64 name="u[{i}]" valueReference="{1 + i}" causality="input" start="0"/>'
        for i in range(inputs)
    ] + [
        f'<Float64 name="y[{i}]" valueReference="{1 + inputs + i}" causality="output"/>'
        for i in range(outputs)
    ]
    structure = "".join(
        f'<{kind} valueReference="{1 + inputs + i}" dependencies=""/>'
        for kind in ("Output", "InitialUnknown")
        for i in range(outputs)
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="{IDENTIFIER}" instantiationToken="{IDENTIFIER}">
  <CoSimulation modelIdentifier="{IDENTIFIER}" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent"/>{"".join(variables)}
  </ModelVariables>
  <ModelStructure>{structure}</ModelStructure>
</fmiModelDescription>
"""


def compete(
    title: str, jobs: list[tuple[Contestant, Job]], folder: Path, beside: Beside
) -> dict[str, float]:
    """Measure side by side and print; gives microseconds a step by label, of those that ended."""
    folder.mkdir()
    table = Table("", "version", title=title, caption=f"{TURNS} turns of {STEPS} steps")
    for column in ("least µs a step", "kept", "median", "values set", "got, a step"):
        table.add_column(column, justify="right")
    running: dict[str, Running] = {}
    found: dict[str, float] = {}
    failed: dict[str, Failed] = {}
    for k, (contestant, job) in enumerate(jobs):
        with failures(contestant.label, failed):
            running[contestant.label] = Running(contestant, job, folder / str(k))
    for _ in track(range(TURNS), title, console=CONSOLE, transient=True):
        for label, one in running.items():
            if label not in failed:
                with failures(label, failed):
                    one.step(STEPS)
    for label in [label for label in running if label not in failed]:
        with failures(label, failed):
            values = running[label].finish()
            cost = [1e6 * s / STEPS for s in running[label].seconds]
            found[label] = min(cost)
            before = beside(f"{title}: {label}", 1e-6 * min(cost))
            told = (f"{min(cost):.2f}", before, f"{median(cost):.2f}")
            table.add_row(label, running[label].version, *told, *(f"{v:.1f}" for v in values))
    for label, why in failed.items():
        table.add_row(label, "missing", *"-----")
        CONSOLE.print(f"{label} is missing: {why}", style="yellow")
    CONSOLE.print(table)
    return found


@contextmanager
def failures(label: str, failed: dict[str, Failed]) -> Iterator[None]:
    """Note a failure; the others go on."""
    try:
        yield
    except Failed as why:
        failed[label] = why


def main() -> None:
    """Print the tables, and what they say."""
    from kept import Memory  # noqa: PLC0415 - tests load this file from elsewhere

    memory = Memory(Path(__file__).with_suffix(".csv"))
    with tempfile.TemporaryDirectory(prefix="railcosim_") as name:
        folder = Path(name)
        fmu = str(make_fmu(folder / "sixteen", 16, 16))
        job = Job(fmu=fmu, inputs=16, outputs=16)
        title = "Two FMUs of 16 inputs and 16 outputs"
        found = compete(title, [(c, job) for c in CONTESTANTS], folder / "peers", memory.beside)
        peers = [c.label for c in CONTESTANTS[2:] if c.label in found]
        if OURS.label in found and peers:
            first = min(peers, key=found.__getitem__)
            CONSOLE.print(f"we take {found[OURS.label] / found[first]:.2f} of the fastest: {first}")
        fmu = str(make_fmu(folder / "fifty", 16, 50))
        off = Job(fmu=fmu, inputs=16, outputs=50)
        on = Job(fmu=fmu, inputs=16, outputs=50, record=True)
        recorded = Contestant("railcosim, all 100 outputs recorded", "railcosim")
        title = "Two FMUs of 16 inputs and 50 outputs"
        found = compete(title, [(OURS, off), (recorded, on)], folder / "recording", memory.beside)
        if len(found) == 2:
            ratio = found[recorded.label] / found[OURS.label] - 1
            CONSOLE.print(f"to record 100 channels takes {ratio:.2f} of the stepping")
        jobs = []
        for fmi in SOURCES:
            fmu = str(make_fmu(folder / f"version{fmi}", 16, 16, fmi))
            one = Contestant(f"railcosim, FMI {fmi}.0", "railcosim")
            jobs.append((one, Job(fmu=fmu, inputs=16, outputs=16)))
        found = compete("The same by version of FMI", jobs, folder / "versions", memory.beside)
        if len(found) == 2:
            CONSOLE.print(f"FMI 3.0 takes {np.divide(*reversed(found.values())):.2f} of FMI 2.0")
    if "--keep" in sys.argv:
        memory.keep(sys.argv[sys.argv.index("--keep") + 1])


if __name__ == "__main__":
    main()
