"""What importers and our own master are both asked to do."""

from __future__ import annotations

import math
import zipfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from xml.etree import ElementTree

from railcosim.master.component import Component
from railcosim.master.fmi.fmu import FmuComponent

STEP = 1e-4  # s
SPEED = 250 / 3.6  # m/s, the vehicle's default
# 0.03 s, in which wheels pass three railseats.
STEPS = 300
SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
SSV = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}"


@dataclass(frozen=True, kw_only=True)
class Job:
    """One run, as JSON can say it.

    Attributes
    ----------
    fmus : dict
        Component to FMU file, vehicle first.
    ssp : str
        SSP file with both.
    parameters, inputs : dict
        Component to values by name: parameters, and start values of connected inputs, for
        importers that do not exchange values before the first step.
    connections : list
        Source, output, target, input.
    outputs : dict
        Component to the names that are recorded: all of its outputs.
    step : float
        s.
    steps : int
        How many.
    """

    fmus: dict[str, str]
    ssp: str
    parameters: dict[str, dict[str, float]]
    inputs: dict[str, dict[str, float]]
    connections: list[tuple[str, str, str, str]]
    outputs: dict[str, list[str]]
    step: float = STEP
    steps: int = STEPS

    def as_dict(self) -> dict:
        """For json."""
        return asdict(self)


def make_job(exported: dict[str, Path], offsets: Sequence[float]) -> Job:
    """The pair of Pair.ssp, wired the same, its wheelsets started off their heights at rest."""
    ssp = exported["Vehicle"].with_name("Pair.ssp")
    with zipfile.ZipFile(ssp) as archive:
        structure = ElementTree.fromstring(archive.read("SystemStructure.ssd"))
    rest = {p.get("name"): float(p[0].get("value")) for p in structure.iter(f"{SSV}Parameter")}
    ends = ("startElement", "startConnector", "endElement", "endConnector")
    job = Job(
        fmus={"vehicle": str(exported["Vehicle"]), "track": str(exported["TrackWithContact"])},
        ssp=str(ssp),
        parameters={
            "vehicle": {
                name: z + offset for (name, z), offset in zip(rest.items(), offsets, strict=True)
            },
            "track": {},
        },
        inputs={},
        connections=[tuple(c.get(k) for k in ends) for c in structure.iter(f"{SSD}Connection")],
        outputs={},
    )
    return _with_interface(job)


def _with_interface(job: Job) -> Job:
    """Add what the FMUs say: names of outputs, and connected inputs as they are at the start."""
    outputs: dict[str, dict[str, float]] = {}
    for name, path in job.fmus.items():
        with FmuComponent.load(path, name=name) as fmu:
            fmu.set_parameters(job.parameters[name])
            fmu.enter_initialization(0.0)
            if name == "track":
                fmu.set_inputs([_fed(job, outputs, name).get(v.name, v.start) for v in fmu.inputs])
            outputs[name] = values(fmu)
    inputs = {name: _fed(job, outputs, name) for name in job.fmus}
    return Job(
        **(job.as_dict() | {"inputs": inputs, "outputs": {k: list(v) for k, v in outputs.items()}})
    )


def _fed(job: Job, outputs: dict[str, dict[str, float]], name: str) -> dict[str, float]:
    return {
        input_: outputs[source][output]
        for source, output, target, input_ in job.connections
        if target == name
    }


def values(component: Component) -> dict[str, float]:
    """Present outputs by name."""
    names = (v.name for v in component.outputs)
    return dict(zip(names, component.get_outputs().tolist(), strict=True))


@dataclass(frozen=True, kw_only=True)
class Drive:
    """One FMU driven by signals, as JSON can say it.

    Attributes
    ----------
    fmu : str
        FMU file.
    times : list
        Communication points, s.
    signals : dict
        Input to its values at the communication points.
    record : list
        Outputs.
    step : float
        s.
    """

    fmu: str
    times: list[float]
    signals: dict[str, list[float]]
    record: list[str]
    step: float = STEP

    def as_dict(self) -> dict:
        """For json."""
        return asdict(self)


def make_drive(track: Path) -> Drive:
    """Track.fmu under wheels that roll with forces of different frequencies and phases."""
    times = [k * STEP for k in range(STEPS + 1)]
    with FmuComponent.load(track) as fmu:
        inputs = {v.name: v.start for v in fmu.inputs}
        record = [v.name for v in fmu.outputs]
    signals = {}
    for k, (name, start) in enumerate(inputs.items()):
        if name.endswith("position"):
            signals[name] = [start + SPEED * t for t in times]
        else:
            omega = 2 * math.pi * (40 + 30 * k)
            signals[name] = [start * (1 + 0.2 * math.sin(omega * t + k)) for t in times]
    return Drive(fmu=str(track), times=times, signals=signals, record=record)
