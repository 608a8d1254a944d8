"""Native FMUs beside Python ones, in one run: cost of a step, real time, export, size.

OPENBLAS_NUM_THREADS=1 python benchmarks/runtimes.py
"""

from __future__ import annotations

import ctypes
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table

from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.fmus.export import NativeRuntime, PythonRuntime, Runtime, export
from railcosim.master.component import Hold
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.recording import Recorder
from railcosim.master.schemes.jacobi import jacobi
from railcosim.track.irregularity import synthesise
from railcosim.track.parameters import Track
from railcosim.vehicle.parameters import Vehicle

SPEED, STEP = 250 / 3.6, 1e-4  # m/s, s
BLOCKS, STEPS = 25, 200  # the least of many short blocks: other work on the machine only adds
RUNTIMES: dict[str, Runtime] = {
    "native, FMI 2": NativeRuntime(),
    "python": PythonRuntime(),
}
Rows = dict[str, dict[str, float]]  # what, then by runtime


def least(block: list[float]) -> float:
    """Microseconds a step."""
    return 1e6 * min(block[1:]) / STEPS


def track_step(path: Path) -> float:
    """A step of Track.fmu by its C functions: 8 wheels roll, each with a force of its own."""
    with FmuComponent.load(path) as fmu:
        fmu.enter_initialization(0.0)
        fmu.exit_initialization()
        fmu.set_hold(Hold.EXTRAPOLATE)
        u = np.array([v.start for v in fmu.inputs])
        rolls = np.array([v.name.endswith("position") for v in fmu.inputs])
        force = u * ~rolls * (1 + 0.1 * np.random.default_rng(1).normal(size=u.size))
        y = np.empty(len(fmu.outputs))
        calls = _Calls(fmu, u, y)
        times, place = [], u * rolls
        for block in range(BLOCKS):
            begun = perf_counter()
            for k in range(block * STEPS, (block + 1) * STEPS):
                u[:] = place + SPEED * STEP * k * rolls + force
                calls.step(STEP * k)
            times.append(perf_counter() - begun)
        if not np.isfinite(y).all():
            raise ArithmeticError("the track gave no numbers")
    return least(times)


class _Calls:
    """fmi2SetReal, fmi2DoStep and fmi2GetReal without anything between."""

    def __init__(self, fmu: FmuComponent, u: np.ndarray, y: np.ndarray) -> None:
        calls = fmu._calls  # below the adapter, whose cost is not asked for
        self.instance = ctypes.c_void_p(calls._component)
        names = ("SetReal", "DoStep", "GetReal")
        self.functions = [calls._library.bare(f"fmi2{name}") for name in names]
        self.functions[1].argtypes = [
            ctypes.c_void_p,
            ctypes.c_double,
            ctypes.c_double,
            ctypes.c_int,
        ]
        self.arguments = [
            ((ctypes.c_uint * len(refs))(*refs), ctypes.c_size_t(len(refs)),
             values.ctypes.data_as(ctypes.c_void_p))
            for refs, values in (
                (fmu.description.passed_in[0].references, u),
                (fmu.description.passed_out[0].references, y),
            )
        ]  # fmt: skip

    def step(self, time: float) -> None:
        """Set all inputs, step, get all outputs."""
        set_real, do_step, get_real = self.functions
        if (
            set_real(self.instance, *self.arguments[0])
            or do_step(self.instance, time, STEP, 0)
            or get_real(self.instance, *self.arguments[1])
        ):
            raise RuntimeError("the FMU refused a step")


def pair_step(folder: Path) -> float:
    """A step of Vehicle and TrackWithContact under the master, recorded; wheels roll."""
    profile = synthesise("german-low", SPEED * STEP * STEPS * BLOCKS)
    journey = Journey(speed=SPEED, held=False, profile=profile)
    files = (folder / "Vehicle.fmu", folder / "TrackWithContact.fmu")
    with open_pair(*files, {"contact.nonlinear": True}, journey) as pair:
        recorder = Recorder(pair.system)
        points = cosimulate(pair.system, jacobi(degree=1), STEP, STEP * STEPS * BLOCKS)
        times = []
        for _ in range(BLOCKS):
            begun = perf_counter()
            for _ in range(STEPS):
                recorder.add(next(points))
            times.append(perf_counter() - begun)
    return least(times)


def main() -> None:
    """Print the table."""
    rows: Rows = {}
    with TemporaryDirectory(prefix="railcosim_") as name:
        for runtime_name, runtime in RUNTIMES.items():
            folder = Path(name) / runtime_name.split(",")[0]
            begun = perf_counter()
            files = export(Vehicle(), Track(), folder, runtime=runtime)
            seconds = perf_counter() - begun
            found = {
                "export of four FMUs, s": seconds,
                "size of Track.fmu, MB": files["Track"].stat().st_size / 1e6,
                "step of Track.fmu, 0.1 ms, 8 rolling wheels, µs": track_step(files["Track"]),
                "step of the pair under the master, 0.1 ms, µs": pair_step(folder),
            }
            found["  of the time simulated"] = 1e-6 * found[list(found)[-1]] / STEP
            for what, value in found.items():
                rows.setdefault(what, {})[runtime_name] = value
    table = Table("what", *RUNTIMES, "ratio", title="Runtimes; the least of 25 blocks of 200 steps")
    for what, by_runtime in rows.items():
        native, python = by_runtime.values()
        table.add_row(what, f"{native:.3g}", f"{python:.3g}", f"{python / native:.2g}")
    Console().print(table)


if __name__ == "__main__":
    main()
