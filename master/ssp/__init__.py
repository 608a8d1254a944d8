"""Systems of FMUs in SSP 1.0 files (System Structure and Parameterization)."""

from railcosim.master.ssp.assemble import LoadedSystem
from railcosim.master.ssp.load import initialise, open_ssp
from railcosim.master.ssp.structure_xml import Part
from railcosim.master.ssp.write import write_ssp

__all__ = ["LoadedSystem", "Part", "initialise", "open_ssp", "write_ssp"]
