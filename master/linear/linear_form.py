"""What all linear models of a component have in common, however they were found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from railcosim.master.component import FloatArray, Variable
from railcosim.master.linear.realisation import ComplexArray


class LinearForm(Protocol):
    """A linear model: `StateSpace` or `LinearModel`."""

    @property
    def name(self) -> str:
        """What responds."""

    @property
    def inputs(self) -> tuple[Variable, ...]:
        """Its inputs."""

    @property
    def outputs(self) -> tuple[Variable, ...]:
        """Its outputs."""

    @property
    def standing(self) -> Mapping[str, float]:
        """Values of all the component's outputs where it was linearised, by name."""

    @property
    def rougher(self) -> Self | None:
        """The same, known less exactly; None if the model is exact but for rounding."""

    @property
    def error_floor(self) -> FloatArray:
        """Relative error at any frequency, beside the difference to the rougher model."""

    def frequency_response(self, omega: ArrayLike) -> ComplexArray:
        """Response to harmonic inputs of unit amplitude, shape (n_omega, n_outputs, n_inputs)."""


def error_estimate(model: LinearForm, omega: ArrayLike) -> FloatArray:
    """Error of the frequency response, from a rougher model and from the checks of this one.

    Parameters
    ----------
    model : LinearForm
        Exact but for rounding where it has no rougher one.
    omega : array_like, shape (n_omega,)
        Angular frequencies, rad/s.

    Returns
    -------
    ndarray, shape (n_outputs, n_inputs)
        Largest over the frequencies, relative to the largest response of the same unit to the
        same input at the same frequency. 0 where all of these are 0.
    """
    if model.rougher is None:
        return model.error_floor
    return np.maximum(model.error_floor, relative_difference(model, model.rougher, omega))


def relative_difference(model: LinearForm, other: LinearForm, omega: ArrayLike) -> FloatArray:
    """Largest difference of two models of the same; see `error_estimate`."""
    response = model.frequency_response(omega)
    difference = np.abs(response - other.frequency_response(omega))
    size = np.abs(response)
    for like in alike(model.outputs):
        size[:, like] = size[:, like].max(axis=1, keepdims=True)
    relative = np.zeros_like(difference)
    np.divide(difference, size, out=relative, where=size > 0.0)
    largest: FloatArray = relative.max(axis=0)
    return largest


def alike(outputs: Sequence[Variable]) -> list[list[int]]:
    """Positions of the outputs of each unit; one without a unit has no like."""
    kinds: dict[str, list[int]] = {}
    for k, output in enumerate(outputs):
        kinds.setdefault(output.unit or output.name, []).append(k)
    return list(kinds.values())
