"""An FMU that runs in Python: pythonfmu's binaries, our modules, the model as model.npz."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
import uuid
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

import numpy as np
from pythonfmu.builder import FmuBuilder

from railcosim.storage.archive import write_archive
from railcosim.storage.temporary import scratch

from .content import Content, profiles_json
from .description.about import PYTHON, Description
from .description.extras import extras
from .description.fmi2 import model_description
from .description.kind import KINDS
from .roles import PROFILES

# What travels in every FMU, by its place under the package; all of it needs numpy only.
RUNTIME = {
    "mechanics": [
        "arrays.py",
        "ports.py",
        "shape_functions.py",
        "shapes.py",
        "coordinates.py",
        "observation.py",
        "gaps.py",
        "modal.py",
        "law.py",
        "solve.py",
        "stepping.py",
        "motion.py",
    ],
    "mechanics/contact": [
        "at_ports.py",
        "creep.py",
        "ellipse.py",
        "fastsim.py",
        "geometry.py",
        "kalker.py",
        "numbers.py",
        "profiled.py",
        "profiles.py",
        "rolling.py",
        "saturation.py",
    ],
    "fmus": ["roles.py"],
    "fmus/python_runtime": ["models.py", "slave.py"],
}
# pythonfmu 0.7 gives back a reference to the script's globals that it was only lent: without one
# more they are freed while the module lives, and whoever makes the next dictionary shares it with
# the module (Python 3.13 then emptied one of a model's).
SCRIPT = """from ctypes import py_object, pythonapi

from {package}.fmus.python_runtime.slave import RailcosimSlave

pythonapi.Py_IncRef(py_object(globals()))


class {name}(RailcosimSlave):
    pass
"""


@dataclass(frozen=True)
class PythonRuntime:
    """FMI 2.0 Co-Simulation; needs a Python with numpy where it is imported.

    Attributes
    ----------
    fmi, documented
        As in NativeRuntime.
    """

    fmi: int = 2
    documented: bool = True

    def prepare(self, progress: Callable[[str], None]) -> None:
        """Nothing: the binaries are pythonfmu's."""

    def pack(self, content: Content, target: Path, progress: Callable[[str], None]) -> str:
        """Write the FMU; return the digest of what was written."""
        progress(f"packing {target.name}")
        with tempfile.TemporaryDirectory(dir=scratch()) as folder:
            work = Path(folder)
            package = _copy_runtime(work)
            np.savez_compressed(work / "model.npz", **content.body.arrays())  # type: ignore[arg-type]
            table = {"variables": [v.as_dict() for v in content.table]}
            (work / "interface.json").write_text(json.dumps(table), encoding="utf-8")
            told = ["model.npz", "interface.json"]
            if content.profiles is not None:
                (work / PROFILES).write_bytes(profiles_json(content.profiles))
                told.append(PROFILES)
            about = Description(
                name=content.name,
                guid=_guid(work, told),
                version=version("railcosim"),
                text=content.text,
                capabilities=PYTHON,
                annotations=content.annotations,
            )
            xml = model_description(about, content.table)
            (work / "modelDescription.xml").write_bytes(xml)
            beside = {} if not self.documented else extras(
                about, KINDS[content.model], content.table, content.body,
                fmi=2, parameters=content.parameters, profiles=content.profiles,
            )  # fmt: skip
            # Scripts of one name share a module in the host, so the name says what code it is.
            script = work / f"{package}_{content.name}.py"
            script.write_text(SCRIPT.format(package=package, name=content.name), encoding="utf-8")
            resources = [work / n for n in (package, *told, "modelDescription.xml")]
            packed = FmuBuilder.build_FMU(script, dest=work / "built", project_files=resources)
            with zipfile.ZipFile(packed) as archive:  # with today's date, in any order
                entries = {name: archive.read(name) for name in sorted(archive.namelist())}
            return write_archive(target, entries | beside)


def _copy_runtime(work: Path) -> str:
    """Copy the runtime's modules under a package name made of their content; return the name."""
    digest = hashlib.sha256()
    for folder, names in RUNTIME.items():
        for name in names:
            digest.update(_module(folder, name).read_bytes())
    package = f"railcosim_{digest.hexdigest()[:12]}"
    for folder, names in RUNTIME.items():
        place = work / package / folder
        place.mkdir(parents=True)
        for name in names:
            shutil.copyfile(_module(folder, name), place / name)
    return package


def _module(folder: str, name: str) -> Path:
    package = "railcosim." + folder.replace("/", ".")
    return Path(str(files(package).joinpath(name)))


def _guid(work: Path, told: Sequence[str]) -> str:
    """The same content, the same GUID."""
    digest = hashlib.sha256()
    for name in told:
        digest.update((work / name).read_bytes())
    return "{" + str(uuid.UUID(bytes=digest.digest()[:16])) + "}"
