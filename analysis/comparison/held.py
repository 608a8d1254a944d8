"""What a comparison takes in one dimension: contacts of the monolith, and responses of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from railcosim.analysis.pair.contact import Parameters
from railcosim.analysis.response.models import Models
from railcosim.master.component import FloatArray
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.progress import Progress
from railcosim.reference.agreement import near
from railcosim.reference.contacts import Contacts
from railcosim.reference.monolithic import Monolithic
from railcosim.vehicle.multibody import Dimension

FINE = 6000  # frequencies on which antiresonances are looked for
WEAK = 1e-3  # of the largest displacement (or force) at that frequency
NOTHING = 1e-9  # of it: what mirrors leave of an answer that must be none
# Excitation and output to errors and whether the response is not weak, by frequency.
Errors: TypeAlias = dict[str, dict[str, tuple[FloatArray, NDArray[np.bool_]]]]


class Held(Protocol):
    """Wheels that stand on rails in one dimension.

    Attributes
    ----------
    dimension : Dimension
        Of vehicle and track.
    efforts : tuple of str
        Last parts of names of the contact forces that are compared in time.
    parameters : mapping
        Of the contacts, for the coupled FMUs.
    title : str
        Of the responses that are compared.
    """

    @property
    def dimension(self) -> Dimension:
        """See above."""

    @property
    def efforts(self) -> tuple[str, ...]:
        """See above."""

    @property
    def parameters(self) -> Parameters:
        """See above."""

    @property
    def title(self) -> str:
        """See above."""

    def contacts(self, mono: Monolithic) -> Contacts:
        """Of the monolithic system, in time."""

    def errors(
        self, models: Models, mono: Monolithic, frequency: FloatArray, progress: Progress
    ) -> Errors:
        """Relative errors of the coupled response, Hz."""


def is_force(output: str) -> bool:
    """Whether an output is a contact force."""
    return output.rpartition(".")[2].startswith("force_")


def apart(
    expected: Mapping[str, ComplexArray],
    rows: Sequence[int],
    found: tuple[FloatArray, ComplexArray],
    dense: tuple[FloatArray, ComplexArray],
) -> dict[str, tuple[FloatArray, NDArray[np.bool_]]]:
    """Relative errors of outputs, NaN within 1 % of an antiresonance, and which are not weak.

    Parameters
    ----------
    expected : mapping of str to array of complex, shape (n,)
        Outputs; NaN as well where one is to be nothing.
    rows : sequence of int
        Which of all outputs that were found these are.
    found, dense : tuple of array, shapes (n,) and (n, n_outputs)
        Frequencies, Hz, and all outputs; the second close enough to show every antiresonance.
    """
    (frequency, ours), (fine, curves), errors = found, dense, {}
    for (output, answer), row in zip(expected.items(), rows, strict=True):
        alike = [abs(a) for name, a in expected.items() if is_force(name) == is_force(output)]
        share = np.abs(answer) / np.max(alike, axis=0)
        nothing = share <= NOTHING
        error = np.abs(ours[:, row] - answer) / np.where(nothing, np.nan, np.abs(answer))
        error[near(frequency, fine, curves[:, row])] = np.nan
        errors[output] = (error, share > WEAK)
    return errors
