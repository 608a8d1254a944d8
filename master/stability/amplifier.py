"""From a scheme and a system to what a step of any length does.

The scheme is observed with its components open: what it asks of them is given, what it feeds them
taken note of. Where all that moves is open, that does not depend on the length of the step but for
the unit of time; so a scheme is observed once, and the components' own answers are put in for
every length. Where a law asks for rates, a scheme may make them of displacements over the length of
the step; so it is observed at two lengths, between which all is a line over the inverse of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.law import Law
from railcosim.master.linear.modal import Modal
from railcosim.master.linear.state_space import IndexArray
from railcosim.master.linear_component import LinearComponent
from railcosim.master.schemes import Scheme
from railcosim.master.schemes.iteration import Iterated
from railcosim.master.stability.amplification import Amplification, merged
from railcosim.master.stability.observed_step import Column, ObservedStep
from railcosim.master.stability.open_component import Open
from railcosim.master.stability.sampled import Asked, Fed, sampled
from railcosim.master.system import System

MAPS = ("N", "R", "Q", "P", "W", "V")
_UNIT = 1e-3
"""Step at which a scheme is observed, s, if one is enough."""


class Amplifier:
    """Finds what a step does; made once for a scheme and a system, asked for many steps.

    Parameters
    ----------
    system : System
        Of linear components at rest: `LinearComponent`, `Law` of a linear law, `Open`.
    scheme : Scheme
        Which to observe.

    Attributes
    ----------
    system
        As given.
    evaluations : int
        How often each component was stepped in a step, at the most, so far.
    """

    def __init__(self, system: System, scheme: Scheme) -> None:
        self.system = system
        self.evaluations = 0
        self._scheme = scheme
        self._rest = system.save_state()
        self._same = not any(isinstance(c, LinearComponent) for c in system.components)
        self._observed: _Observed | None = None

    def at(self, h: float | FloatArray) -> Amplification:
        """Find what a step of length `h` (s) does; of several at once if all that moves is open.

        Raises
        ------
        NotLinear
            If the scheme's memory changes its form.
        Exception
            Whatever the scheme raises if it cannot make the step.
        """
        if self._observed is None or not self._same:
            step = self._step(_UNIT if self._same else float(h))
            self.evaluations = max(self.evaluations, step.evaluations)
            laws = [c for c in self.system.components if isinstance(c, Law)]
            if self._same and any(law.rates.size for law in laws):
                self._observed = _observe(step, lambda: self._step(2.0 * _UNIT))
            else:
                self._observed = _observe(step)
            if isinstance(self._scheme, Iterated):
                until = replace(self._scheme.until, max_evaluations=1, accept=True)
                self.system.restore_state(self._rest)
                once = ObservedStep(self.system, replace(self._scheme, until=until), step.h)
                moving = [c for c in once.opened if c.model is not None]
                _, P = _stacked([column for c in moving for column in once.by_motion(c)], once)
                self._observed = replace(self._observed, at_once=P)
        return self._observed.at(h)

    def _step(self, h: float) -> ObservedStep:
        self.system.restore_state(self._rest)
        return ObservedStep(self.system, self._scheme, h)


@dataclass(frozen=True, kw_only=True)
class _Observed:
    """A step as a map of the scheme's memory m, all motions f that it asks for, and what it feeds.

    m' = N m + R f + W g, w = Q m + P f + V g.
    """

    h: float
    N: FloatArray
    R: FloatArray
    Q: FloatArray
    P: FloatArray
    W: FloatArray
    V: FloatArray
    outputs: IndexArray
    moving: list[Open]
    asked: list[list[Asked]]
    fed: list[list[Fed]]
    signals: FloatArray
    at_once: FloatArray | None = None  # of P, what no guess of a scheme that iterates comes between
    inverse: Mapping[str, FloatArray] = field(default_factory=dict)
    """Parts of the maps, in the units of `h`, that go with the inverse of the step's length."""

    def at(self, h: float | FloatArray) -> Amplification:
        """With the components' answers within a step of `h` (s), and states that are no modes."""
        one = self.in_units_of(np.asarray(h) / self.h)
        parts = [
            sampled(c.model, h, asked, fed)
            for c, asked, fed in zip(self.moving, self.asked, self.fed, strict=True)
            if c.model is not None
        ]
        is_modal = [isinstance(c.model, Modal) for c in self.moving]
        D = _blocks(part.D for part in parts)
        modes = [part for part, modal in zip(parts, is_modal, strict=True) if modal]
        states = [part for part, modal in zip(parts, is_modal, strict=True) if not modal]
        seen = np.repeat(is_modal, [part.C.shape[-2] for part in parts]).astype(bool)
        heard = np.repeat(is_modal, [part.S.shape[1] for part in parts]).astype(bool)
        S = _blocks(part.S for part in modes)
        A, B, C = (_blocks(getattr(part, name) for part in states) for name in ("E", "G", "C"))
        # w = P (D w + what states and modes bring) + ...: they agree within the step.
        lead = np.shape(h)
        n, x, f = len(self.N), A.shape[-1], D.shape[-2]
        bring = np.zeros((*lead, f, n + x))
        bring[..., ~seen, n:] = C
        from_modes = np.broadcast_to(np.eye(f)[:, seen], (*lead, f, seen.sum()))
        within = one.P @ D
        agreed = np.linalg.inv(np.eye(len(self.P)) - within)
        left = within
        if one.at_once is not None:
            fresh = one.at_once @ D
            left = np.linalg.solve(np.eye(len(self.P)) - fresh, within - fresh)
        w_state = one.P @ bring
        w_state[..., :n] += one.Q
        w_state = agreed @ w_state
        w_modes = agreed @ (one.P @ from_modes)
        w_signal = agreed @ one.V

        def after(w: FloatArray, f: FloatArray, own: FloatArray) -> FloatArray:
            return np.concatenate(
                [own[..., :n, :] + one.R @ (D @ w + f), own[..., n:, :] + B @ w[..., ~heard, :]],
                axis=-2,
            )

        own = _blocks([one.N, A])
        signals = w_signal.shape[-1]
        nothing = np.zeros((*lead, n + x, w_modes.shape[-1]))
        driven = np.zeros((*lead, n + x, signals))
        driven[..., :n, :] = one.W
        Q, P, V = (S @ w[..., heard, :] for w in (w_state, w_modes, w_signal))
        together = np.concatenate([Q, P, V], axis=-1).any(axis=-1)
        kept = np.logical_or.reduce(together, axis=tuple(range(len(lead))))
        return Amplification(
            h=h,
            N=after(w_state, bring, own),
            R=after(w_modes, from_modes, nothing),
            W=after(w_signal, np.zeros((*lead, f, signals)), driven),
            Q=Q[..., kept, :], P=P[..., kept, :], V=V[..., kept, :],
            E=np.concatenate([np.zeros((*lead, 0), complex), *(p.E for p in modes)], axis=-1),
            G=_blocks(part.G for part in modes)[..., kept].astype(complex, copy=False),
            C=_blocks(part.C for part in modes).astype(complex, copy=False),
            signals=np.multiply.outer(h, self.signals),
            outputs=self.outputs,
            within=left,
        )  # fmt: skip

    def in_units_of(self, ratio: FloatArray) -> _Observed:
        """The same, with time counted in seconds for another step: rates and derivatives change."""
        rate = [
            np.repeat([float(a.is_rate) for a in asked], len(c.outputs))
            for c, asked in zip(self.moving, self.asked, strict=True)
        ]
        derivative = [
            np.tile(np.repeat(-np.arange(3.0), len(c.inputs)), len(fed))
            for c, fed in zip(self.moving, self.fed, strict=True)
        ]
        power = np.concatenate([np.zeros(0), *rate]), np.concatenate([np.zeros(0), *derivative])
        f = (ratio[..., None] ** power[0])[..., None, :]
        w = (ratio[..., None] ** power[1])[..., None]
        at_once = None if self.at_once is None else w * self.at_once * f
        units = {"R": f, "P": w * f, "Q": w, "V": w}
        maps = {name: unit * getattr(self, name) for name, unit in units.items()}
        for name, part in self.inverse.items():
            turned = units.get(name, np.ones(1)) * part * (1.0 / ratio - 1.0)[..., None, None]
            maps[name] = maps.get(name, getattr(self, name)) + turned
        return replace(self, **maps, at_once=at_once, inverse={})


