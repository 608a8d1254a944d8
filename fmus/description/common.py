"""What FMI 2.0 and FMI 3.0 write alike."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ..interface import Scalar
from .about import LOG_CATEGORIES, TOLERANCE, Description
from .units import unit_definitions

INITIAL = {"parameter": "exact", "output": "calculated"}  # of inputs and time it is not to be said


def frame(
    root: Element, about: Description, table: Sequence[Scalar], *, model_exchange: bool
) -> None:
    """Add units, log categories and the default experiment."""
    unit_definitions(root, table)
    log = SubElement(root, "LogCategories")
    for name, text in LOG_CATEGORIES.items():
        SubElement(log, "Category", name=name, description=text)
    experiment = {"startTime": "0", "stopTime": repr(about.stop), "stepSize": repr(about.step)}
    if model_exchange:
        experiment["tolerance"] = repr(TOLERANCE)
    SubElement(root, "DefaultExperiment", experiment)


def annotate(parent: Element, about: Description) -> None:
    """Add our annotations."""
    for element, attributes in about.annotations.items():
        SubElement(parent, element, dict(attributes))


def identity(v: Scalar, reference: int) -> dict[str, str]:
    """Attributes that say what a variable is."""
    known = {
        "name": v.name,
        "valueReference": str(reference),
        "description": v.description,
        "causality": v.causality,
        "variability": v.variability,
    }
    if initial := INITIAL.get(v.causality):
        known["initial"] = initial
    return known


def value_attributes(v: Scalar) -> dict[str, str]:
    """Unit, range, nominal value and start."""
    detail: dict[str, str] = {}
    if v.unit:
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
        detail["start"] = boolean(v.start) if isinstance(v.start, bool) else repr(v.start)
    return detail


def local(name: str, reference: int, description: str) -> dict[str, str]:
    """Attributes of a state or its derivative."""
    return {
        "name": name,
        "valueReference": str(reference),
        "description": description,
        "causality": "local",
        "variability": "continuous",
        "initial": "calculated",
    }


def boolean(value: bool) -> str:
    """As XML has it."""
    return str(value).lower()


def to_bytes(root: Element) -> bytes:
    """The file."""
    indent(root)
    text: bytes = tostring(root, encoding="UTF-8", xml_declaration=True)
    return text
