"""The contacts of a linear pair: their law on whichever side owns them, or coupled exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from railcosim.master.component import Component, FloatArray, Variable
from railcosim.master.connections import Connection, connect_by_name
from railcosim.master.law import IndexArray, Tangents
from railcosim.master.linear.low_rank import factors
from railcosim.master.linear.modal import Modal, modal
from railcosim.master.linear.state_space import ComplexArray, StateSpace
from railcosim.master.stability.continuous import Continuous
from railcosim.master.stability.open_component import Open
from railcosim.master.system import System
from railcosim.mechanics.ports import IRREGULARITY, RAIL, WHEEL, Face, Layout

from .contact import Stiffness
from .law_in_master import KINDS
from .linear_pair import Part
from .owner import Owner
from .wiring import force_of

AT_ONCE = 1e-12
"""Of what all states add up to: a rate that a force makes at once and that is no larger is
rounding."""
SLOW = 0.01
"""Rate (1/s) at which what nothing holds and no law asks for, such as an axle's angle, goes back to
rest against creep: as slow as what counts as no growth. Else it would stay on the edge of growing
for ever, where rounding decides."""
PLACE = Variable(name="place", unit="m")
"""Of a wheel on its rail, of whose displacement FMUs state that it depends on it at once: so it is
read before forces are exchanged, and its rates, which depend on these, once before and once after.
Here wheels stand: nothing comes of it."""
MOTION = Variable(name="motion", unit="m")
"""Of a vehicle that owns the contacts, told beside forces: it depends on nothing at once, so forces
are read with it, as the step left them, before anything is exchanged."""


@dataclass(frozen=True, eq=False)
class _Body:
    """A side of the contacts: x' = A x + B forces, and motions C x."""

    A: FloatArray
    B: FloatArray
    C: FloatArray

    @property
    def rates(self) -> FloatArray:
        """Rates of the motions by states."""
        return self.C @ self.A

    @property
    def at_once(self) -> FloatArray:
        """Rates of the motions by forces, at once."""
        found: FloatArray = self.C @ self.B
        found[np.abs(found) <= AT_ONCE * (np.abs(self.C) @ np.abs(self.B))] = 0.0
        return found


