"""Connections of texts and bytes: passed on at communication points, beside all numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from railcosim.master.component import Component
from railcosim.master.connections import Connection, CouplingError


class TextWires:
    """Those of a system's connections that pass texts or bytes on.

    Parameters
    ----------
    components : sequence of Component
        Of the system.
    connections : iterable of Connection
        All of it.

    Attributes
    ----------
    numbers : tuple of Connection
        The other connections.

    Raises
    ------
    CouplingError
        If a text feeds what is none, or bytes feed a text.
    """

    def __init__(self, components: Sequence[Component], connections: Iterable[Connection]) -> None:
        known = {component.name: component for component in components}
        self._wires: list[tuple[Component, str, Component, str]] = []
        numbers = []
        for c in connections:
            source, target = known.get(c.source), known.get(c.target)
            kinds = (
                source and source.texts_out.get(c.output),
                target and target.texts_in.get(c.input),
            )
            if not any(kinds):
                numbers.append(c)
                continue
            if kinds[0] != kinds[1]:
                what = [kind or "what is no text" for kind in kinds]
                raise CouplingError(f"{c}: {what[0]} feeds {what[1]}; both must be of one type")
            assert source is not None
            assert target is not None
            self._wires.append((source, c.output, target, c.input))
        self.numbers = tuple(numbers)

    def __bool__(self) -> bool:
        return bool(self._wires)

    def pass_on(self) -> None:
        """Give every input what its source says now."""
        found = [source.get_text(output) for source, output, _, _ in self._wires]
        for (_, _, target, input_), text in zip(self._wires, found, strict=True):
            target.set_text(input_, text)
