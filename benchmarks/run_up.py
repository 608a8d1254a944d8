"""A vehicle that is run up slowly through its critical speed and braked, on rigid rails.

    python benchmarks/run_up.py [PICTURE]

Manchester vehicle 1, whose own contacts creep at the speed of the moment (`VehicleWithContact`),
on rails out of line by a few hundredths of a millimetre. Beside it what `limit-cycle` finds at speeds
that do not change. Two minutes of a processor.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from railcosim.analysis.response.limit_cycle import limit_cycles
from railcosim.fmus.content import contents
from railcosim.fmus.export import BARE
from railcosim.master.component import Hold
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.mechanics.ports import Layout
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.running import running

FloatArray = NDArray[np.float64]

LOWEST, HIGHEST = 270.0, 345.0  # km/h
FASTER = 1.0  # km/h in a second
STEP, INTERNAL = 2e-3, 5e-4  # s
ROUGH = 2e-5  # m, standard deviation
"""Of the rails' line: what hunting grows from."""
WINDOW = 0.5  # s: of hunting, a period and more
LARGE = 2e-3  # m: it hunts


def vehicle(folder: Path) -> Path:
    """The FMU."""
    made = contents(
        read_stock(Path("manchester")),
        Track(mesh=Mesh(cells=6, elements_per_bay=2, highest_frequency=300)),
        dimension="spatial",
    )
    (one,) = [content for content in made if content.name == "VehicleWithContact"]
    target = folder / "VehicleWithContact.fmu"
    BARE.pack(one, target, lambda text: None)
    return target


def run(path: Path, times: FloatArray, speeds: FloatArray) -> FloatArray:
    """How far the first wheelset goes aside, m."""
    rng, layout = np.random.default_rng(1), Layout(4)
    line = gaussian_filter1d(rng.standard_normal(times.size), 0.02 / STEP)  # smooth over 20 ms
    line *= ROUGH / line.std()
    at_rest = running(read_stock(Path("manchester")))
    depth = at_rest.rest[: at_rest.size][at_rest.body.wheelsets]
    with FmuComponent.load(path) as fmu:
        names = [v.name for v in fmu.inputs]
        fast = names.index("speed")
        rough = np.array([name.endswith("irregularity_y") for name in names])
        at = [v.name for v in fmu.outputs].index("wheelset[1].left.wheel_y")
        starts = zip(layout.of_axles("start_z"), depth.tolist(), strict=True)
        fmu.set_parameters({"internal_step": INTERNAL, **dict(starts)})
        fmu.enter_initialization(0.0)
        found, u = np.zeros(times.size), np.zeros(len(names))
        for k, t in enumerate(times):
            u[rough], u[fast] = line[k], speeds[k] / 3.6
            fmu.set_inputs(u)
            if k:
                fmu.do_step(times[k - 1], t - times[k - 1])
            else:
                fmu.exit_initialization()
                fmu.set_hold(Hold.INTERPOLATE)
            found[k] = fmu.get_outputs()[at]
    return found


def main() -> None:
    """Run, compare, draw."""
    half = (HIGHEST - LOWEST) / FASTER
    times = np.arange(0.0, 2 * half + STEP / 2, STEP)
    speeds = HIGHEST - FASTER * np.abs(times - half)
    with tempfile.TemporaryDirectory() as folder:
        aside = run(vehicle(Path(folder)), times, speeds)
    size = maximum_filter1d(np.abs(aside), round(WINDOW / STEP))
    ways = {"up": times <= half, "down": times > half}
    begins = speeds[ways["up"]][np.argmax(size[ways["up"]] > LARGE)]
    ends = speeds[ways["down"]][np.argmax(size[ways["down"]] < LARGE)]
    known = limit_cycles(read_stock(Path("manchester")), np.arange(LOWEST, HIGHEST, 7.5) / 3.6)
    print(f"linear critical speed {3.6 * known.attrs['linear critical speed']:.1f} km/h")
    print(f"run up it hunts from {begins:.1f} km/h, braked down to {ends:.1f} km/h")
    print(known)
    if len(sys.argv) > 1:
        np.savez(sys.argv[1], speeds=speeds, size=size, up=ways["up"])
        known.to_netcdf(sys.argv[1] + ".nc")


if __name__ == "__main__":
    main()