class LinearLaw:
    """The law of a part's contacts, linear about rest.

    Parameters
    ----------
    part : Part
        Of a pair.
    contact : float or array
        See `Part.tangents`.

    Attributes
    ----------
    part : Part
        As given.
    law : Law
        In the master.
    T : array, shape (n_forces, n_motions)
        Its forces by what it is given.
    """

    def __init__(self, part: Part, contact: Stiffness) -> None:
        by = part.tangents(contact)
        self.part, kind = part, KINDS[part.layout.dimension]
        self.law = kind.component(Tangents(by), part.layout, {})
        S = self.law.S.reshape(len(by), -1, len(self.law.inputs))
        self.T: FloatArray = (by @ S).reshape(-1, len(self.law.inputs))
        self._names = [v.name for v in self.law.inputs]
        A, B, C = part.track.real()
        v = part.vehicle
        self._bodies = {RAIL: _Body(A, B, C), WHEEL: _Body(self._held(v), v.B, v.C)}

    def growth(self) -> float:
        """Rate (1/s) at which the fastest motion grows if vehicle and track are coupled exactly.

        Zero if nothing grows, as of passive sides. A reduced track need not be passive above its
        highest frequency, and a vehicle whose wheels roll hunts from some speed on.
        """
        return self._exact.growth()

    @property
    def _exact(self) -> Continuous:
        """Vehicle and track, coupled exactly: the forces that agree with what they do."""
        wheels, track = self._bodies[WHEEL], self.part.track
        through = np.zeros((len(self.T), len(self.T)))
        seen: dict[Face, Any] = {}
        for face, C, rates in (
            (WHEEL, wheels.C, wheels.rates), (RAIL, track.C, track.C * track.poles),
        ):  # fmt: skip
            by_motion, by_rate = self._by(face)
            seen[face] = by_motion @ C + by_rate @ rates
            through[:, self._forces(face)] += by_rate @ self._bodies[face].at_once
        agreed = np.linalg.inv(np.eye(len(through)) - through).astype(np.float64)
        on = {face: agreed[self._forces(face)] for face in (WHEEL, RAIL)}
        return Continuous(
            N=wheels.A + wheels.B @ on[WHEEL] @ seen[WHEEL], R=wheels.B @ on[WHEEL],
            Q=on[RAIL] @ seen[WHEEL], P=on[RAIL],
            poles=track.poles, B=track.B, C=seen[RAIL],
        )  # fmt: skip

    def response(self, omega: FloatArray, heights: ComplexArray) -> ComplexArray:
        """Forces of the law if vehicle and track are coupled exactly.

        Parameters
        ----------
        omega : array, shape (n_omega,)
            rad/s.
        heights : array of complex, shape (n_omega, n_surfaces)
            Of the rails' surfaces at the ports of the layout, m.

        Returns
        -------
        array of complex, shape (n_omega, n_forces)
        """
        G = np.zeros((len(omega), len(self.T), len(self.T)), dtype=complex)
        for face, own in zip((WHEEL, RAIL), self.part.response(omega), strict=True):
            by_motion, by_rate = self._by(face)
            along = by_motion + 1j * omega[:, None, None] * by_rate
            G[:, :, self._forces(face)] += along @ own
        given = heights @ self.T[:, self._columns(self.part.layout.surface.names(IRREGULARITY))].T
        solved = np.linalg.solve(np.eye(len(self.T)) - G, given[..., None])[..., 0]
        return np.asarray(solved, dtype=np.complex128)

    def system(self, owner: Owner) -> System:
        """The part as a system at rest, with the irregularity as a signal left open."""
        law = [self.law] if owner is Owner.MASTER else []
        sides = {
            WHEEL: self._side(WHEEL, "vehicle", owns=owner is Owner.VEHICLE),
            RAIL: self._side(RAIL, "track", owns=owner is Owner.TRACK),
        }
        given = set(self.part.layout.surface.names(IRREGULARITY))
        components: list[Component] = [
            Open("irregularity", (), tuple(v for v in self.law.inputs if v.name in given)),
            sides[WHEEL],
            *law,
            sides[RAIL],
        ]
        # As in a pair: what answers to forces at once is given late to whose forces answer to it.
        jumping = {
            (side.name, v.name)
            for face, side in sides.items()
            for v, row in zip(side.outputs, side.feedthrough, strict=True)
            if v.name in self._rates(face) and row.any()
        }
        made = [*connect_by_name(components)]
        if owner is not Owner.TRACK:
            height = components[0].outputs[0].name
            made.append(Connection("irregularity", height, "track", PLACE.name))
        return System(
            components, [replace(c, delayed=(c.source, c.output) in jumping) for c in made]
        )

    def _side(self, face: Face, name: str, *, owns: bool) -> Open:
        """Vehicle or track: from forces to motions, or with the law from motions to forces."""
        body, rows = self._bodies[face], self._forces(face)
        if owns:
            A, B, C, D, inputs, outputs = self._with_law(face, body)
        else:
            known = [(name in self._names, name) for name in self._rates(face)]
            rates = [k for k, (there, _) in enumerate(known) if there]
            at = self._columns([*self._motions(face), *(n for there, n in known if there)])
            A, B, C = body.A, body.B, np.concatenate([body.C, body.rates[rates]])
            D = np.concatenate([np.zeros_like(body.C @ body.B), body.at_once[rates]])
            inputs = tuple(self.law.outputs[k] for k in rows)
            outputs = tuple(self.law.inputs[k] for k in at)
        stated: NDArray[np.bool_] | None = None
        model: Modal | StateSpace
        if face is WHEEL:
            if owns:
                C, D = (np.pad(M, ((0, 1), (0, 0))) for M in (C, D))
                outputs = (*outputs, MOTION)
            model = StateSpace(
                name=name, A=csc_array(A), B=B, C=C, D=D, inputs=inputs, outputs=outputs
            )
        elif owns:
            few, by = factors(B)  # a force by a motion and by its rate drives modes alike
            moved = modal(name, A, few, C, D, inputs, outputs)
            model = replace(moved, B=moved.B @ by)
        else:
            t = self.part.track
            shown = np.concatenate([t.C, (t.C * t.poles)[rates]])
            D = np.pad(D, ((0, 0), (0, 1)))
            inputs = (*inputs, PLACE)
            stated = np.zeros(D.shape, dtype=bool)
            stated[: len(body.C), -1] = True
            B_modes = np.pad(t.B, ((0, 0), (0, 1)))
            model = replace(t, name=name, B=B_modes, C=shown, D=D, inputs=inputs, outputs=outputs)
        return Open(name, inputs, outputs, model, stated)

    def _with_law(
        self, face: Face, body: _Body
    ) -> tuple[
        FloatArray, FloatArray, FloatArray, FloatArray,
        tuple[Variable, ...], tuple[Variable, ...],
    ]:  # fmt: skip
        """A, B, C, D, inputs and outputs of a side that owns the contacts.

        Its own forces change rates at once, on which they depend: they are those that agree.
        """
        mine, (by_motion, by_rate) = self._forces(face), self._by(face)
        own = {*self._motions(face), *self._rates(face)}
        given = [k for k, name in enumerate(self._names) if name not in own]
        n = len(body.A)
        known = np.hstack([by_motion @ body.C + by_rate @ body.rates, self.T[:, given]])
        through = by_rate @ body.at_once
        agreed: FloatArray = known[mine]
        if through.any():
            agreed = np.asarray(np.linalg.solve(np.eye(len(mine)) - through[mine], agreed))
        sent = self._forces(face.other)
        shown = (known + through @ agreed)[sent]
        return (
            body.A + body.B @ agreed[:, :n], body.B @ agreed[:, n:], shown[:, :n], shown[:, n:],
            tuple(self.law.inputs[k] for k in given), tuple(self.law.outputs[k] for k in sent),
        )  # fmt: skip

    def _held(self, vehicle: StateSpace) -> FloatArray:
        """A of a vehicle, with springs so soft on what nothing else holds; see `SLOW`."""
        A: FloatArray = vehicle.A.toarray()
        by_motion, by_rate = self._by(WHEEL)
        asked = by_motion.any(axis=0)
        free = np.flatnonzero(~A.any(axis=0) & ~vehicle.C[asked].any(axis=0))
        creep = -vehicle.B @ (by_rate @ vehicle.C @ A)[self._forces(WHEEL)]
        for r in free.tolist():
            v = int(np.abs(A[r]).argmax())
            A[v, r] = -SLOW * creep[v, v] / A[r, v]
        return A

    def _by(self, face: Face) -> tuple[FloatArray, FloatArray]:
        """Forces by motions and by rates of a side, each of shape (n_forces, ports)."""
        rates = self._rates(face)
        known = [k for k, name in enumerate(rates) if name in self._names]
        by_rate = np.zeros((len(self.T), len(rates)))
        by_rate[:, known] = self.T[:, self._columns([rates[k] for k in known])]
        return self.T[:, self._columns(self._motions(face))], by_rate

    def _forces(self, face: Face) -> IndexArray:
        """Which of the law's forces act at the ports of a side."""
        names = [v.name for v in self.law.outputs]
        return np.array([names.index(force_of(face, port)) for port in self._at(face).ports])

    def _columns(self, names: Sequence[str]) -> list[int]:
        """Where motions stand."""
        return [self._names.index(name) for name in names]

    def _motions(self, face: Face) -> tuple[str, ...]:
        return self._at(face).names(face.motion)

    def _rates(self, face: Face) -> tuple[str, ...]:
        return self._at(face).names(face.rate)

    def _at(self, face: Face) -> Layout:
        return self.part.layout if face is WHEEL else self.part.layout.rails
