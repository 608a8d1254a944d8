"""Which output feeds which input: made by name, and checked."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

from railcosim.master.component import Component, Type, Variable
from railcosim.master.suggest import suggest


class CouplingError(ValueError):
    """Components cannot be connected as asked; the message names them and the variables."""


@dataclass(frozen=True)
class Connection:
    """One output feeding one input.

    Attributes
    ----------
    source, output : str
        Component and its output.
    target, input : str
        Component and its input.
    delayed : bool
        Whether the input is given what the output was before the exchange, where the target's own
        outputs need it: so an algebraic loop is opened.
    """

    source: str
    output: str
    target: str
    input: str
    delayed: bool = False

    def __str__(self) -> str:
        return f"{self.source}.{self.output} -> {self.target}.{self.input}"


def connect_by_name(
    components: Sequence[Component], required: Iterable[str] = ()
) -> tuple[Connection, ...]:
    """Connect every output to the inputs of the same name in the other components.

    Parameters
    ----------
    components : sequence of Component
        With different names.
    required : iterable of str, optional
        Inputs that must be connected, as ``variable`` (in whatever component) or
        ``component.variable``.

    Returns
    -------
    tuple of Connection
        In the order of the components and of their inputs.

    Raises
    ------
    CouplingError
        If an input has two sources, a unit differs from its source's, or a required input is
        left without one.
    """
    connections = tuple(
        Connection(source.name, output.name, target.name, input_.name)
        for target in components
        for input_ in target.inputs
        for source in components
        if source is not target
        for output in source.outputs
        if output.name == input_.name
    )
    check_connections(components, connections)
    wanted = set(required)
    inputs = {name for c in components for v in c.inputs for name in (v.name, f"{c.name}.{v.name}")}
    for name in sorted(wanted - inputs):
        raise CouplingError(f"no component has the required input {name!r}{suggest(name, inputs)}")
    missing = [
        f"{target}.{name}"
        for target, name in _free(components, connections)
        if name in wanted or f"{target}.{name}" in wanted
    ]
    if missing:
        raise CouplingError(f"no output feeds the required inputs {', '.join(missing)}")
    return connections


def element_wise(
    components: Sequence[Component], connections: Iterable[Connection]
) -> tuple[Connection, ...]:
    """Connections with those of whole arrays as connections of their elements.

    Raises
    ------
    CouplingError
        If two arrays are of different lengths, or one meets a single value.
    """
    outputs = {c.name: {v.name: v for v in c.outputs} for c in components}
    inputs = {c.name: {v.name: v for v in c.inputs} for c in components}
    return tuple(
        c if (output, input_) == (c.output, c.input) else replace(c, output=output, input=input_)
        for c in connections
        for output, input_ in element_pairs(
            str(c), (c.output, outputs.get(c.source, {})), (c.input, inputs.get(c.target, {}))
        )
    )


def element_pairs(
    connection: str, output: tuple[str, Collection[str]], input_: tuple[str, Collection[str]]
) -> list[tuple[str, str]]:
    """Which element feeds which, of two names that may be those of whole arrays.

    Parameters
    ----------
    connection : str
        For the message.
    output, input_ : tuple of (str, collection of str)
        A name, and what names there are.

    Raises
    ------
    CouplingError
        If the two do not fit.
    """
    if output[0] in output[1] and input_[0] in input_[1]:
        return [(output[0], input_[0])]
    ends = [_indices(*end) for end in (output, input_)]
    if not any(ends):
        return [(output[0], input_[0])]  # names that there are not are for others to tell
    if ends[0] != ends[1]:
        sizes = [f"an array of {len(end)}" if end else "one value" for end in ends]
        raise CouplingError(f"{connection}: {sizes[0]} feeds {sizes[1]}; their indices must agree")
    return [(output[0] + index, input_[0] + index) for index in ends[0]]


def _indices(name: str, known: Collection[str]) -> list[str]:
    """Indices of the elements of an array, ``[1]``, ``[2]`` ...; none if there is no such array."""
    if name in known:
        return []
    index = re.compile(re.escape(name) + r"(\[\d+(?:,\d+)*\])")
    return [match[1] for one in known if (match := index.fullmatch(one))]


def check_connections(components: Sequence[Component], connections: Iterable[Connection]) -> None:
    """Check connections against the components' interfaces.

    Raises
    ------
    CouplingError
        For two components of one name, a name that does not exist, an input with two sources,
        two different units, or a type that does not fit.
    """
    names = [component.name for component in components]
    if len(set(names)) < len(names):
        raise CouplingError(f"component names must differ, got {', '.join(names)}")
    outputs = {c.name: {v.name: v for v in c.outputs} for c in components}
    inputs = {c.name: {v.name: v for v in c.inputs} for c in components}
    sources: dict[tuple[str, str], Connection] = {}
    for connection in connections:
        output = _find("output", outputs, connection.source, connection.output)
        input_ = _find("input", inputs, connection.target, connection.input)
        other = sources.setdefault((connection.target, connection.input), connection)
        if other is not connection:
            raise CouplingError(f"two sources for one input: {other} and {connection}")
        if output.unit and input_.unit and output.unit != input_.unit:
            raise CouplingError(f"{connection}: unit {output.unit} feeds unit {input_.unit}")
        check_types(str(connection), output, input_)


def check_types(connection: str, output: Variable, input_: Variable) -> None:
    """Refuse an output that has values its input has not.

    Raises
    ------
    CouplingError
        Naming the types, or the item of an enumeration.
    """
    source, target = output.type, input_.type
    if target not in source.fits:
        fitting = ", ".join(t.value for t in Type if t in source.fits)
        raise CouplingError(
            f"{connection}: {source.value} values feed type {target.value}, which cannot hold them "
            f"all; {source.value} outputs feed {fitting}"
        )
    if output.items and input_.items:
        for name, number in output.items:
            if (name, number) not in input_.items:
                known = ", ".join(f"{k} = {v}" for k, v in input_.items)
                raise CouplingError(
                    f"{connection}: item {name} = {number} of the one enumeration is not in the "
                    f"other, which has {known}"
                )


def _find(
    kind: str, table: dict[str, dict[str, Variable]], component: str, variable: str
) -> Variable:
    """One variable of one component."""
    if component not in table:
        raise CouplingError(f"no component {component!r}{suggest(component, table)}")
    if variable not in table[component]:
        raise CouplingError(
            f"{component} has no {kind} {variable!r}{suggest(variable, table[component])}"
        )
    return table[component][variable]


def _free(
    components: Sequence[Component], connections: Iterable[Connection]
) -> list[tuple[str, str]]:
    """Component and name of every input that nothing feeds."""
    fed = {(c.target, c.input) for c in connections}
    pairs = [(component.name, v.name) for component in components for v in component.inputs]
    return [pair for pair in pairs if pair not in fed]
