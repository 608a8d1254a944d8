"""A component seen through other units: each input a linear function of what feeds it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import Component, ComponentError, FloatArray, Hold, Variable
from railcosim.master.units import IDENTITY, Linear


class MappedInputs(Component):
    """A component whose inputs are ``factor * u + offset``.

    Polynomials in time stay polynomials, so every scheme works on it as on the component itself.

    Parameters
    ----------
    inner : Component
        What is stepped; used through this object only from now on.
    inputs : sequence of Variable
        Its inputs as they are seen from outside, in the same order: unit and start value.
    maps : sequence of Linear or mapping
        From each input seen from outside to that of `inner`; what is no Real may have a table.

    Attributes
    ----------
    inner : Component
        As given.
    """

    def __init__(
        self,
        inner: Component,
        inputs: Sequence[Variable],
        maps: Sequence[Linear | Mapping[float, float]],
    ) -> None:
        super().__init__(inner.name, inputs, inner.outputs)
        self.inner = inner
        self.holds = inner.holds
        self.max_input_derivative = inner.max_input_derivative
        self.takes_any_step = inner.takes_any_step
        lines = [m if isinstance(m, Linear) else IDENTITY for m in maps]
        self._factor = np.array([m.factor for m in lines])
        self._offset = np.array([m.offset for m in lines])
        self._tables = [(j, m) for j, m in enumerate(maps) if not isinstance(m, Linear)]
        self._inner_u = np.empty(len(self.inputs))
        self.bind(self.u, self.y)

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """Whether an output depends at once on an input, shape (n_outputs, n_inputs)."""
        return self.inner.feedthrough

    @property
    def states_dependence(self) -> NDArray[np.bool_]:
        """As the component's."""
        return self.inner.states_dependence

    @property
    def can_rollback(self) -> bool:  # type: ignore[override]
        """Whether `save_state` and `restore_state` work."""
        return self.inner.can_rollback

    @property
    def rollback_fault(self) -> str | None:
        """Why they do not; None if they do."""
        return self.inner.rollback_fault

    def bind(self, u: FloatArray, y: FloatArray) -> None:
        """Exchange values through these arrays from now on; see `Component.bind`."""
        super().bind(u, y)
        self.inner.bind(self._inner_u, y)

    def write_inputs(self) -> None:
        """Make `u`, converted, the inputs at the present time."""
        np.multiply(self._factor, self.u, out=self._inner_u)
        self._inner_u += self._offset
        for j, table in self._tables:
            value = float(self.u[j])
            if value not in table:
                raise ComponentError(
                    f"{self.name}: its input {self.inputs[j].name} is given {value:g}, which its "
                    f"mapping does not have; it has {', '.join(f'{known:g}' for known in table)}"
                )
            self._inner_u[j] = table[value]
        self.inner.write_inputs()

    def read_outputs(self) -> None:
        """Put the outputs into `y`."""
        self.inner.read_outputs()

    def do_step(self, t: float, h: float) -> None:
        """Go from time `t` to `t + h` (s). Raises ComponentError."""
        self.inner.do_step(t, h)

    def expect_step(self, step: float) -> None:
        """Be told how long (s) steps will be."""
        self.inner.expect_step(step)

    def set_hold(self, hold: Hold) -> None:
        """Choose how the inputs continue from now on."""
        self.inner.set_hold(hold)

    def set_input_derivatives(self, derivatives: FloatArray) -> None:
        """Give derivatives of the inputs; an offset has none."""
        self.inner.set_input_derivatives(self._factor * derivatives)

    def step_derivative(self) -> FloatArray | None:
        """Change of the outputs over the last step per change of an input."""
        derivative = self.inner.step_derivative()
        return None if derivative is None else derivative * self._factor

    @property
    def texts_in(self) -> Mapping[str, str]:
        """As the component's."""
        return self.inner.texts_in

    @property
    def texts_out(self) -> Mapping[str, str]:
        """Likewise."""
        return self.inner.texts_out

    def get_text(self, name: str) -> bytes:
        """What a text is now."""
        return self.inner.get_text(name)

    def set_text(self, name: str, text: bytes) -> None:
        """Give a text."""
        self.inner.set_text(name, text)

    def keep_past(self) -> None:
        """Be told that steps may be taken back from now on."""
        self.inner.keep_past()

    def save_state(self) -> Any:
        """Snapshot of everything that decides the future."""
        return self.inner.save_state()

    def restore_state(self, state: Any) -> None:
        """Go back to a snapshot, which stays usable."""
        self.inner.restore_state(state)

    def serialize_state(self, state: Any) -> bytes:
        """Write a snapshot as bytes, to be kept in a file."""
        return self.inner.serialize_state(state)

    def deserialize_state(self, data: bytes) -> Any:
        """Read what `serialize_state` wrote."""
        return self.inner.deserialize_state(data)
