"""A component whose motion is given from outside, so that a step of it needs no states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railcosim.master.component import Component, FloatArray, Variable
from railcosim.master.linear.modal import Modal
from railcosim.master.linear.state_space import StateSpace

TICK = 1e-15
"""Unit of time inside a step, s: times are told apart by whole numbers of it."""


class Open(Component):
    """A component whose motion is given from outside, and that takes note of what it is fed.

    What it is fed within a step shows only in what goes straight through.

    Parameters
    ----------
    name, inputs, outputs
        See `Component`.
    model : Modal, StateSpace or None
        What moves; None for a signal.
    stated : array of bool, shape (n_outputs, n_inputs), optional
        Outputs that are stated to depend at once on an input, whatever comes of it: what is read
        how often at a communication point depends on that.

    Attributes
    ----------
    model
        As given.
    motion : dict of (int, bool) to array, shape (n_outputs,)
        The outputs, or their rates if True; by time after the beginning of the step, in ticks.
        These are what a scheme has asked for so far.
    fed : tuple of (int, float, array)
        Beginning in ticks and length (s) of each step made, and value and derivatives of the
        inputs then, shape (3, n_inputs).
    """

    can_rollback = True
    max_input_derivative = 2

    def __init__(
        self,
        name: str,
        inputs: Sequence[Variable],
        outputs: Sequence[Variable],
        model: Modal | StateSpace | None = None,
        stated: NDArray[np.bool_] | None = None,
    ) -> None:
        super().__init__(name, inputs, outputs)
        self.model = model
        self.motion: dict[tuple[int, bool], FloatArray] = {}
        self.fed: tuple[tuple[int, float, FloatArray], ...] = ()
        self._D = np.zeros((len(self.outputs), 0)) if model is None else model.D
        self._stated = np.zeros(self._D.shape, dtype=bool) if stated is None else stated
        self._now = 0
        self._inputs = self.u.copy()
        self._derivatives: FloatArray = np.zeros((2, len(self.inputs)))

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """Whether an output depends at once on an input, shape (n_outputs, n_inputs)."""
        if self.model is None:
            return np.ones(self._D.shape, dtype=bool)
        through: NDArray[np.bool_] = (self._D != 0.0) | self._stated
        return through

    def begin(self) -> None:
        """Forget the steps made: time is counted from now on."""
        self._now, self.fed = 0, ()

    def write_inputs(self) -> None:
        """Make `u` the inputs at the present time."""
        self._inputs = self.u.copy()

    def set_input_derivatives(self, derivatives: FloatArray) -> None:
        """Give derivatives of the inputs for the next step; see `Component`."""
        self._derivatives = np.zeros((2, len(self.inputs)))
        self._derivatives[: len(derivatives)] = derivatives

    def do_step(self, t: float, h: float) -> None:
        """Take note of the step."""
        taylor = np.concatenate([self._inputs[None], self._derivatives])
        self.fed = (*self.fed, (self._now, h, taylor))
        self._inputs = np.array([1.0, h, h * h / 2.0]) @ taylor  # as FMUs leave them
        self._derivatives = np.zeros((2, len(self.inputs)))
        self._now += round(h / TICK)

    def read_outputs(self) -> None:
        """Put the motion, and what goes straight through, into `y`."""
        self.y[:] = self._moving(is_rate=False) + self._D @ self._inputs

    def output_rates(self) -> FloatArray | None:
        """Rates of the outputs at the present time; see `Component`."""
        if self.model is None:
            return None
        rates: FloatArray = self._moving(is_rate=True) + self._D @ self._derivatives[0]
        return rates

    def step_derivative(self) -> FloatArray | None:
        """Change of the outputs per change of an input held over the last step: it shows later."""
        return None if self.model is None else self._D

    def save_state(self) -> Any:
        """Snapshot; what was fed in this step is not memory, so it is wrapped up."""
        return _Wrapped((self._now, self.fed)), self._inputs, self._derivatives

    def restore_state(self, state: Any) -> None:
        """Go back to a snapshot."""
        wrapped, self._inputs, self._derivatives = state
        self._now, self.fed = wrapped.content

    def _moving(self, *, is_rate: bool) -> FloatArray:
        return self.motion.setdefault((self._now, is_rate), np.zeros(len(self.outputs)))


@dataclass(frozen=True)
class _Wrapped:
    """Something in a snapshot that is not memory."""

    content: Any
