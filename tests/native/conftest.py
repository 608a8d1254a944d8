"""The driver of c/driver.c: compiled for this machine with sanitizers, or for others."""

from __future__ import annotations

import fcntl
import itertools
import os
import shutil
import subprocess
import uuid
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from railcosim.fmus.content import contents
from railcosim.fmus.description.structure import states_of
from railcosim.fmus.interface import Scalar
from railcosim.fmus.native_runtime.compile import headers, sources
from railcosim.fmus.native_runtime.resource import resource
from railcosim.fmus.stepping_variables import derivatives_of_step
from railcosim.mechanics.contact.profiled import Profiled
from railcosim.mechanics.modal import ModalBody
from railcosim.track.decay import RingWarning
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.parameters import Vehicle

HERE = Path(__file__).parent / "c"
# Any finding ends the process. Memory that cannot be had is for the runtime to deal with.
SANITIZERS = {
    "ASAN_OPTIONS": "detect_leaks=1:halt_on_error=1:exitcode=66:allocator_may_return_null=1",
    "UBSAN_OPTIONS": "halt_on_error=1:print_stacktrace=1:exitcode=66",
    "LSAN_OPTIONS": "exitcode=66",
}


@dataclass(frozen=True)
class Reply:
    """What a call returned, and what it had to say."""

    status: str
    values: list[str]
    log: list[str]

    @property
    def numbers(self) -> list[float]:
        """The values, as numbers; printed and read in full, they keep their bits."""
        return [float(v) for v in self.values]


class Driver:
    """A process in which an FMU's binary is called, one command at a time."""

    def __init__(self, command: list[str], env: dict[str, str]) -> None:
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, env=os.environ | env,
        )  # fmt: skip

    def __call__(self, *words: object) -> Reply:
        """One command; fails the test if the process ends instead of replying."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(" ".join(map(str, words)) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            self._fail(words)
        log = []
        while line := self._process.stdout.readline():
            kind, _, rest = line.rstrip("\n").partition(" ")
            if kind == "=":
                status, *values = rest.split()
                return Reply(status, values, log)
            log.append(rest)
        self._fail(words)
        raise AssertionError

    def close(self) -> None:
        """End it. A leak is found now."""
        out, err = self._process.communicate(timeout=1800)
        assert self._process.returncode == 0, err
        assert not out

    def kill(self) -> None:
        """End it at once, after a failed test."""
        self._process.kill()
        self._process.communicate()

    def _fail(self, words: tuple[object, ...]) -> None:
        _, err = self._process.communicate(timeout=1800)
        told = " ".join(map(str, words))[:200]
        pytest.fail(f"{told!r} ended the process ({self._process.returncode}):\n{err}")


@dataclass
class Drivers:
    """Opens drivers, and closes all of them at the end of a test."""

    start: Callable[[], Driver]
    opened: list[Driver] = field(default_factory=list)

    def __call__(self) -> Driver:
        """A new process."""
        self.opened.append(self.start())
        return self.opened[-1]


@dataclass(frozen=True)
class Fmu:
    """An FMU taken apart: its resources, and its interface by name."""

    name: str
    guid: str
    resources: Path
    variables: dict[str, Scalar]
    references: dict[str, int]
    states: int

    def where(self, fmi: int) -> str:
        """Its resources, as an importer of FMI 2 or 3 names them."""
        return self.resources.as_uri() if fmi == 2 else f"{self.resources}/"

    def names(self, causality: str) -> list[str]:
        """Variables of this causality, in order."""
        return [name for name, v in self.variables.items() if v.causality == causality]


class Instance:
    """An instance of an FMU in a driver's process."""

    def __init__(self, driver: Driver, fmu: Fmu, fmi: int, kind: str, place: int) -> None:
        self.driver, self.fmu, self.place, self.kind = driver, fmu, place, kind
        made = driver("new", place, kind, fmu.guid, fmu.where(fmi), 0)
        assert made.status == "OK", made

    def __call__(self, command: str, *words: object) -> Reply:
        """One command for this instance."""
        return self.driver(command, self.place, *words)

    def ref(self, name: str) -> int:
        """Value reference."""
        return self.fmu.references[name]

    def set(self, values: dict[str, float]) -> Reply:
        """Real variables by name."""
        refs = [self.ref(name) for name in values]
        return self("set", len(refs), *refs, *map(repr, values.values()))

    def initialise(self) -> None:
        """From instantiated to initialised, under the start values."""
        for command in (("enter", 0.0), ("exit",)):
            reply = self(*command)
            assert reply.status == "OK", reply

    def move(self, k: int) -> None:
        """Inputs away from the start values: wheels on by some centimetres, loads by per cents.

        Wheels go further down than irregularities: they stay in contact.
        """
        values = {}
        for j, name in enumerate(reversed(self.fmu.names("input"))):
            v = self.fmu.variables[name]
            size = 0.07 if name.endswith("position") else 0.1 * v.nominal
            values[name] = float(v.start or 0.0) + k * size * (1 + 0.1 * j)
        assert self.set(values).status == "OK"

    def outputs(self) -> list[str]:
        """All of them, as printed in full."""
        refs = [self.ref(name) for name in self.fmu.names("output")]
        reply = self("get", len(refs), *refs)
        assert reply.status == "OK", reply
        return reply.values


