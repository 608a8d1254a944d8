"""A law between motions and forces, in the master: a component without dynamics of its own.

With it nobody who is coupled has to own the spring between them, and a scheme that knows the law
can solve for its forces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from railcosim.master.component import Component, FloatArray, Variable

IndexArray = NDArray[np.intp]


class ForceLaw(Protocol):
    """Forces of each of several like contacts against its own motions.

    What acts in one direction, a spring, has one motion and one force. Others may have more of
    either, and rates among the motions.
    """

    def force(self, motion: FloatArray) -> FloatArray:
        """Forces, shape (..., n_contacts, k), of motions, shape (..., n_contacts, m).

        A spring's motion is its compression, positive.
        """

    def tangent(self, motion: FloatArray) -> FloatArray:
        """Their derivatives, shape (..., n_contacts, k, m)."""


@dataclass(frozen=True, eq=False)
class Tangents:
    """A linear law; a `ForceLaw`.

    Attributes
    ----------
    by : array, shape (n_contacts, k, m)
        Forces of each contact by its own motions.
    """

    by: FloatArray

    def force(self, motion: FloatArray) -> FloatArray:
        """See `ForceLaw`."""
        found: FloatArray = np.einsum("nkm,...nm->...nk", self.by, motion)
        return found

    def tangent(self, motion: FloatArray) -> FloatArray:
        """See `ForceLaw`."""
        return np.broadcast_to(self.by, (*motion.shape[:-1], *self.by.shape[1:]))


class Law(Component):
    """Contacts whose forces follow at once from the motions they are given.

    Parameters
    ----------
    name : str
        Name, unique in a system.
    law : ForceLaw
        Of every contact.
    motions : sequence of Variable
        The inputs: displacements, and rates if the law asks for them.
    forces : sequence of Variable
        The outputs, those of one contact together.
    compression : array_like, shape (n_contacts m, n_motions)
        Which inputs, with what sign, add up to each motion that the law asks for, those of one
        contact together.
    contacts : int, optional
        How many; one a force if not given.
    rate_of : mapping of str to str, optional
        The inputs that are rates, each with the input whose rate it is.

    Attributes
    ----------
    law, contacts
        As given.
    S : array, shape (n_contacts m, n_motions)
        `compression`.
    rates, displacements : array of int
        Inputs that are rates, and whose.

    Raises
    ------
    ValueError
        If sizes or names do not fit.
    """

    can_rollback = True
    max_input_derivative = 2  # nothing happens within a step, so any polynomial will do

    def __init__(
        self,
        name: str,
        law: ForceLaw,
        motions: Sequence[Variable],
        forces: Sequence[Variable],
        compression: ArrayLike,
        *,
        contacts: int | None = None,
        rate_of: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(name, motions, forces)
        self.law = law
        self.contacts = len(self.outputs) if contacts is None else contacts
        self.S: FloatArray = np.array(compression, dtype=np.float64)
        fits = self.S.ndim == 2 and self.S.shape[1] == len(self.inputs)
        if not fits or len(self.S) % self.contacts or len(self.outputs) % self.contacts:
            raise ValueError(
                f"{name}: compression is {self.S.shape}, it must have as many rows for each of "
                f"{self.contacts} contacts (of {len(self.outputs)} forces) and a column for each "
                f"of {len(self.inputs)} motions"
            )
        known = [v.name for v in self.inputs]
        pairs = [(known.index(a), known.index(b)) for a, b in (rate_of or {}).items()]
        self.rates: IndexArray = np.array([a for a, _ in pairs], dtype=np.intp)
        self.displacements: IndexArray = np.array([b for _, b in pairs], dtype=np.intp)
        self._told: tuple[IndexArray, FloatArray] | None = None

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """The forces of a contact depend at once on its own motions."""
        own = (self.S.reshape(self.contacts, -1, len(self.inputs)) != 0.0).any(axis=1)
        depends: NDArray[np.bool_] = np.repeat(own, len(self.outputs) // self.contacts, axis=0)
        return depends

    def tell(self, inputs: IndexArray, values: FloatArray) -> None:
        """Give inputs that somebody knows better than who feeds them, from now on.

        A rate that jumps with a force is not to be had from outside at the time of that force.
        """
        self._told = inputs, values

    def write_inputs(self) -> None:
        """Do nothing: `u` is all there is."""

    def read_outputs(self) -> None:
        """Evaluate the law."""
        u = self.u
        if self._told is not None:
            u = u.copy()
            u[self._told[0]] = self._told[1]
        self.y[:] = self.law.force((self.S @ u).reshape(self.contacts, -1)).ravel()

    def set_input_derivatives(self, derivatives: FloatArray) -> None:
        """Do nothing: only the inputs at the end of a step count."""

    def do_step(self, t: float, h: float) -> None:
        """Do nothing: there are no dynamics."""

    def save_state(self) -> Any:
        """What was told."""
        return self._told

    def restore_state(self, state: Any) -> None:
        """Be told the same again."""
        self._told = state
