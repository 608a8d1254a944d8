"""SystemStructure.ssd of a system that is to be written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from importlib.metadata import version
from pathlib import Path
from urllib.parse import quote
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from railcosim.master.connections import Connection
from railcosim.master.fmi.description import FmuDescription
from railcosim.master.fmi.fmu_parameters import Scalar
from railcosim.master.ssp.structure import FMU, NAMESPACE
from railcosim.master.units import BASE_UNITS, IDENTITY, Linear, Unit, Units, fmu_units

_NAMESPACES = {
    "ssc": f"{NAMESPACE}Common",
    "ssd": f"{NAMESPACE}Description",
    "ssv": f"{NAMESPACE}ParameterValues",
    "osp": "http://opensimulationplatform.com/SSP/OSPAnnotations",
    "oms": "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd",
}
TYPES = {t: t for t in ("Real", "Integer", "Boolean", "String", "Binary")}
TYPES |= {"Enumeration": "Integer"}
"""SSP's types for FMI's, of the values that can be written."""
VERSIONS: Mapping[str, Mapping[str, str]] = {
    "1.0": {},
    "2.0": {"Real": "Float64", "Integer": "Int32"},
}
"""What versions of SSP call the types of values."""
PARAMETER_SET = "start"
"""Name of every parameter set; ecos asks for it."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """One component to be written.

    Attributes
    ----------
    name : str
        Of the component.
    description : FmuDescription
        Its FMU.
    starts : mapping of str to float, int, bool or str
        Parameters and inputs that differ from the FMU's start values, in its units.
    """

    name: str
    description: FmuDescription
    starts: Mapping[str, Scalar] = field(default_factory=dict)

    def units(self) -> dict[str, str]:
        """Unit of every variable that can be in an SSP."""
        d = self.description
        variables = {v.name: v.unit for v in (*d.inputs, *d.outputs)}
        return variables | {name: p.unit for name, p in (d.initials | d.parameters).items()}

    def types(self) -> dict[str, str]:
        """SSP's type of each of them."""
        d = self.description
        variables = {v.name: TYPES[v.type.value] for v in (*d.inputs, *d.outputs)}
        return {n: TYPES[p.type] for n, p in (d.initials | d.parameters).items()} | variables


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """When a run starts and stops, and its step, s; None to leave it to who runs it."""

    start: float
    stop: float | None
    step: float | None


def structure_xml(
    name: str,
    parts: Sequence[Part],
    wiring: Mapping[Connection, Linear],
    sources: Mapping[Path, str],
    experiment: Experiment,
    ssp: str = "1.0",
) -> bytes:
    """Write SystemStructure.ssd.

    Parameters
    ----------
    name : str
        Of the system.
    parts : sequence of Part
        The components.
    wiring : mapping of Connection to Linear
        What is connected, and what becomes of a value there.
    sources : mapping of Path to str
        Where each part's FMU is in the SSP.
    experiment : Experiment
        The default.
    ssp : str, optional
        Version of SSP, one of `VERSIONS`.

    Returns
    -------
    bytes
        The text.
    """
    root = Element(
        "ssd:SystemStructureDescription",
        {f"xmlns:{prefix}": uri for prefix, uri in _NAMESPACES.items()},
        version="1.0",
        name=name,
        generationTool=f"railcosim {version('railcosim')}",
    )
    system = SubElement(root, "ssd:System", name=name)
    defined = Units()
    for part in parts:
        defined = fmu_units(part.description.path) | defined
    elements = SubElement(system, "ssd:Elements")
    for part in parts:
        fed = {c.input for c in wiring if c.target == part.name}
        _component(elements, part, sources[part.description.path], fed, defined)
    if wiring:
        connections = SubElement(system, "ssd:Connections")
        units = {part.name: part.units() for part in parts}
        for c, linear in wiring.items():
            is_same_unit = units[c.source][c.output] == units[c.target][c.input]
            _connection(connections, c, linear, converts=is_same_unit and linear == IDENTITY)
    if experiment.step is not None:
        _annotate_for_omsimulator(system, experiment.step)
    _units(root, defined)
    _experiment(root, experiment)
    if ssp not in VERSIONS:
        raise ValueError(f"SSP version {ssp}: must be {' or '.join(VERSIONS)}")
    for element in root.iter():
        prefix, _, kind = element.tag.partition(":")
        element.tag = f"{prefix}:{VERSIONS[ssp].get(kind, kind)}"
        if "version" in element.attrib:
            element.set("version", ssp)
    indent(root)
    text: bytes = tostring(root, encoding="UTF-8", xml_declaration=True)
    return text


