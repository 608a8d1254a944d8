"""Systems of FMUs in SSP files, 1.0 and 2.0, (System Structure and Parameterization).

Read, and run:

>>> with open_ssp("system.ssp") as loaded:                                  # doctest: +SKIP
...     system = System(loaded.components, loaded.connections)
...     initialise(system, loaded.fmus, start=0.0)
...     for point in cosimulate(system, jacobi(), step=1e-3, stop=1.0):
...         recorder.add(point)

Write FMUs `a` and `b` that are coupled as `system`:

>>> parts = [                                                               # doctest: +SKIP
...     Part(name="a", description=a.description, starts={"stiffness": 1e6}),
...     Part(name="b", description=b.description),
... ]
>>> write_ssp(Path("system.ssp"), parts, system.connections, step=1e-3)     # doctest: +SKIP
"""

from railcosim.master.ssp.assemble import LoadedSystem
from railcosim.master.ssp.load import initialise, open_ssp
from railcosim.master.ssp.structure_xml import Part
from railcosim.master.ssp.write import write_ssp

__all__ = ["LoadedSystem", "Part", "initialise", "open_ssp", "write_ssp"]
