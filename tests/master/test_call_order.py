"""The order of calls that FMI 2.0 (4.2.4) asks for: no Get after Set without a step between.

The fixture in mode "strict" refuses it from the end of the initialisation on. Only an output that
depends at once on an input has to be read after it was set, or it would be of the past.
"""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.master.component import Variable
from railcosim.master.connections import Connection
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.schemes.aitken import aitken
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.iqn_ils import iqn_ils
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.nepce import nepce
from railcosim.master.schemes.picard import picard
from railcosim.master.signals import Signal
from railcosim.master.ssp import initialise
from railcosim.master.step_control import StepControl
from railcosim.master.system import System

from .anybody import make_fmu
from .test_types import STATES


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    able = f'{STATES} canInterpolateInputs="true"'
    path = tmp_path_factory.mktemp("strict") / "A.fmu"
    return make_fmu(path, "strict", variables="u x n", able=able)


SCHEMES = [
    *(jacobi(degree=degree) for degree in (0, 1, 2)),
    *(gauss_seidel(first=name, degree=1) for name in ("a", "b", "signal")),
    nepce(),
    picard(degree=1),
    aitken(degree=0),
    iqn_ils(degree=1),
]


@pytest.mark.parametrize(
    ("scheme", "controlled"), [*((s, False) for s in SCHEMES), (SCHEMES[1], True)], ids=str
)
@pytest.mark.filterwarnings("ignore::railcosim.master.cosimulation.FallbackWarning")
def test_no_get_after_set(fmu, scheme, controlled):
    with FmuComponent.load(fmu, name="a") as a, FmuComponent.load(fmu, name="b") as b:
        source = Signal("signal", [Variable(name="f")], np.atleast_1d)
        pairs = [("signal", "f", "a", "u"), ("a", "x", "b", "u")]
        system = System([source, a, b], [Connection(*pair) for pair in pairs])
        initialise(system, [a, b], 0.0)
        step = StepControl(order=scheme.order, largest=0.25, smallest=1e-5) if controlled else 0.25
        points = list(cosimulate(system, scheme, step, 1.0))
    assert points[-1].time == 1.0
    x = dict(zip(system.names, points[-1].outputs, strict=True))["a.x"]
    assert x == pytest.approx(0.5, abs=0.13)  # of t^2 / 2 by Euler's rule in four steps, 0.125
