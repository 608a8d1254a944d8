"""Parameter bindings: values from a parameter set, inline or in a file, renamed by a mapping."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from railcosim.master.fmi.fmu_parameters import Scalar
from railcosim.master.ssp.package import Package, is_true, local
from railcosim.master.ssp.structure import SSD, SSM, SSV, Hop, Start, Way
from railcosim.master.units import Units

_SET = "application/x-ssp-parameter-set"
_MAPPING = "application/x-ssp-parameter-mapping"
REALS = {"Real", "Float64", "Float32"}
WHOLE = {"Integer", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64))}
TEXTS = {"String", "Enumeration", "Binary"}
"""Types of SSP 1.0 and 2.0."""
LONGEST = 25
"""Characters of a whole number that any type could hold."""


@dataclass(frozen=True)
class Bound:
    """One entry of a parameter set.

    Attributes
    ----------
    name : str
        Of the variable, seen from the element that has the binding.
    start : Start
        Its value.
    """

    name: str
    start: Start


def read_bindings(package: Package, element: Element, units: Units) -> Iterator[Bound]:
    """Read the parameter bindings of a component or system, the strongest last.

    Parameters
    ----------
    package : Package
        The SSP.
    element : Element
        The component or system.
    units : Units
        The units of the system structure.

    Yields
    ------
    Bound
        Every value.

    Raises
    ------
    FmuError
        For a source that is not in the package, of another kind, or wrong numbers.
    """
    for binding in element.iterfind(f"{SSD}ParameterBindings/{SSD}ParameterBinding"):
        if binding.get("type", _SET) != _SET:
            raise package.error(f"parameters of type {binding.get('type')}; only {_SET} is read")
        root = _content(package, binding, f"{SSD}ParameterValues/{SSV}ParameterSet")
        if root is None:
            continue
        units_of_set = units | package.units(root)
        bounds = list(_values(package, root, binding.get("prefix", ""), units_of_set))
        mapping = binding.find(f"{SSD}ParameterMapping")
        yield from bounds if mapping is None else _mapped(package, mapping, bounds)


def _content(package: Package, element: Element, inline: str) -> Element | None:
    """The root of what an element refers to, or has inside; None for nothing."""
    if element.get("source"):
        return package.xml(package.file(element, f"a {local(element)}"))
    return element.find(inline)


def _values(package: Package, root: Element, prefix: str, units: Units) -> Iterator[Bound]:
    """The entries of a parameter set; those of an array (SSP 2.0) one by one."""
    for parameter in root.iterfind(f"{SSV}Parameters/{SSV}Parameter"):
        name = prefix + package.need(parameter, "name")
        found = next((child for child in parameter if child.tag.startswith(SSV)), None)
        if found is None:
            raise package.error(f"parameter {name} has no value")
        way = Way(unit=found.get("unit", ""), units=units)
        several = found.get("value", "").split() if local(found) not in TEXTS else []
        if len(several) > 1:
            for k, text in enumerate(several, start=1):
                one = Element(found.tag, {"value": text})
                yield Bound(f"{name}[{k}]", Start(_scalar(package, name, one), way))
        else:
            yield Bound(name, Start(_scalar(package, name, found), way))


def _scalar(package: Package, name: str, element: Element) -> Scalar | bytes:
    """The value of an entry."""
    kind = local(element)
    if kind == "Binary":
        text = package.need(element, "value")
        try:
            return bytes.fromhex(text)
        except ValueError:
            raise package.error(
                f"parameter {name}: {text[:40]!r} must be bytes, two hexadecimal digits each"
            ) from None
    if kind == "Boolean":
        return is_true(package.need(element, "value"))
    if kind in {"String", "Enumeration"}:
        return package.need(element, "value")
    if kind not in REALS | WHOLE:
        raise package.error(f"parameter {name}: {kind} values are not supported; leave it out")
    if kind in WHOLE and (text := package.need(element, "value").strip()).lstrip("+-").isdecimal():
        return int(text) if len(text) <= LONGEST else float(text)  # of 64 bits, all digits
    number = package.number(element, "value")
    return int(number) if kind in WHOLE and number.is_integer() else number


def _mapped(package: Package, element: Element, bounds: list[Bound]) -> Iterator[Bound]:
    """What a mapping makes of a parameter set: only entries that it names, in its order."""
    if element.get("type", _MAPPING) != _MAPPING:
        raise package.error(f"a mapping of type {element.get('type')}; only {_MAPPING} is read")
    root = _content(package, element, f"{SSM}ParameterMapping")
    by_name = {bound.name: bound for bound in bounds}
    for entry in [] if root is None else root.iterfind(f"{SSM}MappingEntry"):
        bound = by_name.get(package.need(entry, "source"))
        if bound is None:
            continue
        hop = Hop(
            package.transformation(entry), "", not is_true(entry.get("suppressUnitConversion"))
        )
        way = Way(unit=bound.start.way.unit, units=bound.start.way.units, hops=(hop,))
        yield Bound(package.need(entry, "target"), Start(bound.start.value, way))
