"""A linear model of a component seen as a black box, from its response to pulses."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from railcosim.master.component import Component, ComponentError, FloatArray, Hold, Variable
from railcosim.master.fmi.flaws import FlawWarning
from railcosim.master.linear.doubts import Doubts
from railcosim.master.linear.linear_form import alike, relative_difference
from railcosim.master.linear.pulse_response import PulseResponse, analyse
from railcosim.master.linear.pulses import (
    CHECK_STEP,
    CHECK_STEPS,
    FINER,
    Bench,
    Records,
    record,
    scale_of,
)
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.undeclared import told
from railcosim.master.suggest import suggest

SHORTER = 0.9
"""Part of the record that the rougher model is made of."""
REFUSED = 0.1
"""Difference of what should add up, relative, above which it is no estimate of an error any more.
Of a smooth law the error falls with the pulses' height as it does, and is then no more than it."""


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
    responses : tuple of PulseResponse, length n_runs
        What each pulse does to all outputs.
    mixing : ndarray, shape (n_runs, n_inputs)
        How the responses to the pulses add up to the response to each input.
    rougher : LinearModel or None
        The same from less: nine tenths of the record, and its beginning in steps twice as long.
    error_floor : ndarray, shape (n_outputs, n_inputs)
        What the checks say, whatever the frequency, over the largest peak of the same unit: the
        largest difference between the records of two pulses of other height in steps of other
        length; the error in foreseeing the response to a third, short pulse; and the difference
        between that response at the beginning and at the end of the record.
    error_estimate : ndarray, shape (n_outputs, n_inputs)
        The difference to the rougher model over the largest response of the same unit at the same
        frequency, the worst from one over the length of the record to a fifth of one over the
        step; or `error_floor` if that is more. See `linear_form.error_estimate` for others.
    steps : int
        Number of steps the component made for it.
    advice : tuple of str
        What is wrong and what to do about it; empty if all is well.
    standing : mapping of str to float
        Values of all outputs at the operating point, if they are known.
    """

    name: str
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    responses: tuple[PulseResponse, ...]
    mixing: FloatArray
    rougher: LinearModel | None
    error_floor: FloatArray
    error_estimate: FloatArray
    steps: int
    advice: tuple[str, ...]
    standing: Mapping[str, float] = field(default_factory=dict)

    def frequency_response(self, omega: ArrayLike) -> ComplexArray:
        """Response to harmonic inputs of unit amplitude.

        Parameters
        ----------
        omega : array_like, shape (n_omega,)
            Angular frequencies, rad/s, positive. Their sum with the highest one the component can
            move at must be below ``2 pi / step``.

        Returns
        -------
        ndarray of complex, shape (n_omega, n_outputs, n_inputs)
            A receptance (m/N) for displacements and forces, a mobility for velocities.
        """
        frequencies = np.asarray(omega, dtype=float)
        runs = np.stack([r.frequency_response(frequencies) for r in self.responses], axis=2)
        flat: ComplexArray = runs.reshape(-1, len(self.mixing)) @ self.mixing  # one BLAS call
        return flat.reshape(len(frequencies), len(self.outputs), len(self.inputs))


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
    """Linear model of a component from the response to three pulses an input.

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
        Step, s. One over it must be above the sum of the highest frequency (Hz) the component can
        move at and the highest of interest; twice the former for motion that does not die down.
    steps : int, optional
        Number of steps an input. Together they should last a third of the longest period of
        interest, and until of many modes only a few are left (a slab track takes 1.3 s).
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
        If the component cannot return to a saved state, refuses a step, gives no number, or is
        not linear within the pulses.

    Warns
    -----
    RuntimeWarning
        With each sentence of `advice`.

    Notes
    -----
    A held input is the only one whose effect over a step is known exactly without looking inside.
    A run without a pulse is subtracted, so the operating point may drift. A second record of a
    pulse of another height, in finer steps, shows what happens between the first samples, and
    whether the component is linear; one of minus half of all pulses at once, as long as the first,
    whether they add up; a third, of a shorter pulse, whether that was all, and whether
    the component answers later as it did before. Outputs of the same unit are weighted alike; what
    is a thousandth of its like is known a thousand times worse. Between distant points observe the
    acceleration, too: its response falls least steeply with frequency, and -1/omega^2 of it is the
    receptance, to more digits than the displacement gives above 1 kHz.
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
    _require(steps >= 500, f"steps is {steps}; five hundred is the least to identify anything")
    if not component.can_rollback:
        raise ComponentError(f"{component.name} cannot save its state, where each pulse starts")

    component.set_hold(Hold.CONSTANT)
    component.set_inputs(u)
    standing = values_of(component)
    component.keep_past()
    state = component.save_state()
    bench = Bench(component, u, rows, time, state, step, steps, len(columns), progress)
    pulses = np.zeros((len(columns), u.size))
    pulses[:, columns] = together * height
    observed = tuple(component.outputs[row] for row in rows)
    # One response is identified (by LAPACK, beside the interpreter) while the next is recorded.
    with ThreadPoolExecutor(max_workers=1) as background:
        work = [background.submit(_identify, one, step) for one in record(bench, pulses, observed)]
        found = [identified.result() for identified in work]
    superposed = _superposed(bench, pulses, observed)
    bench.rewind()
    bench.finished()
    if superposed.max(initial=0.0) > REFUSED:
        raise ComponentError(
            f"{component.name}: minus half of all pulses at once gives a response that is wrong by "
            f"{superposed.max():.1e} of what the pulses add up to: it is not linear within them; "
            "try a tenth of the amplitude, or an operating point at which it is"
        )
    _tell_undeclared(component, rows, columns, together, found)
    # Responses to the pulses are H @ (together * height).T; what is wanted is H.
    mixing = np.linalg.inv((together * height).T)
    best = _model(component, columns, observed, found, superposed, mixing, bench, tolerance)
    return replace(best, standing=standing)


