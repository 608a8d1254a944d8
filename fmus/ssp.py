"""The vehicle and the track that owns the contact, wired: one SSP 1.0 file.

Any importer of SSP runs it as it is. What several of them do not bear is left out: libcosim and
ecos refuse connectors of the system itself, and FMPy feeds an input connector that nothing is
connected to from a wrong source. So the irregularity is no connector; it stays an input of the
track's FMU, 0 unless set there.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from numpy.typing import NDArray

from .content import Arrays
from .description.units import UNITS
from .interface import WHEELSETS, Scalar
from .python_runtime.bodies import TrackBody
from .whole import written_whole

FloatArray = NDArray[np.float64]

DOMAIN = "http://ssp-standard.org/SSP1/"
NAMESPACES = {
    "ssc": f"{DOMAIN}SystemStructureCommon",
    "ssd": f"{DOMAIN}SystemStructureDescription",
    "ssv": f"{DOMAIN}SystemStructureParameterValues",
    "osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
}


@dataclass(frozen=True, kw_only=True)
class Part:
    """One component of the system.

    Attributes
    ----------
    name : str
        Of the component.
    fmu : Path
        Its FMU; the file keeps its name in the SSP.
    table : sequence of Scalar
        The FMU's interface.
    start : mapping of str to float
        Parameters that differ from the FMU's start values, SI units.
    """

    name: str
    fmu: Path
    table: Sequence[Scalar]
    start: Mapping[str, float]

    def variables(self, causality: str) -> dict[str, Scalar]:
        """Variables of one causality by name."""
        return {v.name: v for v in self.table if v.causality == causality}


def static_start(
    track: Arrays, positions: Sequence[float], wheel_load: float, C: float
) -> dict[str, float]:
    """Heights of the wheelsets for which vehicle and track are at rest together.

    Any four heights leave the suspensions' forces as they are, for bogies and car body follow
    them without strain. So every wheel carries its static load at rest, whatever the track:
    a height is the rail's deflection under all static loads, and the contact's compression.

    Parameters
    ----------
    track : dict of arrays
        The reduced track, see `railcosim.fmus.content.track_arrays`.
    positions : sequence of float, shape (4,)
        Start positions of the wheelsets, m.
    wheel_load : float
        Static load of a wheel, N.
    C : float
        Coefficient of the contact law F = C delta^1.5, N/m^1.5.

    Returns
    -------
    dict
        The vehicle's parameters ``wheelset[i].start_z``, m, down.
    """
    body = TrackBody(track)
    compliance = body.static_compliance(body.shapes(np.asarray(positions, dtype=float)))
    deflection = (compliance @ np.full(8, wheel_load))[:4]  # left and right alike
    heights = deflection + (wheel_load / C) ** (2 / 3)
    return {f"wheelset[{i}].start_z": float(z) for i, z in zip(WHEELSETS, heights, strict=True)}


def write_ssp(target: Path, vehicle: Part, track: Part, *, step: float, stop: float) -> Path:
    """Write an SSP 1.0 file with both FMUs in it.

    Parameters
    ----------
    target : Path
        The ``.ssp`` file, replaced if it is there.
    vehicle, track : Part
        Every input of the one that the other has an output for is connected to it.
    step, stop : float
        Default experiment: communication step and end, s.

    Returns
    -------
    Path
        `target`.
    """
    with (
        written_whole(target) as partial,
        zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        structure = system_structure(target.stem, vehicle, track, step=step, stop=stop)
        archive.writestr("SystemStructure.ssd", structure)
        for part in (vehicle, track):
            # An FMU is compressed already.
            archive.write(part.fmu, _source(part), compress_type=zipfile.ZIP_STORED)
    return target


def system_structure(name: str, vehicle: Part, track: Part, *, step: float, stop: float) -> bytes:
    """SystemStructure.ssd of the pair, see `write_ssp`."""
    root = Element(
        "ssd:SystemStructureDescription",
        {f"xmlns:{prefix}": uri for prefix, uri in NAMESPACES.items()},
        version="1.0",
        name=name,
        generationTool=f"railcosim {version('railcosim')}",
    )
    system = SubElement(root, "ssd:System", name=name, description="Railway vehicle on slab track")
    elements = SubElement(system, "ssd:Elements")
    for part, other in ((vehicle, track), (track, vehicle)):
        _component(elements, part, _fed(part, other))
    connections = SubElement(system, "ssd:Connections")
    for source, target in ((vehicle, track), (track, vehicle)):
        for variable in _fed(target, source):
            SubElement(
                connections,
                "ssd:Connection",
                startElement=source.name,
                startConnector=variable.name,
                endElement=target.name,
                endConnector=variable.name,
            )
    _units(SubElement(root, "ssd:Units"), [*vehicle.table, *track.table])
    _experiment(root, step, stop)
    indent(root)
    text: bytes = tostring(root, encoding="UTF-8", xml_declaration=True)
    return text


def _source(part: Part) -> str:
    return f"resources/{part.fmu.name}"


def _fed(part: Part, other: Part) -> list[Scalar]:
    """Inputs of a part that the other one has an output for."""
    outputs = other.variables("output")
    return [v for v in part.variables("input").values() if v.name in outputs]


def _component(parent: Element, part: Part, fed: Sequence[Scalar]) -> None:
    component = SubElement(
        parent,
        "ssd:Component",
        name=part.name,
        type="application/x-fmu-sharedlibrary",
        source=_source(part),
    )
    connectors = SubElement(component, "ssd:Connectors")
    for v in (*fed, *part.variables("output").values()):
        connector = SubElement(connectors, "ssd:Connector", name=v.name, kind=v.causality)
        SubElement(connector, "ssc:Real", unit=v.unit)
    if part.start:
        bindings = SubElement(component, "ssd:ParameterBindings")
        values = SubElement(SubElement(bindings, "ssd:ParameterBinding"), "ssd:ParameterValues")
        known = {"version": "1.0", "name": "equilibrium"}
        parameters = SubElement(SubElement(values, "ssv:ParameterSet", known), "ssv:Parameters")
        for name, value in part.start.items():
            parameter = SubElement(parameters, "ssv:Parameter", name=name)
            unit = part.variables("parameter")[name].unit
            SubElement(parameter, "ssv:Real", value=repr(value), unit=unit)


def _units(parent: Element, table: Sequence[Scalar]) -> None:
    """The units in use; one without exponents is one that SI's base units cannot give."""
    for name in sorted(
        {v.unit for v in table} & {k for k, exponents in UNITS.items() if exponents}
    ):
        unit = SubElement(parent, "ssc:Unit", name=name)
        SubElement(unit, "ssc:BaseUnit", {k: str(v) for k, v in UNITS[name].items()})


def _experiment(root: Element, step: float, stop: float) -> None:
    """SSP 1.0 has no place for the step; libcosim, without one, starts no simulation."""
    experiment = SubElement(root, "ssd:DefaultExperiment", startTime="0", stopTime=repr(stop))
    annotation = SubElement(
        SubElement(experiment, "ssd:Annotations"),
        "ssc:Annotation",
        type="com.opensimulationplatform",
    )
    algorithm = SubElement(annotation, "osp:Algorithm")
    SubElement(algorithm, "osp:FixedStepAlgorithm", baseStepSize=repr(step))
