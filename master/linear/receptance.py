"""Frequency responses of linear models, with the names of their inputs and outputs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from railcosim.master.component import FloatArray
from railcosim.master.linear.linear_form import LinearForm
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.suggest import suggest


@dataclass(frozen=True, kw_only=True)
class Response(ABC):
    """Harmonic outputs for harmonic inputs, time factor exp(i omega t).

    Attributes
    ----------
    name : str
        What responds.
    omega : ndarray, shape (n_omega,)
        Angular frequencies, rad/s.
    outputs : tuple of str, length n_outputs
        Names of the outputs.
    inputs : tuple of str, length n_inputs
        Names of the inputs.
    """

    name: str
    omega: FloatArray
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]

    @abstractmethod
    def to(self, inputs: Sequence[str], loads: ArrayLike) -> ComplexArray:
        """Responses of all outputs to several loads, each of them on some of the inputs.

        Parameters
        ----------
        inputs : sequence of str
            The inputs acting, n_acting of them.
        loads : array_like of complex, shape (n_omega or 1, n_acting, n_loads)
            Their amplitudes.

        Returns
        -------
        ndarray of complex, shape (n_omega, n_outputs, n_loads)

        Raises
        ------
        ValueError
            If a name is unknown.
        """

    def of(self, output: str, input_: str) -> ComplexArray:
        """Response of one output to one input.

        Parameters
        ----------
        output, input_ : str
            Their names.

        Returns
        -------
        ndarray of complex, shape (n_omega,)

        Raises
        ------
        ValueError
            If a name is unknown.
        """
        (row,) = self.rows([output])
        values: ComplexArray = self.combined([input_], [1.0])[:, row]
        return values

    def combined(self, inputs: Iterable[str], weights: ArrayLike) -> ComplexArray:
        """Response of all outputs to inputs that act together.

        Parameters
        ----------
        inputs : iterable of str
            The inputs acting, n_acting of them.
        weights : array_like of complex, shape (n_omega, n_acting) or (n_acting,)
            Their amplitudes; see `lag` for inputs that follow each other.

        Returns
        -------
        ndarray of complex, shape (n_omega, n_outputs)

        Raises
        ------
        ValueError
            If a name is unknown.
        """
        amplitudes = np.atleast_2d(np.asarray(weights))[:, :, None]
        response: ComplexArray = self.to(list(inputs), amplitudes)[:, :, 0]
        return response

    def rows(self, outputs: Iterable[str]) -> list[int]:
        """Positions of outputs; ValueError if a name is unknown."""
        return [_position(self.name, "output", output, self.outputs) for output in outputs]

    def columns(self, inputs: Iterable[str]) -> list[int]:
        """Positions of inputs; ValueError if a name is unknown."""
        return [_position(self.name, "input", input_, self.inputs) for input_ in inputs]


@dataclass(frozen=True, kw_only=True)
class FrequencyResponse(Response):
    """Responses of a component to unit amplitudes, as numbers; the rest as in `Response`.

    Attributes
    ----------
    values : ndarray of complex, shape (n_omega, n_outputs, n_inputs)
        In units of the output per unit of the input; a receptance where that is m/N.
    """

    values: ComplexArray

    def __post_init__(self) -> None:
        expected = (len(self.omega), len(self.outputs), len(self.inputs))
        if self.values.shape != expected:
            raise ValueError(f"{self.name}: values are {self.values.shape}, the names {expected}")

    def to(self, inputs: Sequence[str], loads: ArrayLike) -> ComplexArray:
        """Responses to loads; see `Response.to`."""
        response: ComplexArray = self.values[:, :, self.columns(inputs)] @ np.asarray(loads)
        return response


def frequency_response(model: LinearForm, omega: ArrayLike) -> FrequencyResponse:
    """Frequency response of a linear model, with its names.

    Parameters
    ----------
    model : LinearForm
        From `linear_model` or `linearise`.
    omega : array_like, shape (n_omega,)
        Angular frequencies, rad/s; positive if the model has a rigid-body motion.

    Returns
    -------
    FrequencyResponse
    """
    return FrequencyResponse(
        name=model.name,
        omega=np.asarray(omega, dtype=float),
        outputs=tuple(output.name for output in model.outputs),
        inputs=tuple(input_.name for input_ in model.inputs),
        values=model.frequency_response(omega),
    )


def lag(omega: ArrayLike, delays: ArrayLike) -> ComplexArray:
    """Weights of inputs that repeat one another later: exp(-i omega delay).

    Parameters
    ----------
    omega : array_like, shape (n_omega,)
        Angular frequencies, rad/s.
    delays : array_like, shape (n_inputs,)
        In s; for a wheel its distance behind the first one over the speed.

    Returns
    -------
    ndarray of complex, shape (n_omega, n_inputs)
    """
    weights: ComplexArray = np.exp(-1j * np.multiply.outer(np.asarray(omega), np.asarray(delays)))
    return weights


def _position(owner: str, kind: str, name: str, names: Sequence[str]) -> int:
    if name not in names:
        raise ValueError(f"{owner} has no {kind} {name}{suggest(name, names)}")
    return names.index(name)
