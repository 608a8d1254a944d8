"""How far a model from pulses can be trusted, and what to do about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from railcosim.master.component import FloatArray, Variable

DEAD = 1e-3
"""What may be left at the end of the record over the tolerance, if that is not the trouble."""


@dataclass(frozen=True, kw_only=True)
class Doubts:
    """What speaks against a model; all of shape (n_outputs, n_inputs) and relative.

    Attributes
    ----------
    disagreement : ndarray
        Difference of the records of two pulses of other height, in steps of other length.
    difference : ndarray
        Difference of the frequency response to a rougher model's.
    unforeseen : ndarray
        Error in foreseeing the response to a third, short pulse in short steps.
    changed : ndarray
        Difference of the response to that pulse at the beginning and the end of the record.
    at_end : ndarray
        What is left of the record at its end beside the lasting poles.
    """

    disagreement: FloatArray
    difference: FloatArray
    unforeseen: FloatArray
    changed: FloatArray
    at_end: FloatArray

    @property
    def floor(self) -> FloatArray:
        """What the checks say, whatever the frequency."""
        largest: FloatArray = np.maximum.reduce([self.disagreement, self.unforeseen, self.changed])
        return largest

    @property
    def error(self) -> FloatArray:
        """Estimate of the error."""
        return np.maximum(self.floor, self.difference)

    def advice(self, inputs: Sequence[Variable], tolerance: float) -> tuple[str, ...]:
        """A sentence for each input whose responses are known less well than `tolerance`."""
        return tuple(
            f"the response to {input_.name} is known to {worst:.0e} only: {self._why(k, tolerance)}"
            for k, input_ in enumerate(inputs)
            if (worst := self.error[:, k].max()) > tolerance
        )

    def _why(self, k: int, tolerance: float) -> str:
        """The likely reason, and what to try."""
        if self.changed[:, k].max() > tolerance:
            return (
                "it does not stand still, and answers differently where it has moved to; start it "
                "where it is at rest"
            )
        if self.disagreement[:, k].max() > tolerance:
            return (
                "pulses of other height and step give other responses, so it is not linear, or its "
                "solver errs as much; try a tenth of the amplitude, then tighter solver "
                "tolerances, then half the step"
            )
        if self.unforeseen[:, k].max() > tolerance:
            return "there is motion too fast for the step; try half the step"
        if self.at_end[:, k].max() > DEAD * tolerance:
            return (
                f"{self.at_end[:, k].max():.0e} of its peak is left at the end of the record, of "
                "motion that has not died down; try more steps"
            )
        return (
            "there is motion too fast for the step, or the outputs are noisy; try half the step, "
            "then a larger amplitude"
        )
