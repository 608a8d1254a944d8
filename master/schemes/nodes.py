"""What a law is asked at the nodes of a step, by what was sampled at its points.

Displacements are interpolated. Rates are those of the same polynomials. So the work of a held force
on a displacement is what the law gives along it: creep takes as much energy from the bodies as its
law says, and never gives any, whatever the step; and a rate that jumps with the force on it, as a
rail's does, is never asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.law import IndexArray, Law
from railcosim.master.schemes.variants import Variant


@dataclass(frozen=True, eq=False)
class Nodes:
    """See the module.

    Attributes
    ----------
    variant : Variant
        Where the nodes are.
    contacts : int
        Of the law.
    motions : int
        Of a contact, m.
    places : array of int, shape (d,)
        Which of a contact's motions are displacements that steps find; what others give is known.
    rates, whose : array of int, shape (r,)
        Which are rates; and of which displacement, as a place among those.
    """

    variant: Variant
    contacts: int
    motions: int
    places: IndexArray
    rates: IndexArray
    whose: IndexArray

    @classmethod
    def of(cls, variant: Variant, law: Law, moving: IndexArray) -> Nodes:
        """Sort the motions of a law, of which those inputs are found by stepping components.

        Raises
        ------
        ValueError
            If a rate is not that of one of its contact's displacements.
        """
        S = law.S.reshape(law.contacts, -1, len(law.inputs))
        is_rate = (S[:, :, law.rates] != 0.0).any(axis=(0, 2))
        kept = np.isin(np.arange(len(law.inputs)), moving)
        is_found = (S[:, :, kept] != 0.0).any(axis=(0, 2))
        places, rates = np.flatnonzero(~is_rate & is_found), np.flatnonzero(is_rate)
        folded = S[:, rates][:, :, law.rates]  # (contacts, r, number of rates)
        as_displacements = np.zeros((law.contacts, len(rates), len(law.inputs)))
        as_displacements[:, :, law.displacements] = folded
        whose = []
        for k in range(len(rates)):
            same = (S[:, places] == as_displacements[:, [k]]) | ~kept
            found = np.flatnonzero(same.all(axis=(0, 2)))
            if not found.size:
                raise ValueError(
                    f"{law.name}: rate {rates[k]} of its contacts is not the rate of one of their "
                    "displacements, so no step of its motion is that of the other"
                )
            whose.append(found[0])
        whose_rate = np.array(whose, dtype=np.intp)
        return cls(variant, law.contacts, S.shape[1], places, rates, whose_rate)

    @property
    def rows(self) -> IndexArray:
        """Which of all motions are displacements."""
        return (np.arange(self.contacts)[:, None] * self.motions + self.places).ravel()

    @cached_property
    def _room(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Displacements at the nodes, and their rates; and one array of both, and 0 behind them."""
        of_all = len(self.variant.nodes), self.contacts * len(self.places)
        all_of = np.zeros(2 * of_all[0] * of_all[1] + 1)
        values, rates = np.split(all_of[:-1], 2)
        return values.reshape(of_all), rates.reshape(of_all), all_of

    @cached_property
    def _arranged(self) -> IndexArray:
        """Where displacements at the nodes, their rates and 0 have each motion of the law."""
        nodes, d = len(self.variant.nodes), len(self.places)
        size, at = nodes * self.contacts * d, np.zeros(self.motions, dtype=np.intp)
        at[self.places] = np.arange(d)
        at[self.rates] = self.whose + size
        first = d * np.arange(nodes * self.contacts).reshape(nodes, self.contacts, 1)
        arranged: IndexArray = first + at
        given = np.setdiff1d(np.arange(self.motions), [*self.places, *self.rates])
        arranged[..., given] = 2 * size  # behind all, where nothing is
        return arranged

    def begin(self, sampled: FloatArray, h: float) -> FloatArray:
        """What the beginning of a step of `h` (s) adds to the motions; see `answer`."""
        return self._along(self.variant.begin, self.variant.begin_slopes, sampled, sampled, h)

    def answer(
        self, sampled: FloatArray, h: float, carried: FloatArray | None = None
    ) -> FloatArray:
        """What the points of a step add to the motions.

        Parameters
        ----------
        sampled : array, shape (n_answers, n_contacts d)
            Displacements, and with `Variant.rates` their rates times the step.
        h : float
            Length of the step, s.
        carried : array, shape (n_points, n_contacts d), optional
            What of the displacements is no motion of the material, whose rates these are.

        Returns
        -------
        array, shape (n_nodes, n_contacts, m)
            Motions.
        """
        of_material = sampled if carried is None else sampled - carried
        return self._along(
            self.variant.answers, self.variant.answer_slopes, sampled, of_material, h
        )

    def gather(self, tangent: FloatArray, h: float) -> FloatArray:
        """Derivatives of the forces held by the answers.

        Parameters
        ----------
        tangent : array, shape (n_nodes, n_contacts, k, m)
            Of the law at the nodes.
        h : float
            Length of the step, s.

        Returns
        -------
        array, shape (degree + 1, n_answers, n_contacts, k, d)
            Of Legendre coefficients.
        """
        variant = self.variant
        by = np.tensordot(_both(variant.project, variant.answers), tangent[..., self.places], 1)
        if self.rates.size:
            slopes = _both(variant.project, variant.answer_slopes / h)
            by_rates = np.tensordot(slopes, tangent[..., self.rates], 1)
            by[..., self.whose] += by_rates
        found: FloatArray = by
        return found

    def _along(
        self,
        weights: FloatArray,
        slopes: FloatArray,
        sampled: FloatArray,
        of_material: FloatArray,
        h: float,
    ) -> FloatArray:
        if len(self.places) == self.motions:
            return (weights @ sampled).reshape(len(weights), self.contacts, -1)
        values, rates, all_of = self._room
        np.dot(weights, sampled, values)
        np.dot(slopes / h, of_material, rates)
        return all_of.take(self._arranged, mode="clip")  # which checks no index again


def _both(project: FloatArray, weights: FloatArray) -> FloatArray:
    """Products over the nodes, shape (degree + 1, n_answers, n_nodes)."""
    products: FloatArray = project[:, None] * weights.T[None]
    return products
