"""A linear model of a component seen as a black box, from its response to pulses."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from railcosim.master.component import Component, ComponentError, FloatArray, Hold, Variable
from railcosim.master.realisation import NEGLIGIBLE, Realisation, identify
from railcosim.master.suggest import suggest

CHECK_STEPS = 400
"""Length of the check: some 10 ms, enough for everything that a wrong step would spoil."""
CHECK_STEP = 0.6
"""Step of the check over that of the identification: no ratio at which aliases coincide early."""
CHECK_PULSE = -0.5
"""Pulse of the check over that of the identification: shows even and odd nonlinearity."""


@dataclass(frozen=True, kw_only=True)
class LinearModel:
    """Small motion about an operating point.

    Attributes
    ----------
    name : str
        The component.
    inputs : tuple of Variable, length n_inputs
        The inputs that were excited.
    outputs : tuple of Variable, length n_outputs
        The outputs that were observed.
    realisations : tuple of Realisation, length n_runs
        What each pulse does to all outputs, as a sum over poles.
    remainder : ndarray, shape (n_steps + 1, n_outputs, n_runs)
        What the poles leave of the response to a pulse of 1 over the first step. Zero where they
        suffice; a track has thousands of them, of which a record shows hundreds.
    mixing : ndarray, shape (n_runs, n_inputs)
        How the responses to the pulses add up to the response to each input.
    step : float
        Step of the identification, s; nothing is known above ``0.5 / step`` Hz.
    error_estimate : ndarray, shape (n_outputs, n_inputs)
        Error relative to the highest peak among the responses of the same unit, the largest of:
        what the poles leave at the end of the record; their error for a pulse of another height
        and length, if it is more than they leave; a thirtieth of what they leave, for its
        Fourier sum.
    steps : int
        Number of steps the component made for it.
    advice : tuple of str
        What is wrong and what to do about it, a sentence an input; empty if all is well.
    """

    name: str
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    realisations: tuple[Realisation, ...]
    remainder: FloatArray
    mixing: FloatArray
    step: float
    error_estimate: FloatArray
    steps: int
    advice: tuple[str, ...]


def linearise(
    component: Component,
    *,
    at: ArrayLike,
    amplitude: ArrayLike,
    step: float,
    steps: int = 13_000,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    directions: ArrayLike | None = None,
    time: float = 0.0,
    tolerance: float = 1e-4,
    progress: Callable[[int, int], None] | None = None,
) -> LinearModel:
    """Linear model of a component from the response to one pulse an input.

    Parameters
    ----------
    component : Component
        Standing at its operating point; it is left there.
    at : array_like, shape (component's number of inputs,)
        All its inputs at the operating point.
    amplitude : array_like, scalar or shape (n_inputs,)
        Height of the pulse on each input of `inputs`, in the input's unit. Large against the
        component's rounding or solver errors, small against its nonlinearity.
    step : float
        Step, s. ``0.5 / step`` must be above the highest frequency (Hz) the component can move at,
        not only above the highest of interest.
    steps : int, optional
        Number of steps an input. Together they should last a third of the longest period of
        interest, and until of many modes only a few are left (a slab track takes 1 s).
    inputs, outputs : sequence of str, optional
        What to excite and to observe; all by default. Outputs that respond directly to an input
        and outputs that do not can be mixed, as can units.
    directions : array_like, shape (n_inputs, n_inputs), optional
        Inputs that are excited together, one row a pulse, if not each by itself. On a symmetric
        component a symmetric and an antisymmetric pulse show half of its modes each, so each is
        identified better.
    time : float, optional
        The component's time at the operating point, s.
    tolerance : float, optional
        An error estimate above it gives a warning.
    progress : callable, optional
        Called with the steps done and their total, every few hundred steps.

    Returns
    -------
    LinearModel

    Raises
    ------
    ValueError
        If a name is unknown, or sizes, `step` or `steps` make no sense.
    ComponentError
        If the component cannot return to a saved state, refuses a step or gives no number.

    Warns
    -----
    RuntimeWarning
        With each sentence of `advice`.

    Notes
    -----
    A held input is the only one whose effect over a step is known exactly without looking inside.
    A run without a pulse is subtracted, so the operating point may drift. Outputs of the same unit
    are weighted alike; what is a thousandth of its like is known a thousand times worse. Between
    distant points observe the acceleration, too: its response falls least steeply with frequency,
    and -1/omega^2 of it is the receptance, to more digits than the displacement gives above 1 kHz.
    """
    u = np.array(at, dtype=float)
    columns = _select(component.inputs, inputs, component.name)
    rows = _select(component.outputs, outputs, component.name)
    height = np.broadcast_to(np.asarray(amplitude, dtype=float), (len(columns),))
    together = np.eye(len(columns)) if directions is None else np.asarray(directions, dtype=float)
    _require(together.shape == 2 * (len(columns),), "directions must be a row and column an input")
    _require(np.linalg.matrix_rank(together) == len(columns), "directions are not independent")
    _require(u.shape == (len(component.inputs),), f"`at` must hold {len(component.inputs)} inputs")
    _require(bool(np.all(height != 0.0)), "an amplitude is zero: nothing would be excited")
    _require(step > 0.0, f"step is {step} s; it must be positive")
    _require(steps >= 100, f"steps is {steps}; a hundred is the least to identify anything")
    if not component.can_rollback:
        raise ComponentError(f"{component.name} cannot save its state, where each pulse starts")

    component.set_hold(Hold.CONSTANT)
    component.set_inputs(u)
    total = (steps + CHECK_STEPS) * (len(columns) + 1)
    bench = _Bench(component, u, rows, time, component.save_state(), total, progress)
    observed = tuple(component.outputs[row] for row in rows)
    pulses = np.zeros((len(columns), u.size))
    pulses[:, columns] = together * height
    found = _excite(bench, pulses, step, steps, observed)
    bench.rewind()
    errors, advice = [], []
    for pulse, one in zip(pulses, found, strict=True):
        excited = [v.name for v, p in zip(component.inputs, pulse, strict=True) if p]
        error, sentences = _assess(" with ".join(excited), one, tolerance)
        errors.append(error)
        advice += sentences
    for sentence in advice:
        warnings.warn(f"{component.name}: {sentence}", RuntimeWarning, stacklevel=2)
    # Responses to the pulses are H @ (together * height).T; what is wanted is H.
    mixing = np.linalg.inv((together * height).T)
    return LinearModel(
        name=component.name,
        inputs=tuple(component.inputs[column] for column in columns),
        outputs=observed,
        realisations=tuple(one.model for one in found),
        remainder=np.stack([_kept(one) for one in found], axis=2),
        mixing=mixing,
        step=step,
        error_estimate=np.stack(errors, axis=1) @ (np.abs(mixing) > 0),
        steps=total,
        advice=tuple(advice),
    )


@dataclass(frozen=True)
class _Identified:
    """What was found from one pulse."""

    model: Realisation
    left: FloatArray
    """What its poles leave of the response, shape (n_steps + 1, n_outputs)."""
    missed: FloatArray
    """Their error for a pulse of another height and length, shape (CHECK_STEPS + 1, n_outputs)."""
    scale: FloatArray
    """Magnitude of the outputs, shape (n_outputs,)."""


def _excite(
    bench: _Bench, pulses: FloatArray, step: float, steps: int, observed: Sequence[Variable]
) -> list[_Identified]:
    """Run the pulses (n_runs, component's inputs) and identify each response."""
    nothing = np.zeros(pulses.shape[1])
    rest = bench.run(step, steps, nothing), bench.run(CHECK_STEP * step, CHECK_STEPS, nothing)
    # One response is identified (by LAPACK, beside the interpreter) while the next one is recorded.
    with ThreadPoolExecutor(max_workers=1) as background:
        records = []
        for pulse in pulses:
            record = bench.run(step, steps, pulse) - rest[0]
            check = bench.run(CHECK_STEP * step, CHECK_STEPS, CHECK_PULSE * pulse) - rest[1]
            scale = _scale(record, observed)
            records.append((record, check, scale, background.submit(identify, record, step, scale)))
    return [
        _Identified(
            model=(model := identified.result()),
            left=(record - model.pulse_response(step, steps)) * (scale > 0.0),
            missed=check / CHECK_PULSE - model.pulse_response(CHECK_STEP * step, CHECK_STEPS),
            scale=scale,
        )
        for record, check, scale, identified in records
    ]


@dataclass
class _Bench:
    """Runs a component from one state again and again."""

    component: Component
    u: FloatArray
    rows: list[int]
    time: float
    state: Any
    total: int
    progress: Callable[[int, int], None] | None
    done: int = 0

    def rewind(self) -> None:
        """Go back to the operating point."""
        self.component.restore_state(self.state)
        self.component.set_inputs(self.u)

    def run(self, step: float, steps: int, pulse: FloatArray) -> FloatArray:
        """Record the outputs at the beginning and after each step, with a pulse over the first."""
        self.rewind()
        self.component.set_inputs(self.u + pulse)
        record = np.empty((steps + 1, len(self.rows)))
        record[0] = self.component.get_outputs()[self.rows]
        for k in range(steps):
            self.component.do_step(self.time + k * step, step)
            if k == 0:  # before the outputs are read: they may depend on the input at once
                self.component.set_inputs(self.u)
            record[k + 1] = self.component.get_outputs()[self.rows]
            self.done += 1
            if self.progress is not None and (self.done % 250 == 0 or self.done == self.total):
                self.progress(self.done, self.total)
        if not np.isfinite(record).all():
            raise ComponentError(
                f"{self.component.name} gave outputs that are not finite, at a step of {step} s "
                f"and a pulse of {np.abs(pulse).max()}; try a smaller pulse or a smaller step"
            )
        return record


def _scale(record: FloatArray, outputs: Sequence[Variable]) -> FloatArray:
    """Largest response among the outputs of the same unit; 0 where all of them are rounding.

    Each output by its own size would turn one that only answers by rounding (the pitch of a bogie
    loaded at its centre) into noise as large as a signal, and hundreds of states to explain it.
    """
    peak = np.abs(record[1:]).max(axis=0)  # without the feedthrough, which is known exactly
    # Outputs without a unit have no like.
    kinds = np.array([output.unit or output.name for output in outputs])
    scale = np.array([peak[kinds == kind].max() for kind in kinds])
    relative = scale / [output.nominal for output in outputs]
    scale[relative <= 1e-13 * relative.max()] = 0.0
    return scale


def _relative(error: FloatArray, scale: FloatArray) -> FloatArray:
    """Largest error of each output over a record, relative to its scale."""
    largest = np.abs(error).max(axis=0)
    relative: FloatArray = np.zeros_like(largest)
    np.divide(largest, scale, out=relative, where=scale > 0.0)
    return relative


def _kept(found: _Identified) -> FloatArray:
    """What the poles leave, or zeros if that is negligible."""
    kept: FloatArray = found.left * np.any(np.abs(found.left) > NEGLIGIBLE * found.scale)
    return kept


def _assess(name: str, found: _Identified, tolerance: float) -> tuple[FloatArray, list[str]]:
    """Error estimate of each output, and a sentence if it is poor."""
    left, missed = _relative(found.left, found.scale), _relative(found.missed, found.scale)
    at_end = _relative(found.left[-len(found.left) // 10 :], found.scale)
    # The check cannot foresee what the poles leave: only an error beyond that is news.
    surprise = np.where(missed <= 3.0 * left, 0.0, missed)
    error = np.maximum(np.maximum(at_end, left / 30.0), surprise)
    if surprise.max() > tolerance:
        return error, [
            f"the model of {name} does not foresee a pulse of another height and length (error "
            f"{surprise.max():.0e} of the peak): there is motion too fast for the step, or it is "
            "not linear; try half the step, then a tenth of the amplitude"
        ]
    if error.max() > tolerance:
        return error, [
            f"the poles found leave {left.max():.0e} of the response to {name}, {at_end.max():.0e} "
            "at the end of the record: too many modes have not died down, or the outputs are "
            "noisy; try more steps, then a larger amplitude and tighter solver tolerances"
        ]
    return error, []


def _select(variables: Sequence[Variable], names: Sequence[str] | None, owner: str) -> list[int]:
    """Positions of the variables called `names`, or of all."""
    known = [variable.name for variable in variables]
    wanted = known if names is None else list(names)
    _require(len(wanted) > 0, f"{owner}: no variable is asked for")
    for name in wanted:
        _require(name in known, f"{owner} has no variable {name}{suggest(name, known)}")
    return [known.index(name) for name in wanted]


def _require(condition: bool, sentence: str) -> None:
    if not condition:
        raise ValueError(sentence)
