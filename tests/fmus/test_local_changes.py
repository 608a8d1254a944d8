"""FMUs of a track with a hanging fastening: the compiled runtime against the model it carries."""

import numpy as np
import pytest

from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.fmus.content import contents
from railcosim.fmus.export import packed
from railcosim.master.component import Hold
from railcosim.master.course import Course
from railcosim.master.fmi.archive import read_annotations
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.mechanics.motion import FromOutside, Inputs, Mover
from railcosim.track.irregularity import flat
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Mesh, Track
from railcosim.vehicle.parameters import Vehicle

HANGING = [LocalChange(what="fastening", x=20.3125, value=0.0)]  # 1.8 m ahead of the vehicle
TRACK = Track(
    mesh=Mesh(cells=6, elements_per_bay=4, highest_slab_frequency=500, highest_frequency=1500)
)


# Modes of two rings, four FMUs packed: 5 s.
@pytest.mark.slow
def test_the_compiled_track_is_its_model(tmp_path):
    made = {one.name: one for one in contents(Vehicle(), TRACK, changes=HANGING)}
    assert "with fastening@20.3125=0" in made["Track"].text
    with packed(made.values(), tmp_path) as files:
        _moves_as(files["Track"], made["Track"].body)
        told = read_annotations(files["TrackWithContact"], "railcosim")
        assert told["Ring"]["changes"] == "fastening@20.3125=0"
        forces = _felt(files)
    # The first wheel comes over it after 1.8 m at 60 m/s, 300 steps: the second is 2.5 m behind.
    swings = np.abs(forces / forces[0] - 1)
    assert swings[250:400, 0].max() > 2 * swings[160:230, 0].max()
    assert swings[250:400, 0].max() > 2 * swings[250:400, 2:].max()


def _felt(files):
    """Contact forces of the left wheels, at 60 m/s on a track that is level."""
    run, stopped = run_pair(
        files["Vehicle"], files["TrackWithContact"], {"contact.nonlinear": True},
        Journey(speed=60.0, held=False, profile=flat()),
        Course(scheme=gauss_seidel(first="vehicle"), step=1e-4, stop=0.06),
        lambda done, total: None,
    )  # fmt: skip
    assert stopped is None
    return np.stack([run[f"wheelset[{i}].left.force_z"].values for i in (1, 2, 3, 4)], axis=1)


def _moves_as(path, body):
    """The rail under wheels that roll over the place, under forces from outside."""
    mover, h = Mover(body, FromOutside(), 1e-4), 1e-4
    with FmuComponent.load(path) as fmu:
        fmu.enter_initialization(0.0)
        names = [v.name for v in fmu.inputs]
        place = np.array([k for k, n in enumerate(names) if n.endswith("position")])
        load = np.array([k for k, n in enumerate(names) if n.endswith("force_z")])
        u = np.array([v.start for v in fmu.inputs])
        u[place] += 1.6
        u[load] *= np.linspace(0.5, 1.5, load.size)
        fmu.set_inputs(u)
        fmu.exit_initialization()
        state = body.at(u[place]).rest(u[load])
        out = [k for k, v in enumerate(fmu.outputs) if v.name.endswith("rail_z")]
        fmu.set_hold(Hold.INTERPOLATE)
        for k in range(40):
            begin = u.copy()
            u[place] += 60.0 * h
            u[load] *= 1 + 1e-3 * np.sin(k)
            fmu.set_inputs(u)
            fmu.do_step(k * h, h)
            state = mover.step(
                state, Inputs(begin[place], begin[load]), Inputs(u[place], u[load]), h
            )
            expected = body.at(u[place]).motion(state)
            assert fmu.get_outputs()[out] == pytest.approx(expected, rel=1e-8)
