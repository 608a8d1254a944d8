"""What FMPy leaves out of a model description of FMI 3.0."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from railcosim.master.fmi.archive import DESCRIPTION, parse_xml


def complete(raw: Any, folder: Path) -> Any:
    """Add to what FMPy has read of the file in `folder`; nothing to another version's.

    Raises
    ------
    ValueError
        If a number is none.
    """
    if not raw.fmiVersion.startswith("3."):
        return raw
    root = parse_xml(DESCRIPTION, (folder / DESCRIPTION).read_bytes())
    for tag, kind in (("ModelExchange", raw.modelExchange), ("CoSimulation", raw.coSimulation)):
        element = root.find(tag)
        if element is not None and kind is not None:
            kind.providesDirectionalDerivative = _is(element, "providesDirectionalDerivatives")
    variables = {v.name: v for v in raw.modelVariables}
    for element in root.iterfind("ModelVariables/*"):
        variable = variables.get(element.get("name"))
        if variable is not None:
            variable.intermediateUpdate = _is(element, "intermediateUpdate")
            if variable.type == "Clock":
                _complete_clock(variable, element)
    return raw


def _complete_clock(variable: Any, element: Element) -> None:
    """When a clock ticks, s: as decimal numbers, or as fractions."""
    resolution = int(element.get("resolution", "1"))
    if resolution < 1:
        raise ValueError(f"resolution of the clock {variable.name} is {resolution}")
    counter = element.get("intervalCounter")
    decimal = element.get("intervalDecimal")
    if decimal is not None:
        variable.intervalDecimal = float(decimal)
    elif counter is not None:
        variable.intervalDecimal = int(counter) / resolution
    shift = element.get("shiftDecimal")
    variable.shiftDecimal = (
        int(element.get("shiftCounter", "0")) / resolution if shift is None else float(shift)
    )


def _is(element: Element, attribute: str) -> bool:
    return element.get(attribute) in {"true", "1"}
