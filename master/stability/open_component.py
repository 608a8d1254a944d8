"""A component whose own motion is left open, so that a step of it needs no states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from railcosim.master.component import Component, FloatArray, Variable
from railcosim.master.linear.modal import Modal, fractions, real_form
from railcosim.master.linear.state_space import ComplexArray

TICK = 1e-15
"""Unit of time inside a step, s: times are told apart by whole numbers of it."""


class Open(Component):
    """A component whose free motion is given from outside.

    Attributes
    ----------
    free : dict of (int, bool) to array, shape (n_outputs,)
        The outputs, or their rates if True, if nothing were fed; by time after the beginning of
        the step, in ticks. These are what a scheme has asked for so far.
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
        model: Modal | None = None,
    ) -> None:
        super().__init__(name, inputs, outputs)
        self.model = model
        self.free: dict[tuple[int, bool], FloatArray] = {}
        self.fed: tuple[tuple[int, float, FloatArray], ...] = ()
        self._now = 0
        self._inputs = self.u.copy()
        self._derivatives: FloatArray = np.zeros((2, len(self.inputs)))
        self._answers: dict[tuple[int, float, bool], FloatArray] = {}

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """Whether an output depends at once on an input, shape (n_outputs, n_inputs)."""
        if self.model is None:
            return np.ones((len(self.outputs), 0), dtype=bool)
        through: NDArray[np.bool_] = self.model.D != 0.0
        return through

    def begin(self) -> None:
        """Forget the steps made: the free motion is counted from now on."""
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
        self._derivatives = np.zeros((2, len(self.inputs)))
        self._now += round(h / TICK)

    def read_outputs(self) -> None:
        """Put the free motion and the answer to what was fed into `y`."""
        self.y[:] = self._observed(is_rate=False)
        if self.model is not None:
            self.y += self.model.D @ self._inputs

    def output_rates(self) -> FloatArray | None:
        """Rates of the outputs at the present time; see `Component`."""
        if self.model is None:
            return None
        rates = self._observed(is_rate=True)
        rates += 2.0 * (self.model.C @ self.model.B).real @ self._inputs
        rates += self.model.D @ self._derivatives[0]
        return rates

    def step_derivative(self) -> FloatArray | None:
        """Change of the outputs per change of an input held over the last step."""
        if self.model is None or not self.fed:
            return None
        return self._answer(0, self.fed[-1][1], is_rate=False)[:, : len(self.inputs)] + self.model.D

    def save_state(self) -> Any:
        """Snapshot; what was fed in this step is not memory, so it is wrapped up."""
        return _Wrapped((self._now, self.fed)), self._inputs, self._derivatives

    def restore_state(self, state: Any) -> None:
        """Go back to a snapshot."""
        wrapped, self._inputs, self._derivatives = state
        self._now, self.fed = wrapped.content

    def sampled(self, h: float, fed: Sequence[tuple[int, float]]) -> Sampled:
        """Free motion at the times asked for, by what was fed: all outputs, all inputs."""
        assert self.model is not None
        model, poles = self.model, self.model.poles
        G = [
            np.exp(poles * (h - begin * TICK - length))[:, None] * model.sampled(length)[1]
            for begin, length in fed
        ]
        C = np.concatenate([self._seen(*asked) for asked in self.free])
        return Sampled(E=np.exp(poles * h), G=np.concatenate(G, axis=1), C=C)

    def _observed(self, *, is_rate: bool) -> FloatArray:
        """Outputs or their rates now, without what the present inputs add."""
        asked = self._now, is_rate
        total = self.free.setdefault(asked, np.zeros(len(self.outputs))).copy()
        if self.model is not None:
            for begin, h, taylor in self.fed:
                after = self._now - begin - round(h / TICK)
                total += self._answer(after, h, is_rate=is_rate) @ taylor.ravel()
        return total

    def _answer(self, after: int, h: float, *, is_rate: bool) -> FloatArray:
        """Outputs some ticks after a step of length `h`, by value and derivatives of the inputs."""
        assert self.model is not None
        key = after, h, is_rate
        if key not in self._answers:
            self._answers[key] = 2.0 * (self._seen(after, is_rate) @ self.model.sampled(h)[1]).real
        return self._answers[key]

    def _seen(self, tick: int, is_rate: bool) -> ComplexArray:
        """What the modes at the beginning do to the outputs, or their rates, at a time."""
        assert self.model is not None
        model = self.model
        seen: ComplexArray = model.C * np.exp(model.poles * (tick * TICK))
        return seen * model.poles if is_rate else seen


@dataclass(frozen=True, kw_only=True)
class Sampled:
    """Modes over a step: q' = E q + G w, f = 2 Re(C q); one of each pair of conjugate modes.

    Attributes
    ----------
    E : array of complex, shape (n,)
        Factor of every mode.
    G : array of complex, shape (n, n_w)
        What is fed.
    C : array of complex, shape (n_f, n)
        What is seen. A real factor counts half.
    """

    E: ComplexArray
    G: ComplexArray
    C: ComplexArray

    def response(self, z: ComplexArray) -> ComplexArray:
        """What w brings back as f, shape (n_z, n_f, n_w)."""
        return fractions(z, self.E, self.G, self.C)

    def real(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The same in real states, q' = A q + B w, f = C q."""
        return real_form(self.E, self.G, self.C)

    def of_inputs(self, which: NDArray[np.bool_]) -> Sampled:
        """Only some of what is fed."""
        return replace(self, G=self.G[:, which])


def together(parts: Sequence[Sampled]) -> Sampled:
    """Several components side by side."""
    none = np.zeros((0, 0))
    return Sampled(
        E=np.concatenate([np.zeros(0, complex), *(part.E for part in parts)]),
        G=np.asarray(scipy.linalg.block_diag(none, *(part.G for part in parts)), dtype=complex),
        C=np.asarray(scipy.linalg.block_diag(none, *(part.C for part in parts)), dtype=complex),
    )


@dataclass(frozen=True)
class _Wrapped:
    """Something in a snapshot that is not memory."""

    content: Any
