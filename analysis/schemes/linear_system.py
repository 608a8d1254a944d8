"""A system of anybody's FMUs as linear models of each, however had, where it starts."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.sparse import csc_array

from railcosim.analysis.pair.roles import is_of_a_pair
from railcosim.master.component import Component, ComponentError, FloatArray, Type
from railcosim.master.connections import Connection, CouplingError
from railcosim.master.fmi.archive import FmuError
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.law import Law
from railcosim.master.linear.linear_fmu import Pulses, Wanted, best_way
from railcosim.master.linear.linear_form import LinearForm
from railcosim.master.linear.linearise import LinearModel
from railcosim.master.linear.one_step import ALIKE, as_it_steps
from railcosim.master.linear.pulse_response import WHOLE_COLUMNS, PulseResponse
from railcosim.master.linear.realisation import Realisation, identify
from railcosim.master.linear.state_space import StateSpace
from railcosim.master.progress import Progress, unheard
from railcosim.master.ssp import LoadedSystem, initialise, open_ssp
from railcosim.master.system import System
from railcosim.master.units import IDENTITY

from .boxes import Boxes
from .catalogue import Member, members

STEPS = 2000
"""Of a record of pulses."""
LEFT = 1e-3
"""What poles may leave of a response, over its peak: noise of a solver, mostly."""


TURNED = 1e-3
"""Of a radian over a record: a motion that turns by less is not told from one that stands still."""


class DoubtWarning(UserWarning):
    """An FMU does not do what was predicted of it."""


@dataclass(frozen=True, kw_only=True)
class LinearSystem:
    """A system of FMUs, linear where it starts.

    Attributes
    ----------
    boxes : Boxes
        The FMUs whose outputs come back to them, coupled.
    ways : dict of str to str
        How each of them was linearised.
    doubts : dict of str to str
        Of those whose Co-Simulation does not step as their linear models move: by how much.
    duration : float or None
        Of the file's experiment, s; None if it does not say.
    """

    boxes: Boxes
    ways: dict[str, str]
    doubts: dict[str, str]
    duration: float | None

    @property
    def schemes(self) -> dict[str, Member]:
        """All schemes, by names with the FMUs' own for who steps first."""
        return members(tuple(self.ways))


def linear_system(
    path: str | Path,
    *,
    law: str | Path | None = None,
    step: float | None = None,
    amplitude: float = 1e-3,
    load: Callable[..., LoadedFmu] = FmuComponent.load,
    progress: Progress = unheard,
) -> LinearSystem:
    """Linearise the FMUs of a system where they start, by Model Exchange, else by pulses.

    What Model Exchange says is held against one step of the FMU's Co-Simulation, which runs.

    Parameters
    ----------
    path : str or Path
        An SSP file. The code in it is run.
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
    FmuError, CouplingError, ComponentError
        If the file or the law is refused, or an FMU cannot be linearised.

    Warns
    -----
    DoubtWarning
        If an FMU does not step as its linear model moves.
    """
    with open_ssp(path, load=load, law=law) as loaded:
        running = System(loaded.components, loaded.connections)
        initialise(running, loaded.fmus, loaded.start or 0.0)
        connections = _looped(_reals(loaded))
        if not connections:
            raise CouplingError(
                f"{path}: no value comes back to the FMU that it comes from, so no step is too "
                "long to be stable; give a law between its FMUs, or a file that connects them"
            )
        pulsed = Pulses(amplitude=amplitude, step=step or loaded.step or math.nan, steps=STEPS)
        within = {c.source for c in connections}
        both = [p for p in zip(loaded.fmus, loaded.components, strict=False) if p[0].name in within]
        had = {
            fmu.name: _linear(
                loaded, fmu, connections, pulsed,
                lambda a, b, k=k: progress(k + a / b, len(both)),  # type: ignore[misc]
            )
            for k, (fmu, _) in enumerate(both)
        }  # fmt: skip
        models = [_seen(had[fmu.name].model, seen, loaded, connections) for fmu, seen in both]
        law_there = next((c for c in loaded.components if isinstance(c, Law)), None)
        still = max(one.still for one in had.values())
        boxes = Boxes(models, [seen for _, seen in both], connections, law_there, still)
        doubts = {name: one.doubt for name, one in had.items() if one.doubt}
        stop = loaded.stop
        for name, doubt in doubts.items():
            warnings.warn(f"{name}: {doubt}", DoubtWarning, stacklevel=2)
        return LinearSystem(
            boxes=boxes, ways={name: one.way for name, one in had.items()}, doubts=doubts,
            duration=stop and stop - (loaded.start or 0.0)
        )  # fmt: skip


