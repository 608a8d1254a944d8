"""Contact forces of the monolithic system in time."""

from __future__ import annotations

import numpy as np

from railcosim.analysis.pair.pair import Journey
from railcosim.master.component import FloatArray
from railcosim.master.course import Course
from railcosim.master.progress import Progress
from railcosim.reference.contacts import Contacts
from railcosim.reference.monolithic import Monolithic
from railcosim.reference.newmark import newmark
from railcosim.track.irregularity.met import Wheels
from railcosim.track.travel import Steady

REFINEMENT = (
    4  # Newmark's steps in a communication step: its error is then a hundredth of a per cent
)


def newmark_forces(
    mono: Monolithic,
    positions: FloatArray,
    contacts: Contacts,
    journey: Journey,
    course: Course,
    progress: Progress,
) -> FloatArray:
    """Forces on rails (n, n_ports) of the monolithic system at the course's points."""
    radii = np.array([wheel.radius for wheel in mono.body.wheels])
    heights = journey.under(Wheels(positions, radii), contacts.rough)
    way = Steady(0.0) if journey.held else journey.way
    steps, step = round(course.stop / course.step) * REFINEMENT, course.step / REFINEMENT
    forces = []
    march = newmark(mono, contacts, lambda t: positions + way.gone(t), heights, step, steps)
    for k, instant in enumerate(march):
        if k % REFINEMENT == 0:
            forces.append(instant.force)
            progress(k, steps)
    return np.array(forces)
