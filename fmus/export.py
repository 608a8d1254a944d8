"""Vehicle and track parameters to four FMUs."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
import uuid
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

import numpy as np
from pythonfmu.builder import FmuBuilder

from railcosim.parameters import write_toml
from railcosim.track.parameters import Track
from railcosim.track.reduced import reduce_track
from railcosim.vehicle.contact import hertz_coefficient, tangent_stiffness
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import Vehicle

from . import interface
from .content import Arrays, track_arrays, vehicle_arrays
from .description.about import PYTHON, Description
from .description.extras import extras
from .description.fmi2 import model_description
from .description.kind import KINDS
from .interface import Scalar

# What travels in every FMU, by its place under the package; all of it needs numpy only.
RUNTIME = {
    "vehicle": ["contact.py"],
    "track": ["shape_functions.py"],
    "fmus/python_runtime": ["stepping.py", "bodies.py", "motion.py", "models.py", "slave.py"],
}
SCRIPT = """from {package}.fmus.python_runtime.slave import RailcosimSlave


class {name}(RailcosimSlave):
    pass
"""


@dataclass(frozen=True, kw_only=True)
class Content:
    """One FMU before it is packed."""

    name: str
    model: str
    text: str
    table: list[Scalar]
    arrays: Arrays
    parameters: str


def export(
    vehicle: Vehicle,
    track: Track,
    out: Path,
    progress: Callable[[str], None] = lambda text: None,
) -> dict[str, Path]:
    """Write Vehicle, Track, VehicleWithContact and TrackWithContact as FMUs.

    Parameters
    ----------
    vehicle, track : Vehicle, Track
        Parameters.
    out : Path
        Folder, made if need be.
    progress : callable
        Told what is being done.

    Returns
    -------
    dict
        FMU name to file.
    """
    out.mkdir(parents=True, exist_ok=True)
    written = {}
    for content in _contents(vehicle, track, progress):
        progress(f"packing {content.name}.fmu")
        written[content.name] = _pack(content, out / f"{content.name}.fmu")
    return written


def contact_defaults(vehicle: Vehicle) -> interface.Contact:
    """Contact parameters of the vehicle's wheels: C, and k_H at the static load (eq. 18)."""
    c = vehicle.contact
    C = hertz_coefficient(
        young_modulus=c.young_modulus,
        poisson_ratio=c.poisson_ratio,
        wheel_radius=vehicle.wheelset.radius,
        rail_radius=c.rail_radius,
    )
    return interface.Contact(k_H=tangent_stiffness(C, vehicle.wheel_load), C=C)


def _contents(vehicle: Vehicle, track: Track, progress: Callable[[str], None]) -> list[Content]:
    body = build_multibody(vehicle)
    progress("reducing the track")
    reduced = track_arrays(reduce_track(track))
    vehicle_content = vehicle_arrays(body)
    # The rearmost wheelset starts above a railseat, the paper's place.
    positions = body.wheelset_x - body.wheelset_x[-1] + track.fastening.spacing / 2
    contents = []
    for with_contact in (False, True):
        known = {
            "with_contact": with_contact,
            "wheel_load": vehicle.wheel_load,
            "positions": positions.tolist(),
            "contact": contact_defaults(vehicle),
        }
        contents += [
            Content(
                name="VehicleWithContact" if with_contact else "Vehicle",
                model="vehicle",
                text="Railway vehicle, vertical: "
                + ("rail motion to contact force." if with_contact else "contact force to motion."),
                table=interface.vehicle(**known),
                arrays=vehicle_content,
                parameters=write_toml(vehicle, "Vehicle"),
            ),
            Content(
                name="TrackWithContact" if with_contact else "Track",
                model="track",
                text="Slab track, a ring of cells, vertical: "
                + (
                    "wheel motion to contact force." if with_contact else "contact force to motion."
                ),
                table=interface.track(**known),
                arrays=reduced,
                parameters=write_toml(track, "Slab track"),
            ),
        ]
    return contents


def _pack(content: Content, target: Path) -> Path:
    with tempfile.TemporaryDirectory(prefix="railcosim_") as folder:
        work = Path(folder)
        package = _copy_runtime(work)
        np.savez_compressed(work / "model.npz", **content.arrays)  # type: ignore[arg-type]
        table = {"model": content.model, "variables": [v.as_dict() for v in content.table]}
        (work / "interface.json").write_text(json.dumps(table), encoding="utf-8")
        about = Description(
            name=content.name,
            guid=_guid(work),
            version=version("railcosim"),
            text=content.text,
            capabilities=PYTHON,
        )
        xml = model_description(about, content.table)
        (work / "modelDescription.xml").write_bytes(xml)
        beside = extras(
            about, KINDS[content.model], content.table, content.arrays,
            fmi=2, parameters=content.parameters,
        )  # fmt: skip
        # Scripts of one name share a module in the host, so the name says what code it is.
        script = work / f"{package}_{content.name}.py"
        script.write_text(SCRIPT.format(package=package, name=content.name), encoding="utf-8")
        resources = [
            work / n for n in (package, "model.npz", "interface.json", "modelDescription.xml")
        ]
        packed = FmuBuilder.build_FMU(script, dest=work / "built", project_files=resources)
        with zipfile.ZipFile(packed, "a", zipfile.ZIP_DEFLATED) as archive:
            for path, data in beside.items():
                archive.writestr(path, data)
        shutil.move(packed, target)
    return target


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


def _guid(work: Path) -> str:
    """The same content, the same GUID."""
    digest = hashlib.sha256()
    for name in ("model.npz", "interface.json"):
        digest.update((work / name).read_bytes())
    return "{" + str(uuid.UUID(bytes=digest.digest()[:16])) + "}"
