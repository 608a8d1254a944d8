"""Connected components, and the exchange of values between them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.master.batch.batch import Batch
from railcosim.master.batch.call import By, Call, Row, Span
from railcosim.master.component import Component, FloatArray, Prepared, Variable
from railcosim.master.connections import (
    Connection,
    CouplingError,
    check_connections,
    element_wise,
)
from railcosim.master.continuation import NAMES, Continuation, Held, continuation, follow
from railcosim.master.exchange import exchange_plan
from railcosim.master.suggest import suggest
from railcosim.master.texts import TextWires

OnStep = Callable[[int, float, float, FloatArray], None]
"""Told of a step; see `System`."""


@dataclass(slots=True)
class _Port:
    """What the system knows of one component."""

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


class System:
    """Components, their connections, and the values exchanged.

    Parameters
    ----------
    components : sequence of Component
        With different names.
    connections : iterable of Connection
        For instance from `connect_by_name`; of whole arrays, or of elements.

    Attributes
    ----------
    components : tuple of Component
        In the given order; methods take the index in it.
    connections : tuple of Connection
        As given, but of texts; of arrays those of their elements.
    variables : tuple of Variable
        All outputs of all components.
    names : tuple of str
        Their names as ``component.variable``.
    outputs : array, shape (n_variables,)
        Their present values: one array for ever, changing in place. Copy what you keep.
    on_step : callable or None
        Told of every step of a component, also of those that are repeated: its index, the step's
        beginning and length (s), and value and derivatives of its inputs at the beginning, shape
        (degree + 1, n_inputs), by which they went over it.

    Raises
    ------
    CouplingError
        If a connection is wrong, or outputs depend on each other in an algebraic loop.
    """

    def __init__(self, components: Sequence[Component], connections: Iterable[Connection]) -> None:
        self.components = tuple(components)
        texts = TextWires(self.components, connections)
        self._texts = texts if texts else None
        self.connections = element_wise(self.components, texts.numbers)
        check_connections(self.components, self.connections)
        self.variables: tuple[Variable, ...] = tuple(v for c in components for v in c.outputs)
        self.names = tuple(f"{c.name}.{v.name}" for c in components for v in c.outputs)
        self._span = Span()
        self._ports = _make_ports(self.components, self.connections, self._span)
        self._on_step: OnStep | None = None
        # Behind the outputs stand the start values of all inputs: an input that nothing feeds
        # takes its value from there, so that one gather serves all inputs of a component.
        starts = [v.start for c in components for v in c.inputs]
        self._buffer = np.concatenate([np.zeros(len(self.names)), np.array(starts, dtype=float)])
        self.outputs: FloatArray = self._buffer[: len(self.names)]
        # All inputs in one array, and all sources in another: one gather serves them all.
        self._inputs = np.concatenate([component.u for component in self.components])
        self._sources = np.concatenate([port.sources for port in self._ports])
        for port in self._ports:
            port.component.bind(self._inputs[port.inputs], self._buffer[port.outputs])
            port.calls = port.component.prepared(self._span)
        self._plan = plan = exchange_plan(
            [(p.outputs, p.sources, p.depends, p.component.states_dependence) for p in self._ports],
            self.names,
        )
        for loop in plan.open_loops:
            warnings.warn(
                f"{' -> '.join(self.names[i] for i in loop)}: a loop if each depended at once on "
                "the one before, which the model descriptions do not state. Last values are "
                "exchanged: if there is such a dependence, they come one step late",
                stacklevel=2,
            )
        # Of which components the buffer may not hold the outputs for the present time and inputs:
        # a bit each, since what is to be exchanged goes by all of them.
        self._all = (1 << len(self._ports)) - 1
        self._stale = self._all
        self._steps: dict[tuple[int, ...], tuple[Batch, int]] = {}
        self._exchanges: dict[int, tuple[Batch, int, int]] = {}

    @property
    def on_step(self) -> OnStep | None:
        """See the class."""
        return self._on_step

    @on_step.setter
    def on_step(self, told: OnStep | None) -> None:
        self._on_step = told
        self._steps.clear()

    # --- the exchange --------------------------------------------------------------------------

    def begin(self, t: float) -> None:
        """Make everything consistent at `t` (s), and forget what was before it."""
        self._stale = self._all
        self.exchange()
        for port in self._ports:
            port.continuation.begin(t)

    def exchange(self) -> None:
        """Make all outputs and inputs consistent at the present time.

        Outputs are read after the inputs they depend on directly have been set.
        """
        found = self._exchanges.get(self._stale)
        if found is None:
            found = self._exchanges[self._stale] = self._exchange_of(self._stale)
        batch, self._stale, after = found
        batch.run()
        self._stale = after
        if self._texts is not None:
            self._texts.pass_on()

    def _exchange_of(self, stale: int) -> tuple[Batch, int, int]:
        """What is to be done where so much is stale; what is until it is done, and after it."""
        calls, until = [], stale
        for k, needs_inputs in self._plan.visits:
            port, bit = self._ports[k], 1 << k
            if needs_inputs:
                calls += [self._gathering(port.sources, port.component.u), port.calls.write]
                stale |= bit
                until |= bit
            if stale & bit:
                calls.append(port.calls.read)
                stale &= ~bit
        if self._plan.late:  # the others have been given what they will have
            calls.append(self._gathering(self._sources, self._inputs))
            # No output depends at once on what is new here.
            calls += [self._ports[k].calls.write for k in self._plan.late]
        return Batch(calls), until, stale

    def _gathering(self, sources: NDArray[np.intp], u: FloatArray) -> Call:
        """Put the present values of sources into inputs."""

        def gather() -> None:
            # "clip" only because the default checks every index again; all are in range.
            self._buffer.take(sources, None, u, "clip")

        places = np.ascontiguousarray(sources, dtype=np.int64)
        row = Row(
            kind=By.GATHER, places=places.ctypes.data, count=places.size,
            values=u.ctypes.data, from_=self._buffer.ctypes.data,
        )  # fmt: skip
        return Call(gather, row=row, keeps=places)

    def write_inputs(self, k: int) -> None:
        """Set the inputs of component `k` to what its `u` holds: after a step, where they got to.

        A component whose inputs went on along a polynomial has to be read for its end and not for
        its beginning, or outputs that depend on inputs at once are of first order only.
        """
        port = self._ports[k]
        port.calls.write.make()
        if port.reacts:
            self._stale |= 1 << k

    def refresh(self, k: int) -> None:
        """Read the outputs of component `k`, if they may have changed."""
        if self._stale & 1 << k:
            self._ports[k].calls.read.make()
            self._stale &= ~(1 << k)

    def gather(self, k: int) -> FloatArray:
        """Give the present values of the sources of component `k`, shape (n_inputs,)."""
        return self._buffer.take(self._ports[k].sources)

    # --- for schemes ---------------------------------------------------------------------------

    def set_continuation(self, k: int, degree: int, *, at_end: bool) -> str | None:
        """Choose how the inputs of component `k` go on over a step.

        Parameters
        ----------
        k : int
            The component.
        degree : int
            0 constant, 1 linear, 2 quadratic.
        at_end : bool
            Whether it will be stepped by `step_towards`; else by `step`.

        Returns
        -------
        str or None
            A sentence for the user if the component can only do with a lower degree.
        """
        port = self._ports[k]
        port.continuation = continuation(port.component, degree, at_end=at_end)
        self._steps.clear()
        able = port.continuation.degree
        if able == degree:
            return None
        return (
            f"{port.component.name} cannot {'inter' if at_end else 'extra'}polate its inputs by a "
            f"{NAMES[degree]} polynomial; they are {NAMES[able]}, and the coupling is of order "
            f"{able + 1} in the step."
        )

    def step(self, some: tuple[int, ...], t: float, h: float) -> None:
        """Take components from `t` to `t + h` (s), their inputs going on from those they have."""
        found = self._steps.get(some)
        if found is None:
            found = self._steps[some] = self._steps_of(some)
        batch, bits = found
        self._span.begin.value, self._span.length.value = t, h
        self._stale |= bits
        batch.run()

    def _steps_of(self, some: tuple[int, ...]) -> tuple[Batch, int]:
        """What steps them, and their bits."""
        bits = sum(1 << k for k in some)
        alone = self._on_step is None  # and where inputs are held, an FMU's step is all there is
        return Batch([
            self._ports[k].calls.step
            if alone and not self._ports[k].continuation.degree
            else Call(self._extrapolate, (k,))
            for k in some
        ]), bits  # fmt: skip

    def _extrapolate(self, k: int) -> None:
        """Step one component, and all that goes with it."""
        port, t, h = self._ports[k], self._span.begin.value, self._span.length.value
        port.continuation.extrapolate(t, h)
        if port.reacts:
            port.continuation.go_on(h)
        self._tell(k, t, h)

    def _tell(self, k: int, t: float, h: float) -> None:
        """Tell who wants to know of a step along the component's own polynomial."""
        if self._on_step is not None:
            self._on_step(k, t, h, self._ports[k].continuation.path(t))

    def step_towards(self, k: int, t: float, h: float, u: FloatArray) -> None:
        """Take component `k` from `t` to `t + h` (s), its inputs being `u` at the end."""
        self._stale |= 1 << k
        self._ports[k].continuation.interpolate(t, h, u)
        self._tell(k, t, h)

    def step_along(self, k: int, t: float, h: float, taylor: FloatArray) -> None:
        """Take component `k` from `t` to `t + h` (s) along a given polynomial.

        Parameters
        ----------
        k : int
            The component.
        t, h : float
            Beginning and length of the step, s.
        taylor : array, shape (degree + 1, n_inputs)
            Value and derivatives of the inputs at `t`.
        """
        port = self._ports[k]
        port.component.u[:] = taylor[0]
        port.component.write_inputs()
        self._stale |= 1 << k
        follow(port.component, taylor[1:], t, h)
        if self._on_step is not None:
            self._on_step(k, t, h, taylor.copy())

    def describe_inputs(self) -> dict[str, str]:
        """Tell how the inputs of each component that has some go on over a step."""
        return {
            port.component.name: port.continuation.describe()
            for port in self._ports
            if port.component.inputs
        }

    def degree(self, k: int) -> int:
        """Tell the degree of the polynomial by which the inputs of component `k` go on."""
        return self._ports[k].continuation.degree

    def feeders(self, k: int) -> frozenset[int]:
        """Tell which components feed component `k`."""
        return self._ports[k].feeders

    def reacts(self, k: int) -> bool:
        """Tell whether an output of component `k` that feeds somebody depends on inputs at once.

        On inputs that are fed themselves.
        """
        return self._ports[k].reacts

    def own_outputs(self, k: int) -> slice:
        """Tell where in `outputs` those of component `k` are."""
        return self._ports[k].outputs

    def sources(self, k: int) -> NDArray[np.intp]:
        """Tell where in `outputs` each input of component `k` comes from, shape (n_inputs,).

        A number beyond the end of `outputs` means that nothing feeds the input.
        """
        return self._ports[k].sources

    def index(self, name: str) -> int:
        """Find the index of a component."""
        names = [component.name for component in self.components]
        if name not in names:
            raise CouplingError(
                f"no component {name!r}{suggest(name, names)}; there are {', '.join(names)}"
            )
        return names.index(name)

    # --- state ---------------------------------------------------------------------------------

    @property
    def can_rollback(self) -> bool:
        """Whether all components can go back to a snapshot."""
        return all(component.can_rollback for component in self.components)

    def keep_past(self) -> None:
        """Tell all components that steps may be taken back from now on."""
        for component in self.components:
            component.keep_past()

    def save_state(self) -> Any:
        """Snapshot of all components and of the values exchanged."""
        return (
            [port.component.save_state() for port in self._ports],
            [
                (port.component.u.copy(), port.continuation.past, not self._stale >> k & 1)
                for k, port in enumerate(self._ports)
            ],
            self.outputs.copy(),
        )

    def restore_state(self, state: Any) -> None:
        """Go back to a snapshot, which stays usable."""
        components, values, outputs = state
        self._stale = 0
        for k, port in enumerate(self._ports):
            u, past, fresh = values[k]
            port.component.restore_state(components[k])
            port.component.u[:] = u
            port.continuation.past = past
            self._stale |= (not fresh) << k
        self.outputs[:] = outputs

    def serialize_state(self, state: Any) -> Any:
        """Make a snapshot plain values, to be kept in a file; see `plain`."""
        snapshots, values, outputs = state
        data = [c.serialize_state(s) for c, s in zip(self.components, snapshots, strict=True)]
        return data, values, outputs

    def deserialize_state(self, plain: Any) -> Any:
        """Make a snapshot of what `serialize_state` gave, also in another process.

        Raises
        ------
        ValueError
            If its sizes are not those of this system, or a value is not finite.
        """
        data, values, outputs = plain
        for port, (u, past, _) in zip(self._ports, values, strict=True):
            name, n = port.component.name, port.component.u.size
            if not all(_is_finite(v, n) for v in (u, *(x for _, x in past))):
                raise ValueError(f"{name}: its inputs must be {n} finite numbers")
        if not _is_finite(outputs, len(self.outputs)):
            raise ValueError(f"the outputs must be {len(self.outputs)} finite numbers")
        pairs = zip(self.components, data, strict=True)
        return [c.deserialize_state(d) for c, d in pairs], values, outputs


def _is_finite(values: Any, n: int) -> bool:
    """Tell whether these are `n` finite numbers."""
    return np.shape(values) == (n,) and bool(np.isfinite(values).all())


def _make_ports(
    components: tuple[Component, ...], connections: tuple[Connection, ...], span: Span
) -> tuple[_Port, ...]:
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
            _Port(
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
