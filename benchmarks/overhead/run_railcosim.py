"""Our master: Jacobi, inputs held constant; the points recorded if the job says so."""

from importlib.metadata import version
from itertools import islice

from rounds import connections, job, serve

from railcosim.master.connections import Connection
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.recording import Recorder
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.system import System

given = job()
with (
    FmuComponent.load(given["fmu"], name="a") as a,
    FmuComponent.load(given["fmu"], name="b") as b,
):
    system = System((a, b), [Connection(*ends) for ends in connections(given)])
    for fmu in (a, b):
        fmu.enter_initialization(0.0)
    system.exchange()
    for fmu in (a, b):
        fmu.exit_initialization()
    points = cosimulate(
        system, jacobi(degree=0), given["step"], stop=given["step"] * given["steps"]
    )
    next(points)
    recorder = Recorder(system)

    def step(steps: int) -> None:
        """Step only."""
        for _ in islice(points, steps):
            pass

    def step_and_record(steps: int) -> None:
        """Keep every output of every point."""
        for point in islice(points, steps):
            recorder.add(point)

    serve(version("railcosim"), step_and_record if given["record"] else step)
    if len(recorder) != given["record"] * given["steps"]:
        raise RuntimeError("not all points were recorded")
