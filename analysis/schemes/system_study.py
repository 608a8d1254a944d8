"""A study of any system of FMUs: what each process makes of its file."""

from __future__ import annotations

import hashlib
import itertools
import math
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from railcosim.analysis.pair.owner import Owner
from railcosim.master.component import FloatArray, Type
from railcosim.master.cosimulation import FallbackWarning, cosimulate
from railcosim.master.course import count_steps
from railcosim.master.fmi.archive import FmuError
from railcosim.master.linear.state_space import IndexArray
from railcosim.master.pace import FixedStep
from railcosim.master.progress import Progress, unheard
from railcosim.master.schemes import Scheme
from railcosim.master.ssp import LoadedSystem, initialise, open_ssp
from railcosim.master.system import System
from railcosim.storage.temporary import scratch

from .catalogue import Member, members
from .extrapolated import PARTS, Sampled, extrapolated
from .study import matching
from .study_point import ContactCase, Measurement, Point, watched

AS_WIRED = ContactCase(label="as wired", parameters={})
"""What stands for the contact in the table of a system."""
FMUS = "FMUs"
"""And for its owner, where the master owns none."""
LEADING = ("jacobi-linear", "gauss-seidel-linear")
"""Schemes of the reference: which FMU is given what, and when, differs."""


@dataclass(frozen=True, kw_only=True)
class SystemStudied:
    """A system in a file, to be run by several schemes; a `Subject`.

    Attributes
    ----------
    content : bytes
        Of the SSP file.
    law : bytes or None
        Of the law's file.
    duration : float
        Of each run, s.
    finest : float
        The shortest step that is compared, s.
    """

    content: bytes
    law: bytes | None
    duration: float
    finest: float
    compared = "what is exchanged"
    held_to = "runs of one scheme or two, extrapolated"

    def reference(self, contact: ContactCase, progress: Progress = unheard) -> Sampled:
        """What the system does by itself; see `extrapolated`."""
        interval = self.finest / PARTS[0]
        count = math.ceil(self.duration / interval - 1e-9)
        with self._opened(count * interval) as (loaded, system):
            columns, start = exchanged(system, loaded), loaded.start or 0.0
            known = members(tuple(fmu.name for fmu in loaded.fmus))
        leading = [next(m.scheme for n, m in known.items() if n.startswith(s)) for s in LEADING]
        total, done = len(leading) * sum(PARTS) * count // PARTS[0], 0

        def run(scheme: Scheme, part: int) -> FloatArray:
            nonlocal done
            every, rows = part // PARTS[0], []
            with self._opened(count * interval) as (_, system):
                points = cosimulate(
                    system, scheme, interval / every, start + count * interval, start
                )
                for k, point in enumerate(points):
                    if k % every == 0:
                        rows.append(point.outputs.copy())
                        done += every
                        progress(min(done, total), total)
            return np.array(rows[: count + 1])

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FallbackWarning)
            return extrapolated(run, leading, columns, start, interval)

    def measure(self, point: Point, held: Sampled, progress: Progress = unheard) -> Measurement:
        """Make one run, and hold it against the reference."""
        with self._opened(self.duration, point.step) as (loaded, system):
            start = loaded.start or 0.0
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FallbackWarning)  # kept in the result
                run = cosimulate(system, point.scheme, point.step, start + self.duration, start)
            return watched(run, held.of, held, progress)

    @contextmanager
    def _opened(
        self, duration: float, step: float | None = None
    ) -> Iterator[tuple[LoadedSystem, System]]:
        """The system, initialised."""
        with TemporaryDirectory(dir=scratch()) as folder:
            path, law = Path(folder, "system.ssp"), Path(folder, "law.toml")
            path.write_bytes(self.content)
            if self.law is not None:
                law.write_bytes(self.law)
            with (
                warnings.catch_warnings(),
                open_ssp(path, law=None if self.law is None else law) as loaded,
            ):
                warnings.simplefilter("ignore")  # said when the study was begun
                system, start = System(loaded.components, loaded.connections), loaded.start or 0.0
                stop = start + duration
                told = stop if step is None else FixedStep(step).reach(start, stop)
                initialise(system, loaded.fmus, start, told)
                yield loaded, system


def exchanged(system: System, loaded: LoadedSystem) -> IndexArray:
    """Which outputs are Real and feed somebody."""
    sources = {f"{c.source}.{c.output}" for c in system.connections}
    chosen = [
        k
        for k, (name, v) in enumerate(zip(system.names, system.variables, strict=True))
        if name in sources and v.type is Type.REAL
    ]
    return np.array(chosen, dtype=np.intp)


@dataclass(frozen=True, kw_only=True)
class Planned:
    """What a study of a system will run.

    Attributes
    ----------
    subject : SystemStudied
        To be run.
    points : list of Point
        The runs, the longest steps first.
    refused : dict of str to str
        Schemes that the system does not allow, and why.
    settings : dict
        What all points have in common.
    """

    subject: SystemStudied
    points: list[Point]
    refused: dict[str, str]
    settings: dict[str, Any]


def planned(
    path: Path, law: Path | None, schemes: Sequence[str], steps: Sequence[float], time: float | None
) -> Planned:
    """Look at a system, and at what of the schemes it allows.

    Raises
    ------
    ArgumentError, FmuError, CouplingError, TooLargeError
        If a name, the file, the law, a step or the time is wrong.
    """
    with open_ssp(path, law=law) as loaded:
        system = System(loaded.components, loaded.connections)
        initialise(system, loaded.fmus, loaded.start or 0.0)
        known = members(tuple(fmu.name for fmu in loaded.fmus))
        chosen, refused = dict[str, Member](), dict[str, str]()
        for name, member in matching(schemes, known).items():
            try:
                member.scheme.start(system)
                chosen[name] = member
            except ValueError as error:
                refused[name] = str(error)
        duration = time or (loaded.stop and loaded.stop - (loaded.start or 0.0))
        given = list(steps) or (
            [loaded.step, loaded.step / 2, loaded.step / 4] if loaded.step else []
        )
    if not duration:
        raise FmuError(f"{path}: does not say when to stop; give --time")
    if not given:
        raise FmuError(f"{path}: does not say a communication step (SSP cannot); give --steps")
    for step in given:
        count_steps(0.0, duration, step)
    subject = SystemStudied(
        content=path.read_bytes(), law=None if law is None else law.read_bytes(),
        duration=duration, finest=min(given),
    )  # fmt: skip
    points = [
        Point(
            name=name, scheme=member.scheme, owner=FMUS if law is None else Owner.MASTER,
            contact=AS_WIRED, step=step,
        )
        for step, (name, member) in itertools.product(
            sorted(given, reverse=True), chosen.items()
        )
    ]  # fmt: skip
    digests = {"system": subject.content, **({} if subject.law is None else {"law": subject.law})}
    settings = {
        "railcosim": version("railcosim"),
        "time": duration,
        **{n: f"sha256 {hashlib.sha256(c).hexdigest()[:16]}" for n, c in digests.items()},
    }
    return Planned(subject=subject, points=points, refused=refused, settings=settings)
