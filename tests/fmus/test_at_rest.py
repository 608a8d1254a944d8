"""Where vehicle and track are at rest together, held against their own accelerations."""

from pathlib import Path

import numpy as np
import pytest

from railcosim.fmus.at_rest import heights_at_rest
from railcosim.fmus.content import contents
from railcosim.fmus.python_runtime.models import Model
from railcosim.fmus.roles import Role
from railcosim.mechanics.ports import FORCE, WHEEL, Z
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.parameters import Vehicle

# Three wheelsets hold a bogie of it, so the track decides their loads.
LOCOMOTIVE = read_stock(Path(__file__).parents[2] / "examples" / "locomotive.toml")


def started(content, given):
    """Outputs in initialisation, by name."""
    model = Model(content.body, [v.slot for v in content.table])
    model.configure({(v.role, v.index): float(given.get(v.name, v.start or 0))
                     for v in content.table if v.causality == "parameter"})  # fmt: skip
    u = np.array([given.get(v.name, v.start) for v in content.table if v.causality == "input"])
    names = [v.name for v in content.table if v.causality == "output"]
    y = np.empty(len(names))
    now = model.read(u)
    model.write(model.rest(now), now, 0.0, y)
    return dict(zip(names, y.tolist(), strict=True))


@pytest.mark.filterwarnings("ignore:a ring of")  # as coarse as it can be
@pytest.mark.parametrize(
    ("stock", "dimension"),
    [
        (Vehicle(), "vertical"),
        (LOCOMOTIVE, "vertical"),
        pytest.param(Vehicle(), "spatial", marks=pytest.mark.slow),  # 2 s of a track's reduction
    ],
    ids=["paper", "locomotive", "in space"],
)
def test_nothing_is_accelerated(stock, dimension):
    """Wheels that roll spread the rails, and press them as their cones lean."""
    track = Track(mesh=Mesh(cells=6, elements_per_bay=2, highest_slab_frequency=200,
                            highest_frequency=400))  # fmt: skip
    made = {content.name: content for content in contents(stock, track, dimension=dimension)}
    vehicle, rails = made["Vehicle"], made["TrackWithContact"]
    (heights,) = heights_at_rest([vehicle], rails)
    layout = vehicle.body.layout
    z = {port.name(WHEEL.motion): heights[f"wheelset[{port.wheelset}].start_z"]
         for port in layout.down.ports}  # fmt: skip
    force = {name: x for name, x in started(rails, z).items() if name in layout.names(FORCE)}
    outputs = started(vehicle, {**heights, **force})
    shown = [v.name for v in vehicle.table if v.role is Role.OUT_ACCELERATION]
    # Of 100 m/s2 for a wheel without its load; heights are found to 1e-13.
    assert max(abs(outputs[name]) for name in shown) < 1e-9
    down = [port.direction is Z for port in layout.ports]
    loads, static = (
        np.array([force[n] for n in layout.names(FORCE)])[down],
        vehicle.body.preload[down],
    )
    assert loads.sum() == pytest.approx(static.sum(), rel=1e-12)
    changed = np.abs(loads - static).max() / loads.max()
    assert (changed > 1e-4) == (stock is LOCOMOTIVE), changed
