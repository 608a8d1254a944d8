"""ecospy: the loop is in C++, and nothing is recorded."""

from importlib.metadata import version

from ecospy import EcosSimulation, EcosSimulationStructure
from rounds import connections, job, serve

given = job()
structure = EcosSimulationStructure()
for name in "ab":
    structure.add_model(name, given["fmu"])
for source, output, target, input_ in connections(given):
    structure.make_real_connection(f"{source}::{output}", f"{target}::{input_}")
with EcosSimulation(given["step"], structure=structure) as simulation:
    simulation.init()
    serve(version("ecospy"), simulation.step)
    simulation.terminate()