def _component(parent: Element, part: Part, source: str, fed: set[str], defined: Units) -> None:
    component = SubElement(parent, "ssd:Component", name=part.name, type=FMU, source=quote(source))
    d, units, types = part.description, part.units(), part.types()
    ends = [("input", v.name) for v in d.inputs if v.name in fed]
    ends += [("output", v.name) for v in d.outputs]
    connectors = SubElement(component, "ssd:Connectors")
    for way, name in ends:
        connector = SubElement(connectors, "ssd:Connector", name=name, kind=way)
        unit = _unit(units[name], defined) if types[name] == "Real" else {}
        SubElement(connector, f"ssc:{types[name]}", unit)
    if not part.starts:
        return
    bindings = SubElement(component, "ssd:ParameterBindings")
    values = SubElement(SubElement(bindings, "ssd:ParameterBinding"), "ssd:ParameterValues")
    known = {"version": "1.0", "name": PARAMETER_SET}
    parameters = SubElement(SubElement(values, "ssv:ParameterSet", known), "ssv:Parameters")
    for name, value in part.starts.items():
        parameter = SubElement(parameters, "ssv:Parameter", name=name)
        kind = types[name]
        if isinstance(value, str) and kind == "Integer":  # an item of an enumeration
            kind = "Enumeration"
        unit = _unit(units[name], defined) if kind == "Real" else {}
        SubElement(parameter, f"ssv:{kind}", {"value": _text(kind, value)} | unit)


def _text(kind: str, value: Scalar) -> str:
    """A value as XML wants it; nothing is lost."""
    if isinstance(value, str):
        return value
    if kind == "Boolean":
        return "true" if value else "false"
    return repr(float(value)) if kind == "Real" else str(int(value))


def _connection(parent: Element, c: Connection, linear: Linear, *, converts: bool) -> None:
    ends = {"startElement": c.source, "startConnector": c.output}
    ends |= {"endElement": c.target, "endConnector": c.input}
    element = SubElement(parent, "ssd:Connection", ends)
    if linear != IDENTITY:
        numbers = {"factor": repr(float(linear.factor)), "offset": repr(float(linear.offset))}
        SubElement(element, "ssc:LinearTransformation", numbers)
    if not converts:  # a conversion is in the transformation
        element.set("suppressUnitConversion", "true")


def _unit(name: str, defined: Units) -> dict[str, str]:
    """The attribute; left out where the FMU does not define its unit, for SSP asks for that."""
    return {"unit": name} if name in defined.defined else {}


def _units(root: Element, defined: Units) -> None:
    """The units in use."""
    used = {element.get("unit", "") for element in root.iter()}
    found = [unit for name, unit in sorted(defined.defined.items()) if name in used]
    if found:
        parent = SubElement(root, "ssd:Units")
        for unit in found:
            SubElement(SubElement(parent, "ssc:Unit", name=unit.name), "ssc:BaseUnit", _base(unit))


def _base(unit: Unit) -> dict[str, str]:
    """Exponents, factor and offset, without those that are as if left out."""
    exponents = zip(BASE_UNITS, unit.exponents, strict=True)
    numbers = {name: str(exponent) for name, exponent in exponents if exponent}
    if unit.factor != 1.0:
        numbers["factor"] = repr(unit.factor)
    if unit.offset != 0.0:
        numbers["offset"] = repr(unit.offset)
    return numbers


def _annotate_for_omsimulator(system: Element, step: float) -> None:
    """The step (s) and a fixed-step master, without which OMSimulator does not take the file."""
    decimal = format(Decimal(repr(float(step))), "f")  # its schema knows no exponents
    known = {"description": "oms-ma", "stepSize": decimal, "relativeTolerance": "0.0001"}
    parent = SubElement(system, "ssd:Annotations")
    parent = SubElement(parent, "ssc:Annotation", type="org.openmodelica")
    parent = SubElement(parent, "oms:Annotations")
    parent = SubElement(parent, "oms:SimulationInformation")
    SubElement(parent, "oms:FixedStepMaster", known)


def _experiment(root: Element, experiment: Experiment) -> None:
    """SSP 1.0 has no place for the step; libcosim, without one, starts no simulation."""
    times = {"startTime": experiment.start, "stopTime": experiment.stop}
    attributes = {name: repr(float(t)) for name, t in times.items() if t is not None}
    element = SubElement(root, "ssd:DefaultExperiment", attributes)
    if experiment.step is None:
        return
    annotations = SubElement(element, "ssd:Annotations")
    annotation = SubElement(annotations, "ssc:Annotation", type="com.opensimulationplatform")
    algorithm = SubElement(annotation, "osp:Algorithm")
    step = repr(float(experiment.step))
    SubElement(algorithm, "osp:FixedStepAlgorithm", baseStepSize=step)
