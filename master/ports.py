"""What a system knows of each of its components."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railcosim.master.batch.call import Span
from railcosim.master.component import Component, Prepared
from railcosim.master.connections import Connection
from railcosim.master.continuation import Continuation, Held


@dataclass(slots=True)
class Port:
    """A component in a system, whose outputs and start values are all in one buffer."""

    component: Component
    outputs: slice
    """Its outputs in the buffer."""
    inputs: slice
    """Its inputs among those of all components."""
    sources: NDArray[np.intp]
    """Where in the buffer each input comes from, shape (n_inputs,)."""
    delayed: NDArray[np.bool_]
    """Which of them are given what was there before the exchange, shape (n_inputs,)."""
    feeders: frozenset[int]
    """The components that feed it."""
    reacts: bool
    """Whether an output that feeds somebody depends at once on a connected input."""
    continuation: Continuation
    """How its inputs go on over a step."""
    calls: Prepared
    """Its own."""

    @property
    def depends(self) -> NDArray[np.bool_]:
        """Which outputs depend at once on inputs that are not given late."""
        found: NDArray[np.bool_] = self.component.feedthrough & ~self.delayed
        return found


def make_ports(
    components: tuple[Component, ...], connections: tuple[Connection, ...], span: Span
) -> tuple[Port, ...]:
    """Index arrays of every component."""
    n_outputs = sum(len(c.outputs) for c in components)
    outputs = {(c.name, v.name): (k, v) for k, c in enumerate(components) for v in c.outputs}
    position = {key: i for i, key in enumerate(outputs)}
    late = {(c.target, c.input) for c in connections if c.delayed}
    source_of = {(c.target, c.input): (c.source, c.output) for c in connections}
    feeds = np.zeros(n_outputs, dtype=bool)
    feeds[[position[c.source, c.output] for c in connections]] = True
    ports = []
    first_output, first_start = 0, n_outputs
    for component in components:
        sources = np.arange(first_start, first_start + len(component.inputs))
        feeders = set()
        for j, variable in enumerate(component.inputs):
            source = source_of.get((component.name, variable.name))
            if source is not None:
                sources[j] = position[source]
                feeders.add(outputs[source][0])
        last_output = first_output + len(component.outputs)
        first_input = first_start - n_outputs
        own = slice(first_output, last_output)
        ports.append(
            Port(
                component=component,
                outputs=own,
                inputs=slice(first_input, first_input + len(component.inputs)),
                sources=sources,
                delayed=np.array(
                    [(component.name, v.name) in late for v in component.inputs], bool
                ),
                feeders=frozenset(feeders),
                continuation=Held(component),
                calls=component.prepared(span),
                reacts=bool(component.feedthrough[feeds[own]][:, sources < n_outputs].any()),
            )
        )
        first_output, first_start = last_output, first_start + len(component.inputs)
    return tuple(ports)
