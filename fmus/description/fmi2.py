"""modelDescription.xml of FMI 2.0."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement

from ..interface import Scalar
from .about import TOOL, Description
from .common import annotate, boolean, frame, identity, local, to_bytes, value_attributes
from .structure import Elements, States

FIRST_STATE, FIRST_DERIVATIVE = 2**16, 2**24  # value references
KNOWN = {"input", "independent"}  # after initialisation; parameters do not count there


def model_description(
    about: Description,
    table: Sequence[Scalar],
    states: States | None = None,
    sources: Sequence[str] = (),
) -> bytes:
    """The XML of an FMU for co-simulation and, if it shows its states, model exchange.

    A variable's value reference is its place in the table.

    Parameters
    ----------
    about : Description
        Of the FMU.
    table : sequence of Scalar
        Its interface.
    states : States, optional
        Its continuous states.
    sources : sequence of str
        C files to be compiled, relative to ``sources/``.
    """
    root = Element("fmiModelDescription", fmiVersion="2.0", guid=about.guid)
    root.attrib.update(about.attributes())
    _interface_types(root, about, sources, model_exchange=states is not None)
    frame(root, about, table, model_exchange=states is not None)
    if about.annotations:
        annotate(SubElement(SubElement(root, "VendorAnnotations"), "Tool", name=TOOL), about)
    variables = SubElement(root, "ModelVariables")
    for reference, v in enumerate(table):
        scalar = SubElement(variables, "ScalarVariable", identity(v, reference))
        SubElement(scalar, v.type, value_attributes(v))
    if states is not None:
        _state_variables(variables, len(table), states)
    _structure(SubElement(root, "ModelStructure"), table, states)
    return to_bytes(root)


def _interface_types(
    root: Element, about: Description, sources: Sequence[str], *, model_exchange: bool
) -> None:
    can = about.capabilities
    common = {
        "modelIdentifier": about.name,
        "needsExecutionTool": boolean(can.needs_execution_tool),
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "providesDirectionalDerivative": boolean(can.directional_derivatives),
    }
    exchange = {"completedIntegratorStepNotNeeded": "true"}
    simulation = {
        "canHandleVariableCommunicationStepSize": "true",
        "canInterpolateInputs": boolean(can.interpolates_inputs),
        "maxOutputDerivativeOrder": str(can.output_derivatives),
    }
    types = {"ModelExchange": exchange} if model_exchange else {}
    for name, own in (types | {"CoSimulation": simulation}).items():
        parent = SubElement(root, name, common | own)
        if sources:
            files = SubElement(parent, "SourceFiles")
            for source in sources:
                SubElement(files, "File", name=source)


def _state_variables(parent: Element, before: int, states: States) -> None:
    """All states, then all derivatives; `before` variables are there already."""
    rows = [(f"{b.name}[{k + 1}]", b) for b in states.blocks for k in range(b.size)]
    for k, (name, block) in enumerate(rows):
        known = local(name, FIRST_STATE + k, "state")
        SubElement(SubElement(parent, "ScalarVariable", known), "Real", nominal=repr(block.nominal))
    for k, (name, _) in enumerate(rows):
        known = local(f"der({name})", FIRST_DERIVATIVE + k, "its time derivative")
        real = SubElement(parent, "ScalarVariable", known)
        SubElement(real, "Real", derivative=str(before + k + 1))


class _Indices:
    """Places of variables in the list of all, from 1."""

    def __init__(self, table: Sequence[Scalar], states: States | None) -> None:
        self.of = {v.name: k for k, v in enumerate(table, start=1)}
        self.blocks: dict[str, int] = {}  # of their first elements
        place = len(table) + 1
        for block in states.blocks if states is not None else ():
            self.blocks[block.name] = place
            place += block.size

    def names(self, names: Sequence[str]) -> list[int]:
        return [self.of[name] for name in names]

    def elements(self, elements: Elements) -> list[int]:
        return [k for name, own in elements.items() for k in (self.blocks[name] + own).tolist()]


def _structure(parent: Element, table: Sequence[Scalar], states: States | None) -> None:
    """Outputs, derivatives and initial unknowns with exactly what they depend on."""
    index = _Indices(table, states)
    known = {v.name for v in table if v.causality in KNOWN}
    outputs = [v for v in table if v.causality == "output"]
    seen: Mapping[str, Elements] = states.outputs if states is not None else {}
    listed = SubElement(parent, "Outputs")
    for v in outputs:
        depends = index.names([name for name in v.depends_on if name in known])
        _unknown(listed, index.of[v.name], depends + index.elements(seen.get(v.name, {})))
    initial = [(index.of[v.name], index.names(v.starts_from)) for v in outputs]
    if states is not None:
        listed = SubElement(parent, "Derivatives")
        for block in states.blocks:
            first = index.blocks[block.name] + states.size
            for k, row in enumerate(block.derivatives, start=first):
                _unknown(listed, k, index.names(row.names) + index.elements(row.elements))
        initial += _initial_states(states, index)
    listed = SubElement(parent, "InitialUnknowns")
    for number, depends in sorted(initial):
        _unknown(listed, number, depends)


def _initial_states(states: States, index: _Indices) -> Iterator[tuple[int, list[int]]]:
    for block in states.blocks:
        first = index.blocks[block.name]
        for k, names in enumerate(block.at_rest, start=first):
            yield k, index.names(names)
        for k, names in enumerate(block.derivatives_at_rest, start=first + states.size):
            yield k, index.names(names)


def _unknown(parent: Element, number: int, depends: list[int]) -> None:
    text = " ".join(map(str, sorted(depends)))
    SubElement(parent, "Unknown", index=str(number), dependencies=text)
