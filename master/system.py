"""Connected components, and the exchange of values between them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.master.batch.batch import Batch
from railcosim.master.batch.call import Call, Span
from railcosim.master.component import Component, FloatArray, Variable
from railcosim.master.connections import (
    Connection,
    CouplingError,
    check_connections,
    element_wise,
)
from railcosim.master.continuation import NAMES, continuation, follow
from railcosim.master.exchange import exchange_plan
from railcosim.master.exchanges import Exchanges
from railcosim.master.ports import make_ports
from railcosim.master.suggest import suggest
from railcosim.master.texts import TextWires

OnStep = Callable[[int, float, float, FloatArray], None]
"""Told of a step; see `System`."""


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
        self._ports = make_ports(self.components, self.connections, self._span)
        self._on_step: OnStep | None = None
        # Behind the outputs stand the start values of all inputs: an input that nothing feeds
        # takes its value from there, so that one gather serves all inputs of a component.
        starts = [v.start for c in components for v in c.inputs]
        self._buffer = np.concatenate([np.zeros(len(self.names)), np.array(starts, dtype=float)])
        self.outputs: FloatArray = self._buffer[: len(self.names)]
        self._inputs = np.concatenate([component.u for component in self.components])
        for port in self._ports:
            port.component.bind(self._inputs[port.inputs], self._buffer[port.outputs])
            port.calls = port.component.prepared(self._span)
        plan = exchange_plan(
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
        self._exchanges = Exchanges(self._ports, plan, self._buffer, self._inputs)

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
        batch, self._stale, after = self._exchanges.of(self._stale)
        batch.run()
        self._stale = after
        if self._texts is not None:
            self._texts.pass_on()

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
