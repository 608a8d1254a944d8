"""Every importer gives what its documented scheme gives with our own master.

All of them hold inputs constant over a step, and none but OMSimulator asks which output needs
which input: an output with direct feedthrough is passed on as it was for the inputs of the step
before. So the force of the track is older than with our own master, which asks. What else differs
is said in each test, with the place where it is documented, for each at the version that
`conftest.py` or docs/importers.md names.

Every answer is also held against the schemes that its importer does not implement: it agrees with
one to rounding, and with no other to a ten-thousandth.
"""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi

from .documented import SCHEMES, Documented, difference, driven
from .job import make_drive

pytestmark = pytest.mark.importers

# The FMUs are the same and so is the arithmetic, but for the communication points' times, which
# importers add up differently: 1e-15 in a position, and what the coupling makes of it. Measured:
# at most 6e-12, of the car body, which moves 1e-7 m.
AGREES = 1e-9
# Another scheme is another error of first order in the step; measured: 9e-3 and more.
DIFFERS = 1e-4


EXPECTED = {}  # rows of all schemes, by job and what is known of an importer


def held_against_every_scheme(told, job, name, **known):
    """The answer is that of the named scheme, and of no other, nor that one a step late."""
    found = np.array(told["rows"])
    if (key := repr((job, known))) not in EXPECTED:
        EXPECTED[key] = {
            other: Documented(**scheme, **known).rows(job) for other, scheme in SCHEMES.items()
        }
    expected = EXPECTED[key]
    differences = {other: difference(found, rows) for other, rows in expected.items()}
    differences["a step late"] = difference(found[1:], expected[name][:-1])
    assert differences.pop(name) < AGREES
    assert min(differences.values()) > DIFFERS, differences


@pytest.fixture(params=[2, 3], ids=["fmi2", "fmi3"])
def given(request, job, exported3):
    """The job with FMUs of both versions; what is expected does not depend on it."""
    if request.param == 2:
        return job
    files = {"vehicle": exported3["Vehicle"], "track": exported3["TrackWithContact"]}
    return replace(job, fmus={name: str(path) for name, path in files.items()})


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("importer", ["fmpy", "fmusim"])
def test_one_alone(run, exported, exported3, importer, fmi):
    """One FMU driven by signals: inputs at the beginning of a step, held.

    fmpy/simulation.py, `simulateCS`: inputs are set and the FMU is stepped; results are recorded
    before the next inputs are set. FMPy couples FMUs in SSP only, see `test_ssp_in_fmpy`.
    fmusim/FMI2CSSimulation.c, `FMI2CSSimulate`, and that of FMI 3: the same; it couples none.
    """
    drive = make_drive(exported["Track"])
    told = run(importer, replace(drive, fmu=str({2: exported, 3: exported3}[fmi]["Track"])))
    found = np.array(told["rows"])
    held, ahead = jacobi(degree=0), gauss_seidel(first="fmu", degree=0)
    assert difference(found, driven(drive, held, feedthrough=False)) < AGREES
    assert difference(found, driven(drive, held, feedthrough=True)) > DIFFERS
    assert difference(found, driven(drive, ahead, feedthrough=False)) > DIFFERS


def test_libcosimpy(run, job):
    """Jacobi; in initialisation values are exchanged as often as there are FMUs.

    libcosim, src/cosim/algorithm/fixed_step_algorithm.cpp: `initialize`, `do_step`,
    `calculate_and_transfer`; src/cosim/slave_simulator.cpp: inputs are set, the FMU is stepped,
    outputs are got. Times are whole nanoseconds. It crashes on FMI 3.
    """
    told = run("libcosimpy", job)
    held_against_every_scheme(told, job, "Jacobi", exchanges=2)


def test_ecospy(run, job, given):
    """Jacobi as libcosim's; what is shown is read again after the exchange.

    ecos, src/ecos/simulation.cpp: `init` and `step` of `simulation::Impl`;
    src/ecos/algorithm/fixed_step_algorithm.cpp: `step`.
    """
    told = run("ecospy", given)
    held_against_every_scheme(told, job, "Jacobi", exchanges=2, refreshed=True)


@pytest.mark.parametrize("method", ["jacobi", "gauss_seidel"])
def test_cofmupy(run, job, given, method):
    """Both schemes; no exchange before the first step, whose inputs come from the configuration.

    cofmupy/master/default_master.py: `init_simulation`, `solve_loop`. The order of Gauss-Seidel
    is that of a Python set, so it is the runner that says it.
    """
    told = run("cofmupy", given, method=method)
    (order,) = told["order"]
    name = "Jacobi" if method == "jacobi" else f"Gauss-Seidel, {order[0]} first"
    held_against_every_scheme(told, job, name)


def test_pathsim(run, job, given):
    """Gauss-Seidel in the order of the blocks; the FMUs' clock is a step ahead.

    pathsim_fmi/blocks.py: a `Schedule` from time 0 steps the FMU; pathsim/simulation.py,
    `timestep`: all connections are updated after each event.
    """
    told = run("pathsim", given)
    held_against_every_scheme(told, job, "Gauss-Seidel, vehicle first")


@pytest.mark.parametrize("sequential", [False, True], ids=["jacobi", "gauss_seidel"])
def test_fmucontainer(run, job, given, sequential):
    """Jacobi, or Gauss-Seidel in the order of the files; each step of the one FMU is one of both.

    fmu_manipulation_toolbox/container/builder.py: `check_sequential_order` says in which order.
    """
    told = run("fmucontainer", given, sequential=sequential)
    held_against_every_scheme(told, job, "Gauss-Seidel, vehicle first" if sequential else "Jacobi")


def test_pyfmi(run, job):
    """Jacobi; what is shown is read again after the exchange. Its master has FMI 2.0 only.

    src/pyfmi/master.pyx: `jacobi_algorithm`, `exchange_connection_data`, `report_solution`.
    """
    told = run("pyfmi", job)
    held_against_every_scheme(told, job, "Jacobi", exchanges=2, refreshed=True)


@pytest.mark.parametrize("importer", ["libcosimpy", "ecospy"])
def test_ssp(run, ssp_job, importer):
    """The same schemes as above; system and start are taken from the SSP file alone."""
    told = run(importer, ssp_job, from_ssp=True)
    shown_again = importer == "ecospy"
    held_against_every_scheme(told, ssp_job, "Jacobi", exchanges=2, refreshed=shown_again)


def test_ssp_in_fmpy(run, ssp_job):
    """Jacobi; no exchange before the first step, in which every connected input is 0.

    fmpy/ssp/simulation.py, `simulate_ssp`: connectors begin with the value 0. So the vehicle falls
    freely for one step, beside a track that is unloaded.
    """
    told = run("fmpy", ssp_job)
    held_against_every_scheme(told, ssp_job, "Jacobi", first_inputs=0.0)


def test_ssp_in_omsimulator(run, ssp_job):
    """Jacobi, with each output that depends on an input at once read after that was set.

    src/OMSimulatorLib/SystemWC.cpp, `doStep`: all components are stepped, then `updateInputs` goes
    through the graph of what depends on what. The step is that of its annotation in the SSP file.
    """
    told = run("omsimulator", ssp_job)
    held_against_every_scheme(told, ssp_job, "Jacobi, feedthrough resolved")
