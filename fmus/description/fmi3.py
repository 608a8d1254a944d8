"""modelDescription.xml of FMI 3.0: the same interface, its states as arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement

from ..interface import Scalar
from .about import TOOL, Description
from .common import annotate, boolean, frame, identity, local, to_bytes, value_attributes
from .structure import Block, Elements, States

FIRST = 1  # value reference; OMSimulator takes them for numbers from 1 on in the order of the XML
FIRST_STATE, FIRST_DERIVATIVE = 2**16, 2**24  # of the first block
TYPES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}


def model_description(
    about: Description,
    table: Sequence[Scalar],
    states: States | None = None,
    sources: Sequence[str] = (),
) -> bytes:
    """The XML of an FMU for co-simulation and, if it shows its states, model exchange.

    A variable's value reference is its number in the table, from `FIRST` on, as in the XML.

    Parameters
    ----------
    about : Description
        Of the FMU.
    table : sequence of Scalar
        Its interface.
    states : States, optional
        Its continuous states.
    sources : sequence of str
        Said in ``sources/buildDescription.xml``, not here; taken as the writer of FMI 2.0 does.
    """
    del sources
    root = Element("fmiModelDescription", fmiVersion="3.0", instantiationToken=about.guid)
    root.attrib.update(about.attributes())
    _interface_types(root, about, model_exchange=states is not None)
    frame(root, about, table, model_exchange=states is not None)
    variables = SubElement(root, "ModelVariables")
    for reference, v in enumerate(table, start=FIRST):
        SubElement(variables, TYPES[v.type], identity(v, reference) | value_attributes(v))
    blocks = states.blocks if states is not None else ()
    _state_variables(variables, blocks)
    structure = SubElement(root, "ModelStructure")
    _structure(structure, table, blocks, states.outputs if states is not None else {})
    if about.annotations:
        annotate(SubElement(SubElement(root, "Annotations"), "Annotation", type=TOOL), about)
    return to_bytes(root)


def _interface_types(root: Element, about: Description, *, model_exchange: bool) -> None:
    can = about.capabilities
    common = {
        "modelIdentifier": about.name,
        "needsExecutionTool": boolean(can.needs_execution_tool),
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
        "providesDirectionalDerivatives": boolean(can.directional_derivatives),
    }
    if model_exchange:
        SubElement(root, "ModelExchange", common)
    simulation = {
        "canHandleVariableCommunicationStepSize": "true",
        "maxOutputDerivativeOrder": str(can.output_derivatives),
    }
    SubElement(root, "CoSimulation", common | simulation)


def _state_variables(parent: Element, blocks: Sequence[Block]) -> None:
    """All states, then all derivatives."""
    for k, block in enumerate(blocks):
        known = local(block.name, FIRST_STATE + k, block.description)
        array = SubElement(parent, "Float64", known, nominal=repr(block.nominal))
        SubElement(array, "Dimension", start=str(block.size))
    for k, block in enumerate(blocks):
        text = f"time derivative of {block.name}"
        known = local(f"der({block.name})", FIRST_DERIVATIVE + k, text)
        array = SubElement(parent, "Float64", known, derivative=str(FIRST_STATE + k))
        SubElement(array, "Dimension", start=str(block.size))


def _structure(
    parent: Element,
    table: Sequence[Scalar],
    blocks: Sequence[Block],
    seen: Mapping[str, Elements],
) -> None:
    """Whole variables and what any of their elements depends on, parameters included."""
    reference = {v.name: k for k, v in enumerate(table, start=FIRST)}
    reference |= {block.name: FIRST_STATE + k for k, block in enumerate(blocks)}
    outputs = [v for v in table if v.causality == "output"]

    def unknown(kind: str, number: int, names: Iterable[str]) -> None:
        depends = sorted(reference[name] for name in set(names))
        text = " ".join(map(str, depends))
        SubElement(parent, kind, valueReference=str(number), dependencies=text)

    for v in outputs:
        names = [*v.depends_on, *_touched([seen.get(v.name, {})])]
        unknown("Output", reference[v.name], names)
    for k, block in enumerate(blocks, start=FIRST_DERIVATIVE):
        names = [name for row in block.derivatives for name in row.names]
        touched = _touched(row.elements for row in block.derivatives)
        unknown("ContinuousStateDerivative", k, [*names, *touched])
    for v in outputs:
        unknown("InitialUnknown", reference[v.name], v.starts_from)
    for k, block in enumerate(blocks):
        unknown("InitialUnknown", FIRST_STATE + k, _any(block.at_rest))
    for k, block in enumerate(blocks):
        unknown("InitialUnknown", FIRST_DERIVATIVE + k, _any(block.derivatives_at_rest))


def _touched(rows: Iterable[Elements]) -> set[str]:
    """Blocks of which any element is there."""
    return {name for row in rows for name, elements in row.items() if elements.size}


def _any(rows: Iterable[Sequence[str]]) -> set[str]:
    return {name for row in rows for name in row}