def values_of(component: Component) -> dict[str, float]:
    """Outputs of a component as they are, by name."""
    names = [variable.name for variable in component.outputs]
    return dict(zip(names, component.get_outputs().tolist(), strict=True))


@dataclass(frozen=True)
class _Identified:
    """What was found from one pulse."""

    response: PulseResponse
    rougher: PulseResponse
    disagreement: FloatArray
    """Of the records of both pulses, relative, shape (n_outputs,)."""
    unforeseen: FloatArray
    """Error of the response that is foreseen to a third, short pulse, relative, (n_outputs,)."""
    changed: FloatArray
    """Difference of the response to that pulse at the end of the record, relative, (n_outputs,)."""
    at_end: FloatArray
    """What is left of the record at its end beside the lasting poles, relative, (n_outputs,)."""


def _identify(records: Records, step: float) -> _Identified:
    """Identify one response, twice."""
    whole, scale = records.whole, records.scale
    shorter = whole[: round(SHORTER * len(whole))]
    beginning = records.finer[FINER:]
    common = beginning[::FINER]
    response = analyse(whole, beginning, FINER, step, scale)
    short = CHECK_STEP * step / FINER
    foreseen = response.soon_after_pulse(short, short, CHECK_STEPS + 1)
    return _Identified(
        response=response,
        rougher=analyse(shorter, beginning[::2], FINER // 2, step, scale),
        disagreement=_relative(common - whole[1 : len(common) + 1], scale),
        # A shorter pulse has less of a response.
        unforeseen=_relative(records.check[1:] - foreseen, scale * short / step),
        changed=_relative(records.later - records.check, scale * short / step),
        at_end=_relative(response.rest[-len(response.rest) // 10 :], scale),
    )


def _model(
    component: Component,
    columns: Sequence[int],
    observed: tuple[Variable, ...],
    found: Sequence[_Identified],
    superposed: FloatArray,
    mixing: FloatArray,
    bench: Bench,
    tolerance: float,
) -> LinearModel:
    """Put the responses together, compare, and warn."""
    rougher = LinearModel(
        name=component.name,
        inputs=tuple(component.inputs[column] for column in columns),
        outputs=observed,
        responses=tuple(one.rougher for one in found),
        mixing=mixing,
        rougher=None,
        error_floor=np.zeros((len(observed), len(columns))),
        error_estimate=np.zeros((len(observed), len(columns))),
        steps=bench.done,
        advice=(),
    )
    best = replace(rougher, responses=tuple(one.response for one in found), rougher=rougher)

    def by_input(by_run: list[FloatArray]) -> FloatArray:
        runs = np.stack(by_run, axis=1)
        parts = (np.abs(mixing) > 0.0).T
        inputs: FloatArray = np.stack([runs[:, part].max(axis=1) for part in parts], axis=1)
        return inputs

    doubts = Doubts(
        disagreement=by_input([np.maximum(one.disagreement, superposed) for one in found]),
        difference=relative_difference(best, rougher, _looked_at(bench)),
        unforeseen=by_input([one.unforeseen for one in found]),
        changed=by_input([one.changed for one in found]),
        at_end=by_input([one.at_end for one in found]),
    )
    advice = doubts.advice(best.inputs, tolerance)
    for sentence in advice:
        warnings.warn(f"{component.name}: {sentence}", RuntimeWarning, stacklevel=3)
    return replace(best, error_floor=doubts.floor, error_estimate=doubts.error, advice=advice)


def _superposed(
    bench: Bench,
    pulses: FloatArray,
    observed: Sequence[Variable],
) -> FloatArray:
    """Error of the responses' sum as the response to all pulses at once, of minus their half.

    Relative, shape (n_outputs,): in time, and at frequencies, as a resonance adds up what a sample
    hardly has.
    """
    assert bench.sums is not None
    whole, finer = bench.sums
    scale, other = scale_of(whole, observed), bench.superposed(pulses)
    other[:, scale == 0.0] = 0.0
    response = analyse(other, finer[FINER:], FINER, bench.step, scale)
    omega = _looked_at(bench)
    # Analysed alike: what a record of this length cannot tell is no lack of linearity.
    added = analyse(whole, finer[FINER:], FINER, bench.step, scale)
    together = added.frequency_response(omega)
    size, off = np.abs(together), np.abs(response.frequency_response(omega) - together)
    for like in alike(observed):
        size[:, like] = size[:, like].max(axis=1, keepdims=True)
    by_frequency = np.zeros_like(off)
    np.divide(off, size, out=by_frequency, where=(size > 0.0) & (scale > 0.0))
    found_error: FloatArray = np.maximum(_relative(other - whole, scale), by_frequency.max(axis=0))
    return found_error


def _looked_at(bench: Bench) -> FloatArray:
    """Frequencies at which models are compared, rad/s."""
    grid: FloatArray = np.geomspace(1.0 / (bench.steps * bench.step), 0.2 / bench.step, 100)
    return 2.0 * np.pi * grid


def _tell_undeclared(
    component: Component,
    rows: Sequence[int],
    columns: Sequence[int],
    together: FloatArray,
    found: Sequence[_Identified],
) -> None:
    """Warn of outputs that answer at once to an input on which they are not declared to depend."""
    declared = component.feedthrough[np.ix_(rows, columns)]
    for one, excited in zip(found, together != 0.0, strict=True):
        silent = ~declared[:, excited].any(axis=1)
        at_once = np.flatnonzero(silent & (one.response.lasting.direct != 0.0)).tolist()
        if at_once:
            inputs = [component.inputs[columns[k]].name for k in np.flatnonzero(excited).tolist()]
            pairs = [(component.outputs[rows[i]].name, " or ".join(inputs)) for i in at_once]
            warnings.warn(told(component.name, pairs), FlawWarning, stacklevel=3)
            return


def _relative(error: FloatArray, scale: FloatArray) -> FloatArray:
    """Largest error of each output over a record, relative to its scale."""
    largest = np.abs(error).max(axis=0, initial=0.0)
    relative: FloatArray = np.zeros_like(largest)
    np.divide(largest, scale, out=relative, where=scale > 0.0)
    return relative


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