def _looped(connections: Iterable[Connection]) -> list[Connection]:
    """Connections by which something may come back; the rest is given, or only looked at."""
    kept = list(connections)
    while True:
        between = {c.source for c in kept} & {c.target for c in kept}
        fewer = [c for c in kept if c.source in between and c.target in between]
        if len(fewer) == len(kept):
            return kept
        kept = fewer


def _reals(loaded: LoadedSystem) -> list[Connection]:
    """Connections by which Real values pass; others jump, and are no part of a linear motion."""
    known = {(f.name, v.name): v.type for f in loaded.fmus for v in (*f.inputs, *f.outputs)}
    return [
        c
        for c in loaded.connections
        if {known.get((c.source, c.output)), known.get((c.target, c.input))} <= {None, Type.REAL}
    ]


def _by_poles(name: str, response: PulseResponse) -> Realisation:
    """A response by poles alone, if they leave little of it."""
    known, n = response.lasting, len(response.rest)
    if not n:
        return known
    h = response.step
    samples = known.after_pulse(h, h, n) + response.rest
    scale = np.abs(samples).max(axis=0)
    found = identify(samples, h, h, scale, columns=WHOLE_COLUMNS)
    left = np.abs(samples - found.after_pulse(h, h, n)).max(axis=0)
    if (left > LEFT * scale).any():
        raise FmuError(
            f"{name}: pulses show more motions than they tell apart, which leave "
            f"{(left / scale.clip(np.finfo(float).tiny)).max():.1g} of its response; take another "
            "step or tighter tolerances of its solver, or an FMU for Model Exchange"
        )
    return replace(found, direct=known.direct)


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
        known = _by_poles(form.name, response)
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


class _Had(NamedTuple):
    """A linear model of an FMU.

    Attributes
    ----------
    model : StateSpace
        Of what is connected.
    way : str
        How it was had.
    doubt : str
        What is to be said of steps that are not as it moves.
    still : float
        Rate (1/s) of motions that were not told from none.
    """

    model: StateSpace
    way: str
    doubt: str = ""
    still: float = 0.0


def _linear(
    loaded: LoadedSystem,
    fmu: LoadedFmu,
    connections: Sequence[Connection],
    pulses: Pulses,
    progress: Progress,
) -> _Had:
    """A linear model of an FMU where it starts, of what is connected."""
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
        at=_where(fmu),
        parameters={n: x for n, x in start.items() if n in parameters and not isinstance(x, str)},  # type: ignore[misc]
    )
    try:
        model = state_space_of(way(path, fmu.name, wanted, progress))
    except ComponentError as error:
        if not isinstance(way, Pulses):
            raise
        if is_of_a_pair(fmu.outputs):  # wheels that move along a track are no motion about rest
            told = (
                f"{fmu.name} is of a vehicle and a track; leave --system out, and give both by "
                "--vehicle-fmu and --track-fmu, those without the contact: stability and advise "
                "know such a pair where it rests, with the contact in either"
            )
        else:
            told = (
                f"pulses of {pulses.amplitude!r} of nominal values, {STEPS} steps of "
                f"{pulses.step:g} s; from Python amplitude=, step= of system_stability, "
                "advise_system"
            )
        raise ComponentError(f"{error} ({told})") from error
    if isinstance(way, Pulses):  # they are steps of its Co-Simulation
        return _Had(model, way.description, still=TURNED / (STEPS * pulses.step))
    return _as_it_steps(path, model, wanted, pulses.step, way.description)


def _where(fmu: LoadedFmu) -> dict[str, float]:
    """Real inputs as they are, also those that the file alone gives a value."""
    values = zip(fmu.inputs, fmu.u.tolist(), strict=True)
    return {v.name: u for v, u in values if v.type is Type.REAL}


def _as_it_steps(path: Path, model: StateSpace, wanted: Wanted, step: float, way: str) -> _Had:
    """A model by the rule of the FMU's steps, or what is to be said of steps that are not so."""
    try:
        found, apart, of = as_it_steps(path, model, wanted, step)
    except (FmuError, ComponentError) as error:
        doubt = f"whether it steps as its linear model moves could not be tried: {error}"
        return _Had(model, way, doubt)
    if found is not model:
        return _Had(found, f"{way}; one step of Euler's rule a communication step")
    if apart <= ALIKE:
        return _Had(model, way)
    doubt = (
        f"its Co-Simulation does not step as its linear model moves: {of} is off by {apart:.2g} of "
        "what it should answer (its solver makes few steps or has a loose tolerance, or it is not "
        "linear); limits and errors predicted may not hold, so try them: railcosim study --system"
    )
    return _Had(model, way, doubt)


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