def _blocks(parts: Iterable[Any]) -> Any:
    """Matrices along the diagonal; scipy's function takes ten times as long for two of them."""
    matrices = list(parts)
    if len(matrices) == 1:
        return matrices[0]
    lead = np.broadcast_shapes((), *(m.shape[:-2] for m in matrices))
    shape = sum(m.shape[-2] for m in matrices), sum(m.shape[-1] for m in matrices)
    M = np.zeros((*lead, *shape), dtype=np.result_type(float, *matrices))
    i = j = 0
    for m in matrices:
        M[..., i : i + m.shape[-2], j : j + m.shape[-1]] = m
        i, j = i + m.shape[-2], j + m.shape[-1]
    return M


def _observe(step: ObservedStep, again: Callable[[], ObservedStep] | None = None) -> _Observed:
    """All columns of the map; also of another length, if anything goes with its inverse."""
    places, outputs = step.memory, step.outputs
    found = [_columns(step)]
    if again is not None:
        found.append(_columns(again()))
    # What is never seen in an output is no memory.
    N, Q = (sum(np.abs(getattr(one, name)) for one in found) for name in ("N", "Q"))
    kept = np.union1d(places[_seen(N, Q, places, outputs)], outputs)
    one, *others = (
        replace(
            one,
            N=_spread(one.N, places, kept)[kept], Q=_spread(one.Q, places, kept),
            R=one.R[kept], W=one.W[kept], outputs=np.searchsorted(kept, outputs),
        )
        for one in found
    )  # fmt: skip
    if not others:
        return _without_copies(one)
    ratio = one.h / others[0].h
    other = others[0].in_units_of(np.asarray(ratio))
    inverse = {m: (getattr(one, m) - getattr(other, m)) / (1.0 - ratio) for m in MAPS}
    return replace(one, inverse=inverse)


