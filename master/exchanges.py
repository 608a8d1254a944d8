"""Exchanges as lists of calls, one for each pattern of what has to be read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from railcosim.master.batch.batch import Batch
from railcosim.master.batch.call import By, Call, Row
from railcosim.master.component import FloatArray
from railcosim.master.exchange import ExchangePlan
from railcosim.master.ports import Port


class Exchanges:
    """All exchanges of a system, each made when it is asked for first.

    Parameters
    ----------
    ports : sequence of Port
        The components.
    plan : ExchangePlan
        The order.
    buffer : array
        All outputs, and behind them all start values.
    inputs : array
        All inputs, in the order of the ports.
    """

    def __init__(
        self, ports: Sequence[Port], plan: ExchangePlan, buffer: FloatArray, inputs: FloatArray
    ) -> None:
        self._ports, self._plan = ports, plan
        self._buffer, self._inputs = buffer, inputs
        self._made: dict[int, tuple[Batch, int, int]] = {}

    def of(self, stale: int) -> tuple[Batch, int, int]:
        """What is to be done where outputs are stale, a bit for each component.

        Returns
        -------
        Batch
            The calls.
        int, int
            What is stale until they have been made, and after that.
        """
        found = self._made.get(stale)
        if found is None:
            found = self._made[stale] = self._make(stale)
        return found

    def _make(self, stale: int) -> tuple[Batch, int, int]:
        calls, until = [], stale
        for k, needs_inputs in self._plan.visits:
            port, bit = self._ports[k], 1 << k
            if needs_inputs:
                calls += [self._gathering(port.sources, port.component.u), port.calls.write]
                stale |= bit
                until |= bit
            if stale & bit:
                calls.append(port.calls.read)
                stale &= ~bit
        if self._plan.late:  # the others have been given what they will have
            sources = np.concatenate([port.sources for port in self._ports])
            calls.append(self._gathering(sources, self._inputs))
            # No output depends at once on what is new here.
            calls += [self._ports[k].calls.write for k in self._plan.late]
        return Batch(calls), until, stale

    def _gathering(self, sources: NDArray[np.intp], u: FloatArray) -> Call:
        """Put the present values of sources into inputs."""

        def gather() -> None:
            # "clip" only because the default checks every index again; all are in range.
            self._buffer.take(sources, None, u, "clip")

        places = np.ascontiguousarray(sources, dtype=np.int64)
        row = Row(
            kind=By.GATHER, places=places.ctypes.data, count=places.size,
            values=u.ctypes.data, from_=self._buffer.ctypes.data,
        )  # fmt: skip
        return Call(gather, row=row, keeps=places)
