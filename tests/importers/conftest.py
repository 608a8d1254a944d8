"""Other people's importers, each in an environment of its own, run on our native FMUs.

The environments are made by pip at first use and kept in pytest's cache. What no package brings is
looked for on PATH; docs/importers.md says how it is built. What cannot be had makes a skip that
says what to install.
"""

import ctypes
import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
import venv
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from railcosim.analysis.pair.export_pair import export_pair
from railcosim.fmus.export import WITH_STATES, NativeRuntime
from railcosim.storage.lock import take
from railcosim.vehicle.parameters import Vehicle

from .job import Job, make_job

RUNNERS = Path(__file__).parent / "runners"


@dataclass(frozen=True)
class Importer:
    """An importer at the version whose scheme was read.

    Attributes
    ----------
    requirements : tuple of str
        For pip.
    library, package : str
        Shared library it needs, and the Debian package that has it; empty if none.
    program : str
        What is on PATH where the importer was built from its source: itself, or a Python that has
        it. Empty where pip installs it.
    """

    requirements: tuple[str, ...] = ()
    library: str = ""
    package: str = ""
    program: str = ""


IMPORTERS = {
    "fmpy": Importer(("fmpy==0.3.32",)),
    "libcosimpy": Importer(("libcosimpy==0.0.6",)),
    "ecospy": Importer(("ecospy==0.7.2",), library="libtbb.so.12", package="libtbb12"),
    "cofmupy": Importer(("cofmupy==1.0.0",)),
    "fmucontainer": Importer(("fmu-manipulation-toolbox==2.0", "fmpy==0.3.32")),
    "pathsim": Importer(("pathsim-fmi==0.1.1", "pathsim==0.27.1", "fmpy==0.3.32")),
    "fmusim": Importer(program="fmusim"),
    "omsimulator": Importer(program="OMSimulator"),
    "pyfmi": Importer(program="python-pyfmi"),
}


@pytest.fixture(scope="session")
def exported(tmp_path_factory, short_track):
    """The four FMUs and Pair.ssp with all that others' tools look at."""
    folder = tmp_path_factory.mktemp("documented")
    return export_pair(Vehicle(), short_track, folder, runtime=WITH_STATES)


@pytest.fixture(scope="session")
def job(exported) -> Job:
    """Vehicle and track rolling, every wheelset started a little off its height at rest, m."""
    return make_job(exported, (1e-4, -5e-5, 3e-5, -2e-5))


@pytest.fixture(scope="session")
def ssp_job(exported) -> Job:
    """The SSP as it is: it starts at rest, and rolls over railseats and slabs."""
    return make_job(exported, (0.0, 0.0, 0.0, 0.0))


@pytest.fixture(scope="session")
def exported3(packed_by):
    """The same FMUs as FMI 3.0."""
    return packed_by(NativeRuntime(fmi=3))


@pytest.fixture
def run(request, tmp_path):
    """Runs a runner in its importer's environment; gives what it wrote."""

    def start(name: str, job: Job, **more) -> dict:
        python = _environment(request.config, name)
        given, answer = tmp_path / "job.json", tmp_path / "answer.json"
        given.write_text(json.dumps(job.as_dict() | more), encoding="utf-8")
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
        # One order of what a set holds: cofmupy steps its FMUs in it.
        environment |= {"OPENBLAS_NUM_THREADS": "1", "PYTHONHASHSEED": "0"}
        done = subprocess.run(
            [python, str(RUNNERS / f"run_{name}.py"), str(given), str(answer)],
            capture_output=True, text=True, check=False, timeout=1800,
            env=environment,
            cwd=tmp_path,
        )  # fmt: skip
        assert done.returncode == 0, (done.stdout + done.stderr)[-3000:]  # libcosim says much
        told: dict = json.loads(answer.read_text(encoding="utf-8"))
        return told

    return start


def _environment(config: pytest.Config, name: str) -> str:
    """The Python that has the importer; skips the test if it cannot be had."""
    importer = IMPORTERS[name]
    if importer.program:
        if (found := shutil.which(importer.program)) is None:
            pytest.skip(f"no program {importer.program}: build {name} as docs/importers.md says")
        return found if importer.program.startswith("python") else sys.executable
    if importer.library:
        try:
            ctypes.CDLL(importer.library)
        except OSError:
            pytest.skip(f"{name} needs {importer.library}: apt-get install {importer.package}")
    key = hashlib.sha256(repr((importer.requirements, sys.version)).encode()).hexdigest()[:8]
    folder = Path(config.cache.mkdir("importers")) / f"{name}-{key}"
    python = folder / "bin" / "python"
    with _alone(folder.with_suffix(".lock")):
        if not (ready := folder / "ready").exists():
            venv.create(folder, with_pip=False, clear=True)
            pip = [sys.executable, "-m", "pip", "--python", str(python)]
            done = subprocess.run(
                [*pip, "install", "--quiet", *importer.requirements],
                capture_output=True, text=True, check=False,
            )  # fmt: skip
            if done.returncode:
                wanted = " ".join(importer.requirements)
                pytest.skip(f"pip install {wanted} failed: {done.stderr.strip()[-300:]}")
            ready.touch()
    return str(python)


@contextmanager
def _alone(lock: Path) -> Iterator[None]:
    """One worker at a time: the others wait for what it makes."""
    while (descriptor := take(lock)) is None:
        time.sleep(0.1)
    try:
        yield
    finally:
        os.close(descriptor)