def _columns(step: ObservedStep) -> _Observed:
    """The map with all that may be memory."""
    N, Q = _stacked([step.by_memory(int(k)) for k in step.memory], step)
    moving = [c for c in step.opened if c.model is not None]
    signals = [c for c in step.opened if c.model is None]
    R, P = _stacked([column for c in moving for column in step.by_motion(c)], step)
    W, V = _stacked([column for c in signals for column in step.by_motion(c)], step)
    return _Observed(
        h=step.h, N=N, R=R, Q=Q, P=P, W=W, V=V, outputs=step.outputs, moving=moving,
        asked=[step.asked[c.name] for c in moving], fed=[step.fed[c.name] for c in moving],
        signals=np.array([a.when for c in signals for a in step.asked[c.name]]),
    )  # fmt: skip


def _without_copies(one: _Observed) -> _Observed:
    """Numbers of the memory that are equal after any step are one."""
    N, RW, Q, place = merged(one.N, np.hstack([one.R, one.W]), one.Q)
    R, W = np.split(RW, [one.R.shape[1]], axis=1)
    return replace(one, N=N, R=R, Q=Q, W=W, outputs=place[one.outputs])


def _stacked(columns: list[Column], step: ObservedStep) -> tuple[FloatArray, FloatArray]:
    """Columns side by side: what they do to the memory, and to what is fed."""
    one, two = np.zeros((step.size, len(columns))), np.zeros((step.n_fed, len(columns)))
    for k, (memory, fed) in enumerate(columns):
        one[:, k], two[:, k] = memory, fed
    return one, two


def _seen(N: FloatArray, Q: FloatArray, places: IndexArray, outputs: IndexArray) -> Any:
    """Which columns, numbers of the memory at `places`, show in outputs or in what is fed, ever."""
    influence = N != 0
    seen = influence[outputs].any(axis=0) | (Q != 0).any(axis=0)
    while True:
        more = seen | influence[places[seen]].any(axis=0)
        if (more == seen).all():
            return seen
        seen = more


def _spread(part: FloatArray, places: IndexArray, kept: IndexArray) -> FloatArray:
    """Columns for `kept`, zero where they are not among `places`."""
    wide = np.zeros((len(part), len(kept)))
    _, here, there = np.intersect1d(kept, places, return_indices=True)
    wide[:, here] = part[:, there]
    return wide
