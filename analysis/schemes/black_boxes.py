"""The largest stable step of any system of FMUs: from linear models of each, however had."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.sparse import csc_array

from railcosim.master.component import Component, FloatArray, Hold, Type
from railcosim.master.connections import Connection, CouplingError
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.law import Law
from railcosim.master.law_file import read_law
from railcosim.master.linear.linear_fmu import Pulses, Wanted, best_way
from railcosim.master.linear.linear_form import LinearForm
from railcosim.master.linear.linearise import LinearModel
from railcosim.master.linear.state_space import StateSpace
from railcosim.master.progress import Progress, unheard
from railcosim.master.ssp import LoadedSystem, initialise, open_ssp
from railcosim.master.stability.open_component import Open
from railcosim.master.system import System
from railcosim.master.units import IDENTITY

from .catalogue import Member, members
from .limits import LINEARISING, predictable
from .stability import FAILURES, Coupling, Limit
from .usual import PREDICTED

SLOW, FAST = 1e-4, 1e-2
"""Growth that counts, and that is fast, over the rate (1/s) of the system's slowest motion."""
SHORT, LONG = 1e-3, 1.0
"""Steps that are searched: parts of a period of the fastest motion, and of the slowest."""
STEPS = 2000
"""Of a record of pulses."""


class Box(Open):
    """A component left open that declares, and can do, what another does."""

    def __init__(self, model: StateSpace, like: Component) -> None:
        super().__init__(model.name, model.inputs, model.outputs, model)
        columns, rows = (
            [[v.name for v in known].index(v.name) for v in own]
            for known, own in ((like.inputs, self.inputs), (like.outputs, self.outputs))
        )
        able = like.max_input_derivative
        self.max_input_derivative = min(able, 2) or int(Hold.EXTRAPOLATE in like.holds)
        self.can_rollback = like.can_rollback
        self._declared = like.feedthrough[np.ix_(rows, columns)]
        self._stated = like.states_dependence[rows]

    @property
    def feedthrough(self) -> NDArray[np.bool_]:
        """By which a run would sort its exchange, see `Component`."""
        return self._declared

    @property
    def states_dependence(self) -> NDArray[np.bool_]:
        """Likewise."""
        return self._stated


class Boxes:
    """Black boxes as linear components left open, coupled as they would be run; see `Coupling`.

    Parameters
    ----------
    models : sequence of StateSpace
        Of each component.
    like : sequence of Component
        The components themselves.
    connections : sequence of Connection
        Between them and the law.
    law : Law, optional
        In the master.

    Attributes
    ----------
    exact : float
        Rate (1/s) at which something grows if all is coupled exactly; zero if nothing does.
    rate, fast : float
        What grows slower counts as stable, and as slow, 1/s.
    shortest, resonant, longest : float
        Steps that are searched, and that at which the fastest mode turns by half, s.
    """

    parts, width = (), 4

    def __init__(
        self,
        models: Sequence[StateSpace],
        like: Sequence[Component],
        connections: Sequence[Connection],
        law: Law | None = None,
    ) -> None:
        boxes: list[Component] = [Box(m, c) for m, c in zip(models, like, strict=True)]
        system = System([*boxes, *([law] if law else [])], connections)
        self.systems, self.rests = [system], [system.save_state()]
        own = np.concatenate([np.zeros(0), *(np.linalg.eigvals(m.A.toarray()) for m in models)])
        coupled = _coupled(models, law, connections)
        moving = np.abs(np.concatenate([own, coupled]))
        moving = moving[moving > 1e-9 * moving.max(initial=0.0)]
        if not moving.size:
            raise CouplingError("nothing in it moves by itself: no rate depends on a state")
        slowest, fastest = float(moving.min()), float(moving.max())
        self.exact = max(0.0, float(coupled.real.max(initial=-math.inf)))
        self.rate, self.fast = self.exact + SLOW * slowest, self.exact + FAST * slowest
        self.resonant = math.pi / float(np.abs(own).max(initial=fastest / 1e3))
        self.shortest = SHORT * 2.0 * math.pi / fastest
        self.longest = LONG * 2.0 * math.pi / slowest


