"""Energy that a coupling creates: the work done on one side less that done by the other.

Where two components exchange a force and a motion, what one gives the other takes, if both see
the same force and the same motion. In a co-simulation each sees its own output and an input that
was held or continued over the step; the work of either differs, and the difference comes out of
nothing or goes there. It is the energy residual of the interface [1]_. It vanishes with the step
as fast as the error does, and grows where a coupling is unstable.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import factorial

from railcosim.master.bonds import WORK, Bond, kind_of, units_of
from railcosim.master.component import FloatArray
from railcosim.master.connections import Connection, CouplingError
from railcosim.master.cosimulation import CommunicationPoint
from railcosim.master.law import Law
from railcosim.master.polynomials import lagrange
from railcosim.master.system import System

Slot = NDArray[np.intp]
Take = Callable[["EnergyMeter", "_Interface", FloatArray, FloatArray], FloatArray]
_PARABOLA = 3
"""Points through which an output is taken to go between two of them."""
_GAUSS = np.polynomial.legendre.leggauss(3)
_NODES, _WEIGHTS = 0.5 * (1.0 + _GAUSS[0]), 0.5 * _GAUSS[1]  # from 0 to 1
"""Exact to degree 5: a quadratic input, a parabola and to spare."""


class _Path(NamedTuple):
    """A step of a component, and how its inputs went."""

    t: float
    h: float
    taylor: FloatArray


class EnergyMeter:
    """Adds up the energy that the coupling creates at each bond.

    The inputs are those that the components were really stepped with. The outputs between two
    communication points are taken along the parabola through the last three; what that leaves is
    of third order in the step, so errors of a coupling up to its second order are resolved.

    A displacement that a component is given differs from the true one, and where it jumps to that,
    work is done as well. The force then differs by what it answers at once, which is read at the
    communication points with inputs that deviate as they did. A `Law` has no state: it saw the
    motions at the points only, where they are true, so at its bonds only the forces differ.

    Parameters
    ----------
    system : System
        To be measured; one meter a system.
    bonds : sequence of Bond
        For instance from `find_bonds`.

    Raises
    ------
    CouplingError
        If a bond is none, or its connections are not the system's.

    Examples
    --------
    >>> meter = EnergyMeter(system, find_bonds(system))                   # doctest: +SKIP
    >>> stopped = record(meter.watch(cosimulate(...)), recorder)          # doctest: +SKIP
    >>> xr.merge([recorder.to_dataset(), meter.to_dataset()], join="left")  # doctest: +SKIP

    References
    ----------
    .. [1] S. Sadjina, L. T. Kyllingstad, S. Skjong, E. Pedersen, Energy conservation and power
       bonds in co-simulations: non-iterative adaptive step size control and error estimation,
       Engineering with Computers 33 (2017) 607-620.
    """

    def __init__(self, system: System, bonds: Sequence[Bond]) -> None:
        self.bonds = tuple(bonds)
        self._system = system
        self._interfaces = _interfaces(system, self.bonds)
        self._paths: list[list[_Path]] = [[] for _ in system.components]
        self._times: list[float] = []
        self._created: list[FloatArray] = []
        system.on_step = self._note

    def watch(self, points: Iterable[CommunicationPoint]) -> Iterator[CommunicationPoint]:
        """Pass points on, and measure between them."""
        recent: tuple[CommunicationPoint, ...] = ()
        for point in points:
            recent = (*recent[1 - _PARABOLA :], point)
            created = np.zeros(len(self.bonds))
            if len(recent) > 1:
                times = np.array([p.time for p in recent])
                outputs = np.array([p.outputs for p in recent])
                for interface in self._interfaces:
                    gained = self._pushed(interface, times, outputs)
                    given = interface.take(self, interface, times, outputs)
                    created[interface.bonds] = interface.signs * (gained - given)
            self._times.append(point.time)
            self._created.append(created)
            yield point

    def to_dataset(self) -> xr.Dataset:
        """Give what has been measured so far.

        Returns
        -------
        xarray.Dataset
            Dimension ``time`` (s): energy created since the start, in J, at each bond as
            ``energy_residual[SOURCE.EFFORT->TARGET]``, and by all together, ``energy_residual``.
            What one step created is the difference of two.
        """
        shape = len(self._created), len(self.bonds)
        total = np.cumsum(np.array(self._created).reshape(shape), axis=0)
        names = [f"energy_residual[{bond.name}]" for bond in self.bonds]
        columns = {**dict(zip(names, total.T, strict=True)), "energy_residual": total.sum(axis=1)}
        attrs = {"units": "J", "long_name": "energy created by the coupling since the start"}
        time = ("time", np.array(self._times), {"units": "s", "long_name": "time"})
        return xr.Dataset({n: ("time", c, attrs) for n, c in columns.items()}, {"time": time})

    def _note(self, k: int, t: float, h: float, taylor: FloatArray) -> None:
        """Remember a step of component `k`, and forget those it replaces."""
        paths = self._paths[k]
        while paths and paths[-1].t >= t:
            paths.pop()
        paths.append(_Path(t, h, taylor))

    def _pushed(self, at: _Interface, times: FloatArray, outputs: FloatArray) -> FloatArray:
        """Work of the inputs that are efforts, since the point before, J."""
        work = np.zeros(len(at.bonds))
        for t, h, taylor in self._since(at.pushed, times[-2]):
            flow = _lagrange(times, t + h * _NODES, at.rate) @ outputs[:, at.motions]
            work += h * _WEIGHTS @ (_polynomial(taylor[:, at.forces], h * _NODES) * flow)
        return work

    def _flow(self, at: _Interface, times: FloatArray, outputs: FloatArray) -> FloatArray:
        """Work that inputs that are velocities take, J."""
        work = np.zeros(len(at.bonds))
        for t, h, taylor in self._since(at.moved, times[-2]):
            effort = _lagrange(times, t + h * _NODES, 0) @ outputs[:, at.efforts]
            work += h * _WEIGHTS @ (_polynomial(taylor[:, at.moves], h * _NODES) * effort)
        return work

    def _law(self, at: _Interface, times: FloatArray, outputs: FloatArray) -> FloatArray:
        """Work that the true displacements or velocities take, J."""
        t, h = times[-2], times[-1] - times[-2]
        effort, flow = (_lagrange(times, t + h * _NODES, n) for n in (0, at.rate))
        work: FloatArray = (
            h * _WEIGHTS @ ((effort @ outputs[:, at.efforts]) * (flow @ outputs[:, at.motions]))
        )
        return work

    def _displacement(self, at: _Interface, times: FloatArray, outputs: FloatArray) -> FloatArray:
        """Work that inputs that are displacements take, also where they jump, J."""
        sources = self._system.sources(at.moved)
        fed = sources < outputs.shape[1]
        paths = self._since(at.moved, times[-2])
        work = np.zeros(len(at.bonds))

        def true(time: FloatArray) -> FloatArray:
            u = np.broadcast_to(paths[0].taylor[0], (len(time), len(sources))).copy()
            u[:, fed] = _lagrange(times, time, 0) @ outputs[:, sources[fed]]
            return u

        def effort(time: FloatArray, u: FloatArray) -> FloatArray:
            smooth = _lagrange(times, time, 0) @ outputs[:, at.efforts]
            return self._answer(at, u - true(time)) + smooth

        last = true(times[-2:-1])
        for t, h, taylor in paths:
            start, time = np.array([t]), t + h * _NODES
            work += (effort(start, (last + taylor[:1]) / 2) * (taylor[:1] - last)[:, at.moves])[0]
            u, rate = _polynomial(taylor, h * _NODES), _polynomial(_rates(taylor), h * _NODES)
            work += h * _WEIGHTS @ (rate[:, at.moves] * effort(time, u))
            last = _polynomial(taylor, np.array([h]))
        end = true(times[-1:])
        work += (effort(times[-1:], (last + end) / 2) * (end - last)[:, at.moves])[0]
        return work

    def _answer(self, at: _Interface, deviations: FloatArray) -> FloatArray:
        """By how much the efforts answer at once to inputs that deviate, (n, n_inputs) of them."""
        component = self._system.components[at.moved]
        u, y = component.u.copy(), component.y.copy()
        chosen = at.efforts - self._system.own_outputs(at.moved).start
        answers = np.empty((len(deviations), len(chosen)))
        for answer, deviation in zip(answers, deviations, strict=True):
            component.u[:] = u + deviation
            component.write_inputs()
            component.read_outputs()
            answer[:] = component.y[chosen] - y[chosen]
        component.u[:], component.y[:] = u, y
        component.write_inputs()
        return answers

    def _since(self, k: int, t: float) -> list[_Path]:
        """How inputs of component `k` went since `t` (s)."""
        paths = self._paths[k]
        while paths[0].t + 0.5 * paths[0].h < t:
            paths.pop(0)
        return paths


@dataclass(frozen=True)
class _Interface:
    """Bonds between the same components: indices of components, of their inputs, of outputs.

    `take` measures the work on the side of the motions; `rate` is 1 for displacements, else 0.
    """

    bonds: Slot
    signs: FloatArray
    take: Take
    rate: int
    pushed: int
    forces: Slot
    efforts: Slot
    moved: int
    moves: Slot
    motions: Slot


def _interfaces(system: System, bonds: Sequence[Bond]) -> tuple[_Interface, ...]:
    """Put bonds between the same components together."""
    units = units_of(system)
    groups: dict[tuple[int, int, bool], list[int]] = {}
    for i, bond in enumerate(bonds):
        for connection in (bond.effort, bond.motion):
            if connection not in units:
                raise CouplingError(f"bond {bond.name}: {connection} is not in the system")
        kind = kind_of(system, bond)
        if kind is None:
            raise CouplingError(
                f"bond {bond.name}: {units[bond.effort]!r} times {units[bond.motion]!r} is neither "
                "a power nor a work"
            )
        key = system.index(bond.effort.target), system.index(bond.motion.target), kind is WORK
        groups.setdefault(key, []).append(i)
    found = []
    for (pushed, moved, work), members in groups.items():
        chosen = [bonds[i] for i in members]
        forces, efforts = _places(system, [bond.effort for bond in chosen])
        moves, motions = _places(system, [bond.motion for bond in chosen])
        signs = np.array([bond.sign for bond in chosen], dtype=float)
        take = EnergyMeter._displacement if work else EnergyMeter._flow
        if isinstance(system.components[moved], Law):
            take = EnergyMeter._law
        numbers = np.array(members)
        found.append(
            _Interface(
                numbers, signs, take, int(work), pushed, forces, efforts, moved, moves, motions
            )
        )
    return tuple(found)


def _places(system: System, connections: Sequence[Connection]) -> tuple[Slot, Slot]:
    """Where connections end, among the target's inputs, and begin, among all outputs."""
    targets = [system.components[system.index(c.target)] for c in connections]
    inputs = [
        [v.name for v in target.inputs].index(c.input)
        for target, c in zip(targets, connections, strict=True)
    ]
    outputs = [system.names.index(f"{c.source}.{c.output}") for c in connections]
    return np.array(inputs), np.array(outputs)


def _lagrange(times: FloatArray, at: FloatArray, derivative: int) -> FloatArray:
    """Weights of values at `times` for the polynomial through them, or its derivative, at `at`."""
    scale = times[-1] - times[0]
    known, wanted = ((x - times[-1]) / scale for x in (times, at))
    weights: FloatArray = lagrange(known, wanted, derivative) / scale**derivative
    return weights


def _polynomial(taylor: FloatArray, tau: FloatArray) -> FloatArray:
    """Value after `tau` (s), shape (n_tau, n_inputs)."""
    powers = np.vander(tau, len(taylor), increasing=True) / factorial(np.arange(len(taylor)))
    values: FloatArray = powers @ taylor
    return values


def _rates(taylor: FloatArray) -> FloatArray:
    """Value and derivatives of the rate of a polynomial."""
    return taylor[1:] if len(taylor) > 1 else np.zeros_like(taylor)
