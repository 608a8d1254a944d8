"""modelDescription.xml (FMI 2.0) and the documentation page of an FMU, from its interface table."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from .interface import Scalar

# Exponents of SI base units.
UNITS: dict[str, dict[str, int] | None] = {
    "s": {"s": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "rad": {"rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N/m": {"kg": 1, "s": -2},
    "N/m1.5": None,  # FMI has no fractional exponents
}
# Display unit and how many of it make one SI unit.
DISPLAY_UNITS = {"m": ("mm", 1e3), "N": ("kN", 1e-3), "m/s": ("km/h", 3.6), "N/m": ("GN/m", 1e-9)}


@dataclass(frozen=True, kw_only=True)
class Description:
    """What modelDescription.xml says besides its variables.

    Attributes
    ----------
    name : str
        Model name and identifier.
    guid, version, text : str
        Identity of the content, of the software, and one sentence.
    needs_execution_tool : bool
        Whether the importing machine must bring a Python.
    step, stop : float
        Default experiment, s.
    """

    name: str
    guid: str
    version: str
    text: str
    needs_execution_tool: bool
    step: float = 1e-4
    stop: float = 1.0


def model_description(about: Description, table: Sequence[Scalar]) -> bytes:
    """The XML of a co-simulation FMU; a variable's value reference is its place in the table."""
    root = Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=about.name,
        guid=about.guid,
        description=about.text,
        version=about.version,
        license="MIT",
        generationTool=f"railcosim {about.version}",
        generationDateAndTime=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        variableNamingConvention="structured",
    )
    SubElement(
        root,
        "CoSimulation",
        modelIdentifier=about.name,
        needsExecutionTool=str(about.needs_execution_tool).lower(),
        canHandleVariableCommunicationStepSize="true",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
    )
    _units(SubElement(root, "UnitDefinitions"), {v.unit for v in table} & set(UNITS))
    log = SubElement(root, "LogCategories")
    SubElement(log, "Category", name="logStatusError", description="Why a call failed")
    SubElement(
        root,
        "DefaultExperiment",
        startTime="0",
        stopTime=repr(about.stop),
        stepSize=repr(about.step),
    )
    variables = SubElement(root, "ModelVariables")
    for reference, v in enumerate(table):
        _variable(variables, reference, v)
    _structure(SubElement(root, "ModelStructure"), table)
    indent(root)
    text: bytes = tostring(root, encoding="UTF-8", xml_declaration=True)
    return text


def _units(parent: Element, used: set[str]) -> None:
    for name in sorted(used):
        unit = SubElement(parent, "Unit", name=name)
        if (exponents := UNITS[name]) is not None:
            SubElement(unit, "BaseUnit", {k: str(v) for k, v in exponents.items()})
        if name in DISPLAY_UNITS:
            display, factor = DISPLAY_UNITS[name]
            SubElement(unit, "DisplayUnit", name=display, factor=repr(factor))


def _variable(parent: Element, reference: int, v: Scalar) -> None:
    known = {
        "name": v.name,
        "valueReference": str(reference),
        "description": v.description,
        "causality": v.causality,
        "variability": v.variability,
    }
    if v.causality == "parameter":
        known["initial"] = "exact"
    elif v.causality == "output":
        known["initial"] = "calculated"
    variable = SubElement(parent, "ScalarVariable", known)
    detail: dict[str, str] = {}
    if v.type == "Real" and v.unit:
        detail["unit"] = v.unit
        if v.display_unit:
            detail["displayUnit"] = v.display_unit
    if v.minimum is not None:
        detail["min"] = repr(v.minimum)
    if v.maximum is not None:
        detail["max"] = repr(v.maximum)
    if v.type == "Real" and v.causality != "independent":
        detail["nominal"] = repr(v.nominal)
    if v.start is not None:
        detail["start"] = str(v.start).lower() if v.type == "Boolean" else repr(v.start)
    SubElement(variable, v.type, detail)


def _structure(parent: Element, table: Sequence[Scalar]) -> None:
    """Outputs with the inputs they depend on at once; initial unknowns depend on all (no list)."""
    index = {v.name: str(k) for k, v in enumerate(table, start=1)}
    outputs = SubElement(parent, "Outputs")
    for v in table:
        if v.causality == "output":
            depends = " ".join(index[name] for name in v.depends_on)
            SubElement(outputs, "Unknown", index=index[v.name], dependencies=depends)
    unknowns = SubElement(parent, "InitialUnknowns")
    for v in table:
        if v.causality == "output":
            SubElement(unknowns, "Unknown", index=index[v.name])


def documentation(about: Description, table: Sequence[Scalar], parameters: str) -> str:
    """documentation/index.html: conventions, start, holds, variables and model parameters."""
    rows = "\n".join(
        f"<tr><td><code>{html.escape(v.name)}</code></td><td>{v.causality}</td>"
        f"<td>{html.escape(v.unit)}</td><td>{'' if v.start is None else v.start}</td>"
        f"<td>{html.escape(v.description)}</td></tr>"
        for v in table
    )
    return PAGE.format(
        name=about.name,
        text=html.escape(about.text),
        version=about.version,
        rows=rows,
        parameters=html.escape(parameters),
    )


PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{name}</title>
<style>body{{font-family:sans-serif;max-width:60em;margin:2em auto;line-height:1.4}}
td,th{{border-bottom:1px solid #ccc;padding:.2em .6em;text-align:left;vertical-align:top}}
pre{{background:#f4f4f4;padding:1em;overflow:auto}}</style></head><body>
<h1>{name}</h1>
<p>{text} Made by railcosim {version}.</p>
<h2>Conventions</h2>
<p>SI units. x forward, y to the right, z <b>down</b>; a positive pitch lifts the front. Wheelsets
1 to 4 from the front. Displacements are measured from the unloaded track and from the vehicle
whose wheels just touch it; forces are absolute, compression positive: down on the rail, up on the
wheel. The compression of a contact is wheel_z - rail_z - irregularity_z.</p>
<h2>Start</h2>
<p>A run starts at rest under the inputs and parameters set in initialisation mode: the track under
the contact forces, the vehicle with its wheelsets held at the heights start_z. The two are in
equilibrium if the accelerations wheelset[i].az are then zero.</p>
<h2>Between communication points</h2>
<p>The linear part is stepped exactly for any step size. The parameter input_hold says how inputs go
on over the step: 0 held, 1 extrapolated on the line through the last two values set, 2 interpolated
from the last value set to the present one, which is then that at the END of the step. State can be
saved, restored and serialised; a repeated step gives the same bits.</p>
<h2>Variables</h2>
<table><tr><th>name</th><th>causality</th><th>unit</th><th>start</th><th>meaning</th></tr>
{rows}
</table>
<h2>Parameters of the model inside</h2>
<pre>{parameters}</pre>
</body></html>
"""
