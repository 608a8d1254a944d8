"""Records of a component's response to pulses."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from railcosim.master.component import Component, ComponentError, FloatArray, RunEnded, Variable
from railcosim.master.linear.linear_form import alike

FINER = 8
"""Steps of the second record in one step of the first."""
FINER_STEPS = 1200
"""Its length after the pulse: 150 steps of the first, in which a nonlinearity shows."""
SECOND_PULSE = -0.5
"""Its pulse over that of the first: shows even and odd nonlinearity."""
CHECK_STEP, CHECK_STEPS = 0.6, 100
"""Step and pulse of a third, very short record over the step of the second: no ratio at which
motion too fast for the others looks the same. And its number of steps after the pulse."""
STILL = 1e-11
"""Motion without a pulse, over that with one, that is rounding."""


@dataclass
class Bench:
    """Runs a component from one state again and again, with pulses on its inputs."""

    component: Component
    u: FloatArray
    rows: list[int]
    time: float
    state: Any
    step: float
    steps: int
    n_pulses: int
    progress: Callable[[int, int], None] | None
    done: int = 0
    end: Any = None
    """State after the whole record without a pulse, if it is another."""
    sums: tuple[FloatArray, FloatArray] | None = None
    """Of all responses to the pulses, `Records.whole` and `finer`."""
    rest: FloatArray = field(default_factory=lambda: np.zeros(0))
    """Outputs without a pulse."""

    @property
    def total(self) -> int:
        """Steps if the component does not stand still."""
        each = self.steps + FINER + FINER_STEPS + 2 * (1 + CHECK_STEPS)
        return (self.n_pulses + 1) * each + self.steps

    def superposed(self, pulses: FloatArray) -> FloatArray:
        """Response to all pulses at once, of minus their half, scaled to their height.

        As `Records.whole`: over the whole time, in which a nonlinearity shows that the beginning
        does not meet.
        """
        record: FloatArray = self.whole(SECOND_PULSE * (weights(len(pulses)) @ pulses)) - self.rest
        return record / SECOND_PULSE

    def rewind(self) -> None:
        """Go back to the operating point."""
        self.component.restore_state(self.state)
        self.component.set_inputs(self.u)

    def finished(self) -> None:
        """Tell that no more steps will follow: a component at rest takes fewer than `total`."""
        if self.progress is not None:
            self.progress(self.total, self.total)

    def whole(self, pulse: FloatArray) -> FloatArray:
        """Outputs at the beginning and after each step, with a pulse over the first."""
        return self._run(self.step, 1, self.steps, pulse)

    def without_pulse(self) -> FloatArray:
        """The same without a pulse; where that leads is kept."""
        record = self.whole(np.zeros_like(self.u))
        self.end = self.component.save_state()
        return record

    def beginning(self, pulse: FloatArray) -> FloatArray:
        """The same in finer steps, for a short while."""
        return self._run(self.step / FINER, FINER, FINER + FINER_STEPS, SECOND_PULSE * pulse)

    def check(self, pulse: FloatArray) -> FloatArray:
        """The same with a still shorter pulse and step, for a very short while."""
        step = CHECK_STEP * self.step / FINER
        return self._run(step, 1, 1 + CHECK_STEPS, SECOND_PULSE * pulse)

    def later_check(self, pulse: FloatArray) -> FloatArray:
        """The same at the end of the record without a pulse."""
        step = CHECK_STEP * self.step / FINER
        return self._run(step, 1, 1 + CHECK_STEPS, SECOND_PULSE * pulse, later=True)

    def _run(
        self, step: float, held: int, steps: int, pulse: FloatArray, *, later: bool = False
    ) -> FloatArray:
        component = self.component
        self.rewind()
        time = self.time
        if later:
            component.restore_state(self.end)
            time += self.steps * self.step
        component.set_inputs(self.u + pulse)
        record = np.empty((steps + 1, len(self.rows)))
        component.read_outputs()
        record[0] = component.y[self.rows]
        for k in range(steps):
            try:
                component.do_step(time + k * step, step)
            except RunEnded as end:
                raise ComponentError(f"{end} The response to a pulse takes longer") from end
            if k == held - 1:  # before the outputs are read: they may depend on the input at once
                component.set_inputs(self.u)
            component.read_outputs()
            record[k + 1] = component.y[self.rows]
            self.done += 1
            if self.progress is not None and self.done % 250 == 0:
                self.progress(self.done, self.total)
        if not np.isfinite(record).all():
            raise ComponentError(
                f"{component.name} gave outputs that are not finite, at a step of {step} s "
                f"and a pulse of {np.abs(pulse).max()}; try a smaller pulse or a smaller step"
            )
        return record


@dataclass(frozen=True)
class Records:
    """Response to one pulse, without what happens without one.

    Attributes
    ----------
    whole : ndarray, shape (n_steps + 1, n_outputs)
        At the beginning of the pulse and after each step.
    finer : ndarray, shape (FINER + FINER_STEPS + 1, n_outputs)
        The same in steps of 1 / `FINER`, to another pulse, scaled to the height of the first.
    check : ndarray, shape (CHECK_STEPS + 2, n_outputs)
        The same in steps of `CHECK_STEP` / `FINER`, with a pulse of that length.
    later : ndarray, shape (CHECK_STEPS + 2, n_outputs)
        The same at the end of the whole record, if the component moves without a pulse.
    scale : ndarray, shape (n_outputs,)
        Largest response among the outputs of the same unit; 0 where it is rounding alone.
    """

    whole: FloatArray
    finer: FloatArray
    check: FloatArray
    later: FloatArray
    scale: FloatArray


def record(bench: Bench, pulses: FloatArray, observed: Sequence[Variable]) -> Iterator[Records]:
    """Send pulses, shape (n_pulses, component's inputs), one after the other."""
    nothing = np.zeros(pulses.shape[1])
    still, still_check = bench.beginning(nothing), bench.check(nothing)
    rest: FloatArray | None = None
    for k, pulse in enumerate(pulses):
        whole = bench.whole(pulse)
        if rest is None:
            # Whoever has not stirred in 1200 steps is at rest, and will stay there.
            scale = scale_of(whole - still[:1], observed)
            stirs = np.ptp(still, axis=0) > STILL * scale
            rest = bench.without_pulse() if np.any(stirs & (scale > 0.0)) else still[:1]
            still_later = still_check if bench.end is None else bench.later_check(nothing)
        whole = whole - rest
        bench.rest = rest
        finer = (bench.beginning(pulse) - still) / SECOND_PULSE
        check = (bench.check(pulse) - still_check) / SECOND_PULSE
        later = check
        if bench.end is not None:
            later = (bench.later_check(pulse) - still_later) / SECOND_PULSE
        before = bench.sums or (np.zeros_like(whole), np.zeros_like(finer))
        weight = weights(len(pulses))[k]
        bench.sums = before[0] + weight * whole, before[1] + weight * finer
        scale = scale_of(whole, observed)
        for one in (whole[1:], finer, check, later):
            one[:, scale == 0.0] = 0.0
        yield Records(whole, finer, check, later, scale)


def weights(pulses: int) -> FloatArray:
    """Of pulses that come at once, all different: what is symmetric would cancel."""
    found: FloatArray = 1 - 0.5 * np.arange(pulses) / pulses
    return found


def scale_of(record: FloatArray, outputs: Sequence[Variable]) -> FloatArray:
    """Largest response among the outputs of the same unit; 0 where all of them are rounding.

    Each output by its own size would turn one that only answers by rounding (the pitch of a bogie
    loaded at its centre) into noise as large as a signal, and hundreds of states to explain it.
    """
    peak = np.abs(record[1:]).max(axis=0)  # without the feedthrough, which is known exactly
    scale: FloatArray = np.zeros_like(peak)
    for like in alike(outputs):
        scale[like] = peak[like].max()
    relative = scale / [output.nominal for output in outputs]
    scale[relative <= 1e-13 * relative.max()] = 0.0
    return scale
