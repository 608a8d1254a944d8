"""Bodies in modal form: how contact forces drive them, and how they move where they are met.

ds/dt = poles s + g for every mode (complex), d2r/dt2 = g for every rigid-body coordinate. A track
and a vehicle differ in where their shapes come from (`shapes`), and only a vehicle has coordinates
of bodies beside its modes (`coordinates`). Needs numpy only: a copy of this file travels in every
FMU.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import ComplexArray, FloatArray
from .coordinates import Coordinates
from .gaps import Gaps
from .observation import Observation
from .ports import DIRECTIONS, RAIL, SIDES, WHEEL, Face, Layout, Numbers
from .shapes import AlongRing, Everywhere
from .stepping import Drive, State

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, kw_only=True)
class ModalBody:
    """A track or a vehicle.

    Attributes
    ----------
    layout : Layout
        The ports that it is met at.
    face : Face
        WHEEL or RAIL: what it meets with.
    poles : array, shape (n_modes,)
        rad/s, one of each conjugate pair: even modes, odd ones, then a local one a port, then those
        of the observation.
    even : int
        How many are even, moving as their own mirror image.
    shapes : AlongRing or Everywhere
        Of even and odd modes.
    rigid_out, rigid_into : array, shape (rows, n_rigid)
        Motion by rigid-body coordinates, even ones first, and how forces drive these.
    even_rigid : int
        How many of them are even.
    preload : array, shape (ports,)
        Contact forces that load nothing: a vehicle's own weight, N.
    coordinates : Coordinates or None
        Of a vehicle. None: it stays, and wheels may roll along it.
    observation : Observation or None
        What is seen of a track at fixed places; None: nothing.
    apart : bool
        Whether the sides are no mirror images: then all modes are counted as even, and a row is
        a wheelset on a side in a direction.
    gaps : Gaps or None
        Springs of a track that close; None: all is linear.
    """

    layout: Layout
    face: Face
    poles: ComplexArray
    even: int
    shapes: AlongRing | Everywhere
    rigid_out: FloatArray
    rigid_into: FloatArray
    even_rigid: int
    preload: FloatArray
    coordinates: Coordinates | None = None
    observation: Observation | None = None
    apart: bool = False
    gaps: Gaps | None = None

    @property
    def ports(self) -> int:
        """How many."""
        return len(self.layout.ports)

    @property
    def shared(self) -> int:
        """Modes but for the local ones and those of the observation."""
        seen = 0 if self.observation is None else self.observation.poles.size
        return self.poles.size - (self.ports if self.shapes.local else 0) - seen

    @property
    def sign(self) -> int:
        """1 if a positive motion presses (wheels), -1 if it relieves (rails)."""
        return -self.face.push

    def at(self, position: FloatArray) -> Met:
        """The body as it is met by wheelsets at positions, shape (wheelsets,), m."""
        sides = len(self.layout.sides) if self.apart else 1
        rows = self.layout.wheelsets * len(self.layout.directions) * sides
        out, into, local = self.shapes.at(position, rows)
        if self.apart:
            k = len(self.layout.directions)
            local = local.reshape(-1, k, k)[self._row_of_port[::k] // k]
        elif local.size:
            local = self.layout.both_sides(local)
        seen = None if self.observation is None else self.observation.driven(position)
        return Met(self, out, into, local, seen)

    def halves(self, at_ports: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Of forces, what drives even and odd modes by rows, on the last axis."""
        if not self.apart:
            return self.layout.halves(at_ports)
        rows = at_ports[..., np.argsort(self._row_of_port)]
        return rows, rows

    def joined(self, even: Numbers, odd: Numbers) -> Numbers:
        """Motions at the ports from those of even and of odd modes by rows, on the last axis."""
        if not self.apart:
            return self.layout.joined(even, odd)
        at_ports: Numbers = (even + odd)[..., self._row_of_port]
        return at_ports

    @cached_property
    def _row_of_port(self) -> NDArray[np.intp]:
        """Of sides that are apart: rows go wheelset by wheelset, ports side by side."""
        rows = np.arange(self.ports).reshape(self.layout.wheelsets, len(self.layout.sides), -1)
        return rows.swapaxes(0, 1).ravel()

    # --- of a free vehicle ----------------------------------------------------------------------

    def on(self, height: FloatArray) -> State:
        """The state at rest with the wheelsets at given heights, shape (wheelsets,), m."""
        known = self._coordinates
        still = np.zeros(known.rigid.shape[1])
        return State(known.start_s @ height, known.start_r @ height, still)

    def displacements(self, state: State) -> FloatArray:
        """Of all coordinates, shape (c,)."""
        known = self._coordinates
        moved: FloatArray = known.rigid @ state.r + (known.modes @ state.s).real
        return moved

    def velocities(self, state: State) -> FloatArray:
        """Of all coordinates, shape (c,)."""
        known = self._coordinates
        moving: FloatArray = known.rigid @ state.v + (known.modes @ (self.poles * state.s)).real
        return moving

    def accelerations(self, state: State, force: FloatArray) -> FloatArray:
        """Of all coordinates; a force acts at once only on its own body."""
        known = self._coordinates
        even, odd = self.halves(force - self.preload)
        at_once = [known.through[: known.even] @ even, known.through[known.even :] @ odd]
        a: FloatArray = (known.modes @ (self.poles**2 * state.s)).real
        return a + np.concatenate(at_once)

    @property
    def _coordinates(self) -> Coordinates:
        if self.coordinates is None:
            raise TypeError("a track has no coordinates of bodies")
        return self.coordinates

    # --- as arrays that a file can hold ---------------------------------------------------------

    def arrays(self) -> Arrays:
        """All of it; `from_arrays` makes the same body of them."""
        own = {name: np.asarray(getattr(self, name)) for name in OWN}
        directions = [DIRECTIONS.index(d) for d in self.layout.directions]
        layout = [self.layout.wheelsets, len(self.layout.sides), *directions]
        parts = {
            "shape": self.shapes, "coordinate": self.coordinates, "seen": self.observation,
            "gap": self.gaps,
        }  # fmt: skip
        return own | {
            "layout": np.array(layout),
            "even": np.array(self.even),
            "apart": np.array(self.apart),
            "even_rigid": np.array(self.even_rigid),
            "is_rail": np.array(self.face is RAIL),
            **{
                f"{part}.{name}": np.asarray(value)
                for part, thing in parts.items()
                if thing is not None
                for name, value in _fields(thing).items()
            },
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> ModalBody:
        """What `arrays` made."""
        wheelsets, sides, *directions = arrays["layout"].tolist()
        layout = Layout(wheelsets, SIDES[:sides], tuple(DIRECTIONS[d] for d in directions))
        shapes = _part(arrays, "shape")
        known, seen = _part(arrays, "coordinate"), _part(arrays, "seen")
        gaps = _part(arrays, "gap")
        for name in known.keys() & {"bodies", "names"}:
            known[name] = tuple(known[name].tolist())
        return cls(
            layout=layout,
            face=RAIL if arrays["is_rail"] else WHEEL,
            shapes=AlongRing(**shapes) if "table" in shapes else Everywhere(**shapes),
            coordinates=Coordinates(**known) if known else None,
            observation=Observation(**seen) if seen else None,
            even=int(arrays["even"]),
            even_rigid=int(arrays["even_rigid"]),
            apart=bool(arrays["apart"]),
            gaps=Gaps(**gaps) if gaps else None,
            **{name: arrays[name] for name in OWN},
        )


OWN = ("poles", "rigid_out", "rigid_into", "preload")


def _fields(thing: object) -> dict[str, Any]:
    return {name: getattr(thing, name) for name in type(thing).__dataclass_fields__}  # type: ignore[attr-defined]


def _part(arrays: Mapping[str, NDArray[Any]], part: str) -> dict[str, Any]:
    names = [name for name in arrays if name.startswith(f"{part}.")]
    return {name.removeprefix(f"{part}."): arrays[name][()] for name in names}


@dataclass(frozen=True, eq=False)
class Met:
    """A body with its mode shapes where it is met.

    Attributes
    ----------
    body : ModalBody
        Whose.
    out, into : array, shape (rows, n)
        As displacements, and as forces receive them.
    local : array, shape (contacts, directions, directions)
        Shapes of each contact's own oscillators; empty without any.
    seen : array, shape (n_own, ports), or None
        How forces drive the oscillators of the observation, if there is one.
    """

    body: ModalBody
    out: ComplexArray
    into: ComplexArray
    local: ComplexArray
    seen: ComplexArray | None = None

    def drive(self, force: FloatArray) -> Drive:
        """Generalised forces of contact forces beyond the preload, shape (ports,)."""
        even, odd = self.body.halves(force)
        n = self.body.even
        driven = [even @ self.into[:, :n], odd @ self.into[:, n:]]
        if self.local.size:
            loads = force.reshape(-1, 1, self.local.shape[1])
            driven.append((loads @ self.local).ravel())
        if self.seen is not None:
            driven.append(self.seen @ force)
        n, into = self.body.even_rigid, self.body.rigid_into
        return Drive(
            np.concatenate(driven), np.concatenate([even @ into[:, :n], odd @ into[:, n:]])
        )

    def motion(self, state: State) -> FloatArray:
        """Displacements at the ports, shape (ports,), m."""
        return self._seen(state.s, state.r)

    def velocity(self, state: State, force: FloatArray) -> FloatArray:
        """Velocities of the material there; modes left out let a little force through."""
        seen = self._seen(self.body.poles * state.s, state.v)
        return seen + self.through @ force if self.body.coordinates is None else seen

    def observed(self, state: State, force: FloatArray) -> FloatArray:
        """What is seen at fixed places, shape (n_outputs,), under contact forces."""
        observation = self.body.observation
        if observation is None:
            return np.empty(0)
        n, own = self.body.shared, observation.poles.size
        rate = self.body.poles * state.s + self.drive(force).s
        return observation.outputs(
            state.s[:n], state.s[-own:], rate[:n], rate[-own:], self.body.poles[:n]
        )

    @cached_property
    def through(self) -> FloatArray:
        """Velocity at once per force, (ports, ports), m/(N s)."""
        if self.body.coordinates is not None:  # no modes are left out: it would be rounding
            return np.zeros((self.body.ports, self.body.ports))
        return self.compliance(np.ones_like(self.body.poles), 0.0)

    def _seen(self, s: ComplexArray, r: FloatArray) -> FloatArray:
        n, shared = self.body.even, self.body.shared
        even = self.out[:, :n] @ s[:n]
        odd = self.out[:, n:] @ s[n:shared]
        at_ports = self.body.joined(even, odd)
        if self.local.size:
            own = s[shared : shared + self.body.ports].reshape(-1, self.local.shape[1], 1)
            at_ports = at_ports + (self.local @ own).ravel()
        if not r.size:
            return at_ports.real
        n, rigid = self.body.even_rigid, self.body.rigid_out
        moved = self.body.joined(rigid[:, :n] @ r[:n], rigid[:, n:] @ r[n:])
        return at_ports.real + moved

    def compliance(self, weight: ComplexArray, rigid_weight: float) -> FloatArray:
        """Sum over modes and rigid-body coordinates of out x weight x into, (ports, ports)."""
        n, shared, body = self.body.even, self.body.shared, self.body
        weighted = self.out * weight[:shared]
        even = (weighted[:, :n] @ self.into[:, :n].T).real
        odd = (weighted[:, n:] @ self.into[:, n:].T).real
        k, rigid, into = self.body.even_rigid, self.body.rigid_out, self.body.rigid_into
        even += (rigid_weight * rigid[:, :k]) @ into[:, :k].T
        odd += (rigid_weight * rigid[:, k:]) @ into[:, k:].T
        forces = np.eye(self.body.ports)
        loads = body.halves(forces)  # of a unit force at each port
        G: FloatArray = body.joined(loads[0] @ even.T, loads[1] @ odd.T).T
        if self.local.size:
            k = self.local.shape[1]
            weights = weight[shared : shared + self.body.ports].reshape(-1, 1, k)
            own = ((self.local * weights) @ np.swapaxes(self.local, 1, 2)).real
            contact = np.arange(len(own))
            G.reshape(len(own), k, len(own), k)[contact, :, contact] += own
        return G

    def static_compliance(self) -> FloatArray:
        """Static deflection per force of a body without rigid motions, (ports, ports), m/N."""
        return self.compliance(-1 / self.body.poles, 0.0)

    def rest(self, force: FloatArray) -> State:
        """The state at rest of a body without rigid motions, under constant forces."""
        s, gaps = -self.drive(force).s / self.body.poles, self.body.gaps
        return State(s if gaps is None else gaps.rest(self.body.poles, s), np.empty(0), np.empty(0))

    def by_gaps(self) -> FloatArray:
        """Motions at the ports of a body at rest by pressing forces of its gaps' springs.

        Taken for forces that pull: by them what forces at the ports stretch, (ports, m), m/N.
        """
        gaps = self.body.gaps
        if gaps is None:
            return np.empty((self.body.ports, 0))
        by = [
            self.motion(State(-gaps.moved(-1 / self.body.poles, one), np.empty(0), np.empty(0)))
            for one in np.eye(gaps.gap.size)
        ]
        return np.stack(by, axis=1)
