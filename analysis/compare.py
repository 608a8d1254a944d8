"""Coupled FMUs against one monolithic system of the same vehicle and track."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from railcosim.analysis.pair.contact import Stiffness
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.response.frequency import Models, coupled, response
from railcosim.master.component import FloatArray
from railcosim.master.course import Course
from railcosim.master.linear.realisation import ComplexArray
from railcosim.mechanics.law import NormalLaw
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.reference.agreement import near, relative_rms
from railcosim.reference.monolithic import Monolithic, frequency_response
from railcosim.reference.newmark import newmark

Progress = Callable[[float, float], None]
REFINEMENT = (
    4  # Newmark's steps in a communication step: its error is then a hundredth of a per cent
)
FINE = 6000  # frequencies on which antiresonances are looked for
WEAK = 1e-3  # of the largest displacement (or force) at that frequency
# Excitation and output to errors and whether the response is not weak, by frequency.
Errors: TypeAlias = dict[str, dict[str, tuple[FloatArray, NDArray[np.bool_]]]]


def time_error(
    run: xr.Dataset,
    mono: Monolithic,
    positions: FloatArray,
    law: NormalLaw,
    journey: Journey,
    course: Course,
    progress: Progress,
) -> float:
    """RMS error of the contact forces of a coupled run, relative to that of their dynamic part.

    Parameters
    ----------
    run : Dataset
        Of the journey and the course, wheels held.
    mono : Monolithic
        The same vehicle and track in one.
    positions : array, shape (n_wheelsets,)
        Of the wheelsets, m.
    law : NormalLaw
        Of the contacts.
    journey, course : Journey, Course
        What was run.
    progress : callable
        Told what is done and the total.
    """
    forces = Layout(len(positions)).names(FORCE)
    ours = np.stack([run[name].values for name in forces], axis=1)
    reference = newmark_forces(mono, positions, law, journey, course, progress)
    return relative_rms(ours, reference, mono.load)


def newmark_forces(
    mono: Monolithic,
    positions: FloatArray,
    law: NormalLaw,
    journey: Journey,
    course: Course,
    progress: Progress,
) -> FloatArray:
    """Contact forces (n, n_contacts) of the monolithic system at the course's points."""
    heights = journey.profile.under(positions, journey.speed)
    steps = round(course.stop / course.step) * REFINEMENT
    forces = []
    march = newmark(mono, law, lambda t: positions, heights, course.step / REFINEMENT, steps)
    for k, instant in enumerate(march):
        if k % REFINEMENT == 0:
            forces.append(instant.force)
            progress(k, steps)
    return np.array(forces)


def frequency_errors(
    models: Models, mono: Monolithic, k_H: Stiffness, frequency: FloatArray, progress: Progress
) -> Errors:
    """Relative errors, NaN within 1 % of an antiresonance, and where the response is not weak."""
    fine = np.geomspace(frequency[0], frequency[-1], FINE)
    stiffness = np.resize(k_H, len(mono.load))
    rails, positions = mono.rails(models.positions), models.positions
    last = len(positions)
    on_wheelset = np.asarray(mono.wheels[[last - 1]].toarray().T)
    on_rails = np.asarray(rails[[last - 1, 2 * last - 1]].sum(axis=0))[:, None]
    solved = frequency_response(
        mono,
        2 * np.pi * frequency,
        stiffness,
        positions,
        np.hstack([on_wheelset, on_rails]),
        progress,
    )
    compression = (mono.wheels - rails).toarray()
    found: Errors = {}
    for column, what in enumerate(("force_z", "rail_force_z")):
        excitation = f"wheelset[{last}].{what}"
        system, dense = (coupled(models, 2 * np.pi * f, k_H) for f in (frequency, fine))
        ours, curve = (response(s, excitation, positions, 1.0) for s in (system, dense))
        direct = solved[:, :, column]
        references: dict[str, ComplexArray] = {
            output: direct[:, mono.coordinate(name)]
            for output, name in _observed(mono, last).items()
        }
        rail_z = direct @ rails.toarray().T
        force = stiffness * (direct @ compression.T)
        for i in sorted({1, last}):
            references[f"track.wheelset[{i}].left.rail_z"] = rail_z[:, i - 1]
            references[f"wheelset[{i}].left.force"] = force[:, i - 1]
        found[excitation] = {}
        for output, expected in references.items():
            row = system.rows([output])[0]
            error = np.abs(ours[:, row] / expected - 1)
            error[near(frequency, fine, curve[:, row])] = np.nan
            like = [r for name, r in references.items() if is_force(name) == is_force(output)]
            strong = np.abs(expected) > WEAK * np.abs(like).max(axis=0)
            found[excitation][output] = (error, strong)
    return found


def _observed(mono: Monolithic, last: int) -> dict[str, str]:
    """Outputs of the coupled FMUs, and the monolithic coordinates that are the same."""
    bodies = [c for c in mono.coordinates if c.endswith(".z") and not c.startswith("wheelset")]
    wheels = {f"vehicle.wheelset[{i}].left.wheel_z": f"wheelset[{i}].z" for i in (1, last)}
    return {**{f"vehicle.{name}": name for name in bodies}, **wheels}


def is_force(output: str) -> bool:
    """Whether an output is a contact force."""
    return output.endswith(".force")
