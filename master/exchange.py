"""The order of the exchange at a communication point, from the direct dependences."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railcosim.master.connections import CouplingError

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class ExchangePlan:
    """What to do at a communication point.

    Attributes
    ----------
    visits : tuple of (int, bool)
        Components to read, in order, and whether their inputs must be set before.
    late : tuple of int
        Components whose inputs are to be set after all reading.
    open_loops : tuple of tuple of int
        Outputs of loops that are none only because it is not stated what some of them depend on.
    """

    visits: tuple[tuple[int, bool], ...]
    late: tuple[int, ...]
    open_loops: tuple[tuple[int, ...], ...] = ()


def exchange_plan(
    ports: Sequence[tuple[slice, NDArray[np.intp], BoolArray, BoolArray]], names: Sequence[str]
) -> ExchangePlan:
    """Find an order in which every output is read after the inputs it depends on were set.

    An output that does not state what it depends on may depend on everything, and is read as if it
    did, as far as an order can be found. Where only this closes a loop, it is read first: a half of
    all FMUs state nothing, and most of them give outputs from their states.

    Parameters
    ----------
    ports : sequence of (slice, array, array, array)
        Of each component: its outputs among all outputs; the source of each input, shape
        (n_inputs,), numbers from ``len(names)`` on meaning that nothing feeds it; its
        feedthrough, shape (n_outputs, n_inputs); whether that is stated, shape (n_outputs,).
    names : sequence of str
        All outputs.

    Returns
    -------
    ExchangePlan
        With as few visits as a greedy search finds: a component is visited twice only if one of
        its outputs is needed to find another.

    Raises
    ------
    CouplingError
        If there is a stated algebraic loop, naming the outputs in it.
    """
    needs, stated = _dependence(ports, len(names)), np.concatenate([port[3] for port in ports])
    open_loops: list[tuple[int, ...]] = []
    known = np.zeros(len(names), dtype=bool)
    visits: list[tuple[int, bool]] = []
    settled: set[int] = set()
    waiting = [k for k, (outputs, *_) in enumerate(ports) if outputs.stop > outputs.start]
    while waiting:
        ready: BoolArray = ~np.any(needs & ~known, axis=1)
        k = _next_visit([ports[i][0] for i in waiting], waiting, ready, known)
        if k is None:
            loop = _loop(needs, known)
            if stated[loop].all():
                raise CouplingError(_loop_message([names[i] for i in loop]))
            open_loops.append(tuple(loop))
            for before, output in itertools.pairwise(loop):
                needs[output, before] &= stated[output]
            continue
        outputs, sources, *_ = ports[k]
        found = ready[outputs] & ~known[outputs]
        visits.append((k, bool(needs[outputs][found].any())))
        if visits[-1][1] and known[sources[sources < len(names)]].all():
            settled.add(k)
        known[outputs] |= ready[outputs]
        waiting = [i for i in waiting if not known[ports[i][0]].all()]
    late = tuple(k for k, port in enumerate(ports) if port[1].size and k not in settled)
    return ExchangePlan(tuple(visits), late, tuple(open_loops))


def _dependence(
    ports: Sequence[tuple[slice, NDArray[np.intp], BoolArray, BoolArray]], n_outputs: int
) -> BoolArray:
    """Which output needs which other one at once, shape (n_outputs, n_outputs)."""
    needs = np.zeros((n_outputs, n_outputs), dtype=bool)
    for outputs, sources, feedthrough, _ in ports:
        for j in np.flatnonzero(sources < n_outputs):
            needs[outputs, sources[j]] |= feedthrough[:, j]
    return needs


def _next_visit(
    outputs: Sequence[slice], waiting: Sequence[int], ready: BoolArray, known: BoolArray
) -> int | None:
    """Choose a component that can be finished; else one that can be advanced; else None."""
    for k, own in zip(waiting, outputs, strict=True):
        if ready[own].all():
            return k
    for k, own in zip(waiting, outputs, strict=True):
        if (ready[own] & ~known[own]).any():
            return k
    return None


def _loop(needs: BoolArray, known: BoolArray) -> list[int]:
    """A loop of unknown outputs, each needing the one before it; its first is also its last."""
    path = [int(np.flatnonzero(~known)[0])]
    # Every unknown output needs another unknown one, or it would have been ready.
    while path[-1] not in path[:-1]:
        path.append(int(np.flatnonzero(needs[path[-1]] & ~known)[0]))
    return path[path.index(path[-1]) :][::-1]


def _loop_message(loop: Sequence[str]) -> str:
    return (
        f"algebraic loop: {' -> '.join(loop)}; each depends at once on the one "
        "before. Let one of the components give its output from its state, or state its true "
        "dependencies in its model description"
    )
