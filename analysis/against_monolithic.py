"""Coupled FMUs against one monolithic system of the same vehicle and track."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from railcosim.master.component import FloatArray
from railcosim.master.course import Course
from railcosim.master.linear.realisation import ComplexArray
from railcosim.mechanics.law import LinearContact
from railcosim.reference.agreement import near, relative_rms
from railcosim.reference.monolithic import Monolithic, frequency_response
from railcosim.reference.newmark import newmark

from .frequency import Models, coupled, response
from .pair import FORCES, Journey

Progress = Callable[[float, float], None]
REFINEMENT = (
    4  # Newmark's steps in a communication step: its error is then a hundredth of a per cent
)
FINE = 6000  # frequencies on which antiresonances are looked for
WEAK = 1e-3  # of the largest displacement (or force) at that frequency
# Excitation and output to errors and whether the response is not weak, by frequency.
Errors: TypeAlias = dict[str, dict[str, tuple[FloatArray, NDArray[np.bool_]]]]
OBSERVED = {  # outputs of the coupled FMUs, and their rows among the monolithic unknowns
    "vehicle.carbody.z": "carbody.z",
    "vehicle.bogie[1].z": "bogie[1].z",
    "vehicle.bogie[2].z": "bogie[2].z",
    "vehicle.wheelset[1].left.wheel_z": "wheelset[1].z",
    "vehicle.wheelset[4].left.wheel_z": "wheelset[4].z",
}


def time_error(
    run: xr.Dataset,
    still: float,
    mono: Monolithic,
    positions: FloatArray,
    k_H: float,
    journey: Journey,
    course: Course,
    progress: Progress,
) -> float:
    """RMS error of the contact forces of a coupled run, relative to that of their dynamic part.

    Parameters
    ----------
    run : Dataset
        Of the journey and the course, wheels held.
    still : float
        Force of a contact at rest, N.
    mono : Monolithic
        The same vehicle and track in one.
    positions : array, shape (4,)
        Of the wheelsets, m.
    k_H : float
        Contact stiffness, N/m.
    journey, course : Journey, Course
        What was run.
    progress : callable
        Told what is done and the total.
    """
    ours = np.stack([run[name].values for name in FORCES], axis=1)
    reference = newmark_forces(mono, positions, k_H, journey, course, progress)
    return relative_rms(ours, reference, np.full(len(FORCES), still))


def newmark_forces(
    mono: Monolithic,
    positions: FloatArray,
    k_H: float,
    journey: Journey,
    course: Course,
    progress: Progress,
) -> FloatArray:
    """Contact forces (n, 8) of the monolithic system at the course's communication points."""
    heights = journey.profile.under(positions, journey.speed)
    steps = round(course.stop / course.step) * REFINEMENT
    forces = []
    march = newmark(
        mono, LinearContact(k_H=k_H), lambda t: positions, heights, course.step / REFINEMENT, steps
    )
    for k, instant in enumerate(march):
        if k % REFINEMENT == 0:
            forces.append(instant.force)
            progress(k, steps)
    return np.array(forces)


def frequency_errors(
    models: Models, mono: Monolithic, k_H: float, frequency: FloatArray, progress: Progress
) -> Errors:
    """Relative errors, NaN within 1 % of an antiresonance, and where the response is not weak."""
    fine = np.geomspace(frequency[0], frequency[-1], FINE)
    rails, positions = mono.rails(models.positions), models.positions
    on_wheelset = np.asarray(mono.wheels[[3]].toarray().T)
    on_rails = np.asarray(rails[[3, 7]].sum(axis=0))[:, None]
    solved = frequency_response(
        mono, 2 * np.pi * frequency, k_H, positions, np.hstack([on_wheelset, on_rails]), progress
    )
    compression = (mono.wheels - rails).toarray()
    found: Errors = {}
    for column, excitation in enumerate(("wheelset[4].force_z", "wheelset[4].rail_force_z")):
        system, dense = (coupled(models, 2 * np.pi * f, k_H) for f in (frequency, fine))
        ours, curve = (response(s, excitation, positions, 1.0) for s in (system, dense))
        direct = solved[:, :, column]
        references: dict[str, ComplexArray] = {
            output: direct[:, mono.coordinate(name)] for output, name in OBSERVED.items()
        }
        rail_z = direct @ rails.toarray().T
        force = k_H * direct @ compression.T
        for i in (1, 4):
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


def is_force(output: str) -> bool:
    """Whether an output is a contact force."""
    return output.endswith(".force")