def _coupled(
    models: Sequence[StateSpace], law: Law | None, connections: Sequence[Connection]
) -> NDArray[np.complex128]:
    """Poles (1/s) of all coupled exactly."""
    ins = [(m.name, v.name) for m in models for v in m.inputs]
    outs = [(m.name, v.name) for m in models for v in m.outputs]
    D = block_diag(*(m.D for m in models))
    if law is not None:
        ins += [(law.name, v.name) for v in law.inputs]
        outs += [(law.name, v.name) for v in law.outputs]
        tangent = law.law.tangent(np.zeros((law.contacts, len(law.S) // law.contacts)))
        D = block_diag(D, block_diag(*tangent) @ law.S)
    A = block_diag(*(m.A.toarray() for m in models))
    B, C = np.zeros((len(A), len(ins))), np.zeros((len(outs), len(A)))
    B[:, : sum(len(m.inputs) for m in models)] = block_diag(*(m.B for m in models))
    C[: sum(len(m.outputs) for m in models)] = block_diag(*(m.C for m in models))
    K = np.zeros((len(ins), len(outs)))
    for c in connections:
        K[ins.index((c.target, c.input)), outs.index((c.source, c.output))] = 1.0
    closed = A + B @ K @ np.linalg.solve(np.eye(len(outs)) - D @ K, C)
    return np.asarray(np.linalg.eigvals(closed), dtype=np.complex128)


def state_space_of(form: LinearForm) -> StateSpace:
    """A linear model as matrices, also one from pulses if all of its motion has poles.

    Raises
    ------
    FmuError
        If it has more motions than pulses tell apart.
    """
    if isinstance(form, StateSpace):
        return form
    assert isinstance(form, LinearModel)
    blocks, into, out = [], [], []
    D = np.zeros((len(form.outputs), len(form.inputs)))
    for response, mixed in zip(form.responses, form.mixing, strict=True):
        if len(response.rest):
            raise FmuError(
                f"{form.name}: pulses show more motions than they tell apart; take longer records, "
                "or an FMU for Model Exchange"
            )
        known = response.lasting
        D += np.outer(known.direct, mixed)
        for pole, residue in zip(known.poles, known.residues.T, strict=True):
            if pole.imag > 0.0:  # and its conjugate
                blocks.append(np.array([[pole.real, -pole.imag], [pole.imag, pole.real]]))
                into += [mixed, np.zeros_like(mixed)]
                out += [2.0 * residue.real, -2.0 * residue.imag]
            elif pole.imag == 0.0:
                blocks.append(np.array([[pole.real]]))
                into.append(mixed)
                out.append(residue.real)
    n = len(into)
    return StateSpace(
        name=form.name, A=csc_array(block_diag(*blocks) if n else np.zeros((0, 0))),
        B=np.array(into).reshape(n, len(form.inputs)),
        C=np.array(out).reshape(n, len(form.outputs)).T, D=D,
        inputs=form.inputs, outputs=form.outputs, standing=form.standing,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SystemStability:
    """What was predicted of a system.

    Attributes
    ----------
    limits : dict of str to Limit
        By scheme.
    refused : dict of str to str
        Schemes that the system does not allow, and why.
    growth : float
        Rate (1/s) at which something grows if all is coupled exactly; 0 if nothing does.
    ways : dict of str to str
        How each component was linearised.
    longest : float
        Up to which steps were searched, s.
    """

    limits: dict[str, Limit]
    refused: dict[str, str]
    growth: float
    ways: dict[str, str]
    longest: float

    def to_dataset(self) -> xr.Dataset:
        """Largest steps by scheme."""
        found = list(self.limits.values())
        table = {
            "step": ([limit.step for limit in found], "s", "largest stable step"),
            "fast": ([limit.fast for limit in found], "s", "largest step without fast growth"),
            "evaluations": ([limit.evaluations for limit in found], "1", "evaluations a step"),
        }
        return xr.Dataset(
            {
                name: ("scheme", np.array(values, dtype=float), {"units": unit, "long_name": text})
                for name, (values, unit, text) in table.items()
            },
            coords={"scheme": list(self.limits)},
            attrs={
                "title": "largest stable step", "growth": self.growth, "longest": self.longest,
                **{f"linearised {name}": way for name, way in self.ways.items()},
            },
        )  # fmt: skip


def system_stability(
    path: str | Path,
    schemes: Sequence[str] = PREDICTED,
    *,
    law: str | Path | None = None,
    step: float | None = None,
    amplitude: float = 1e-3,
    load: Callable[..., LoadedFmu] = FmuComponent.load,
    progress: Progress = unheard,
) -> SystemStability:
    """Predict the largest stable step of schemes on a system of anybody's FMUs.

    Each is linearised where it starts, by Model Exchange if it has that, else by pulses. Growth
    slower than 1e-4 of the rate of the slowest motion counts as none.

    Parameters
    ----------
    path : str or Path
        An SSP file. The code in it is run.
    schemes : sequence of str
        Names of the catalogue, with the system's components for vehicle and track, or how they
        begin.
    law : str or Path, optional
        A law between FMUs in the master, see `railcosim.master.law_file`.
    step : float, optional
        Of pulses, s; the file's step, or the default of the FMU, if not given.
    amplitude : float, optional
        Of pulses, in nominal values of the inputs.
    load : callable, optional
        Makes an FMU from a file and, by keyword, a name.
    progress : callable
        Told what is done and the total.

    Raises
    ------
    ArgumentError
        If no scheme is called so.
    FmuError, CouplingError, ComponentError
        If the file or the law is refused, or an FMU cannot be linearised.
    """
    with ExitStack() as stack:
        loaded = stack.enter_context(open_ssp(path, load=load))
        found_law, more = read_law(Path(law), loaded.components) if law else (None, ())
        connections = [c for c in (*loaded.connections, *more) if _is_real(loaded, c)]
        running = System(
            [*loaded.components, *([found_law] if found_law else [])],
            [*loaded.connections, *more],
        )
        initialise(running, loaded.fmus, loaded.start or 0.0)
        pulsed = Pulses(amplitude=amplitude, step=step or loaded.step or math.nan, steps=STEPS)
        models, ways = [], {}
        for k, (fmu, seen) in enumerate(zip(loaded.fmus, loaded.components, strict=True)):
            model, ways[fmu.name] = _linear(
                loaded, fmu, connections, pulsed,
                lambda a, b, k=k: progress(LINEARISING * (k + a / b) / len(loaded.fmus), 1.0),  # type: ignore[misc]
            )  # fmt: skip
            models.append(_seen(model, seen, loaded, connections))
        boxes = Boxes(models, loaded.components, connections, found_law)
    known = members(tuple(fmu.name for fmu in loaded.fmus))
    limits, refused = dict[str, Limit](), dict[str, str]()
    names = predictable(schemes, known)
    for k, name in enumerate(names):
        try:
            limits[name] = _coupling(boxes, known[name]).limit(boxes.longest)
        except (ValueError, *FAILURES) as error:
            refused[name] = str(error)
        progress(LINEARISING + (1 - LINEARISING) * (k + 1) / len(names), 1.0)
    return SystemStability(
        limits=limits, refused=refused, growth=boxes.exact, ways=ways, longest=boxes.longest
    )


def _coupling(boxes: Boxes, member: Member) -> Coupling:
    return Coupling(boxes, member.scheme)


def _is_real(loaded: LoadedSystem, c: Connection) -> bool:
    """Whether Real values pass; others jump, and are no part of a linear motion."""
    known = {(f.name, v.name): v.type for f in loaded.fmus for v in (*f.inputs, *f.outputs)}
    ends = (known.get((c.source, c.output)), known.get((c.target, c.input)))
    return all(kind in {None, Type.REAL} for kind in ends)


def _linear(
    loaded: LoadedSystem,
    fmu: LoadedFmu,
    connections: Sequence[Connection],
    pulses: Pulses,
    progress: Progress,
) -> tuple[StateSpace, str]:
    """A linear model of an FMU where it starts, of what is connected; and how it was had."""
    path = fmu.description.path
    if not math.isfinite(pulses.step):
        pulses = replace(pulses, step=fmu.description.default_step or 1e-3)
    fed = {c.input for c in connections if c.target == fmu.name}
    asked = {c.output for c in connections if c.source == fmu.name}
    inputs = [v.name for v in fmu.inputs if v.name in fed]
    heights = np.array([v.nominal for v in fmu.inputs if v.name in fed]) * pulses.amplitude
    way = best_way(path, replace(pulses, amplitude=heights))
    parameters = fmu.description.parameters
    start: Mapping[str, object] = loaded.starts[fmu.name]
    wanted = Wanted(
        inputs=inputs,
        outputs=[v.name for v in fmu.outputs if v.name in asked],
        at={v.name: u for v, u in zip(fmu.inputs, fmu.u.tolist(), strict=True) if v.name in fed},
        parameters={n: x for n, x in start.items() if n in parameters and not isinstance(x, str)},  # type: ignore[misc]
    )
    return state_space_of(way(path, fmu.name, wanted, progress)), way.description


def _seen(
    model: StateSpace, seen: Component, loaded: LoadedSystem, connections: Sequence[Connection]
) -> StateSpace:
    """With inputs in the units of what feeds them."""
    by = {
        c.input: loaded.maps.get(c, IDENTITY).factor for c in connections if c.target == seen.name
    }
    factor: FloatArray = np.array([by.get(v.name, 1.0) for v in model.inputs])
    known = {v.name: v for v in seen.inputs}
    return replace(
        model, B=model.B * factor, D=model.D * factor,
        inputs=tuple(known[v.name] for v in model.inputs),
    )  # fmt: skip