def needs(program: str, package: str) -> str:
    """Path of a program, or skip and say what to install."""
    found = shutil.which(program)
    if found is None:
        pytest.skip(f"no {program}: apt-get install {package}")
    return found


def compiled(command: list[str]) -> None:
    """Run a compiler; its words if it fails."""
    told = subprocess.run(command, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr


def driver_source(fmi: int) -> list[str]:
    """Arguments that compile the driver."""
    folders = sorted({str(path.parent) for path in headers(fmi)})
    return [f"-DFMI={fmi}", *(f"-I{folder}" for folder in folders), str(HERE / "driver.c")]


@pytest.fixture(scope="session")
def tiny_track() -> Track:
    """A ring as small and coarse as it can be."""
    mesh = Mesh(
        cells=4, elements_per_bay=2, highest_slab_frequency=100.0, highest_frequency=100.0
    )  # fmt: skip
    return Track(mesh=mesh)


@pytest.fixture(scope="session")
def tiny(tmp_path_factory: pytest.TempPathFactory, tiny_track: Track) -> dict[str, Fmu]:
    """FMUs taken apart: files of 10 to 50 kB, to be damaged.

    Four of a vertical pair; and `Spatial...` of two wheelsets, whose contacts inside roll.
    """
    folder, wagon = tmp_path_factory.mktemp("tiny"), read_stock(Path("wagon"))
    with warnings.catch_warnings(category=RingWarning, action="ignore"):
        named = {c.name: c for c in contents(Vehicle(), tiny_track)}
        in_space = contents(wagon, tiny_track, dimension="spatial")
    named |= {f"Spatial{c.name}": c for c in in_space if c.has_contact}
    return {name: take_apart(folder / name, c.body, c.table) for name, c in named.items()}


def take_apart(
    folder: Path, body: ModalBody, table: Sequence[Scalar], profiles: Profiled | None = None
) -> Fmu:
    """An FMU as the C runtime finds it, without the rest."""
    table = [*table, derivatives_of_step()]
    guid = f"{{{uuid.uuid4()}}}"
    resources = folder / "resources"
    resources.mkdir(parents=True)
    (resources / "model.bin").write_bytes(resource(body, table, guid, profiles))
    return Fmu(
        name=folder.name, guid=guid, resources=resources,
        variables={v.name: v for v in table},
        references={v.name: k for k, v in enumerate(table)},
        states=states_of(body).size,
    )  # fmt: skip


@pytest.fixture(scope="session")
def made() -> Callable[..., Fmu]:
    """Function that takes an FMU apart."""
    return take_apart


@pytest.hookimpl(tryfirst=True)  # before slow ones are left out
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What needs the runtime under sanitizers is slow: each build of it takes 15 s."""
    for item in items:
        if "sanitizing" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def sanitizing() -> Callable[[], list[str]]:
    """Function that gives the command of a compiler with ASan and UBSan."""

    def command() -> list[str]:
        return [
            needs("gcc", "gcc"), "-std=c99", "-g1", "-O1", "-fno-omit-frame-pointer",
            "-ffp-contract=off", "-fsanitize=address,undefined", "-fsanitize=float-cast-overflow",
            "-fno-sanitize-recover=all",
        ]  # fmt: skip

    return command


@pytest.fixture(scope="session")
def sanitizers() -> dict[str, str]:
    """Environment of programs that such a compiler made."""
    return SANITIZERS


@pytest.fixture(scope="session")
def of_all_workers(
    tmp_path_factory: pytest.TempPathFactory,
) -> Callable[[], AbstractContextManager[Path]]:
    """Function: a folder that all processes of this test run share, for one of them at a time."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "of-all-workers"
    folder.mkdir(exist_ok=True)

    @contextmanager
    def enter() -> Iterator[Path]:
        with (folder / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield folder

    return enter


@pytest.fixture(scope="session")
def sanitized(
    of_all_workers: Callable[[], AbstractContextManager[Path]],
    sanitizing: Callable[[], list[str]],
) -> Callable[[int], list[str]]:
    """Command of the driver with the runtime, both under ASan and UBSan, for FMI 2 or 3.

    Requests of the runtime for memory go through the driver, which can refuse them. Compiled once,
    what is of either version only once.
    """
    common = sanitizing()
    wraps = [f"-Wl,--wrap={name}" for name in ("malloc", "calloc", "realloc")]

    def objects(folder: Path, fmi: int, files: list[Path]) -> list[str]:
        include = sorted({f"-I{path.parent}" for path in headers(fmi)})
        made = {file: folder / f"{file.stem}.o" for file in files}
        for file, to in made.items():
            if not to.exists():
                compiled(
                    [
                        *common,
                        *include,
                        "-fPIC",
                        "-fvisibility=hidden",
                        "-c",
                        str(file),
                        "-o",
                        str(to),
                    ]
                )
        return [str(to) for to in made.values()]

    def command(fmi: int) -> list[str]:
        with of_all_workers() as folder:
            library, program = folder / f"fmi{fmi}.so", folder / f"driver{fmi}"
            if not program.exists():
                parts = objects(folder, fmi, sources(fmi))
                compiled([*common, *wraps, "-shared", "-o", str(library), *parts, "-lm"])
                compiled([*common, "-rdynamic", "-o", str(program), *driver_source(fmi), "-ldl"])
        return [str(program), str(library)]

    return command


@pytest.fixture
def use():
    """Function that makes instances, each at a place of its own."""
    places = itertools.count()

    def make(driver: Driver, fmu: Fmu, fmi: int, kind: str = "cs") -> Instance:
        return Instance(driver, fmu, fmi, kind, next(places))

    return make


@pytest.fixture(scope="session")
def compile_driver() -> Callable[[list[str], int, Path], None]:
    """Function that compiles the driver with a given compiler."""

    def run(compiler: list[str], fmi: int, program: Path) -> None:
        compiled([*compiler, "-o", str(program), *driver_source(fmi)])

    return run


@pytest.fixture(scope="session")
def start_driver() -> type[Driver]:
    """What starts a driver by its command."""
    return Driver


@pytest.fixture(params=[2, 3])
def fmi(request):
    """Version of FMI."""
    return request.param


@pytest.fixture
def driver(drivers):
    """One process with the sanitized runtime."""
    return drivers()


@pytest.fixture
def drivers(request, sanitized, fmi):
    """Processes with the sanitized runtime for FMI version `fmi`."""
    opened = Drivers(lambda: Driver(sanitized(fmi), SANITIZERS))
    yield opened
    failed = getattr(request.node, "failed", False)
    for driver in opened.opened:
        if failed:
            driver.kill()
        else:
            driver.close()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Let fixtures know whether the test failed."""
    report = yield
    if report.when == "call":
        item.failed = report.failed
    return report
