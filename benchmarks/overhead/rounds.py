"""What all runners share: they step when they are told to, and say how long it took."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

_answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)  # what libraries print goes where errors go


def job() -> dict[str, Any]:
    """What to couple: see `Job` in overhead.py."""
    given: dict[str, Any] = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    return given


def connections(given: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """Source, output, target, input: each FMU's first outputs feed the other one's inputs."""
    return [
        (source, f"y[{i}]", target, f"u[{i}]")
        for source, target in ("ab", "ba")
        for i in range(given["inputs"])
    ]


def serve(version: str, step: Callable[[int], object]) -> None:
    """Take as many steps as each line of the standard input says; answer with seconds."""
    print(version, file=_answers, flush=True)
    for line in sys.stdin:
        steps = int(line)
        begun = perf_counter()
        step(steps)
        print(perf_counter() - begun, file=_answers, flush=True)


def initialised(path: str) -> list[Any]:
    """Two instances of an FMU by FMPy, ready to be stepped."""
    import fmpy  # noqa: PLC0415  (not in every environment)
    from fmpy.fmi2 import FMU2Slave  # noqa: PLC0415

    description, folder = fmpy.read_model_description(path), fmpy.extract(path)
    fmus = [
        FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        for name in "ab"
    ]
    for fmu in fmus:
        fmu.instantiate()
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
    return fmus
