"""Which calls an FMU's version of FMI has."""

from __future__ import annotations

from railcosim.master.fmi.calls import Calls
from railcosim.master.fmi.fmi2 import Fmi2Calls
from railcosim.master.fmi.fmi3 import Fmi3Calls

CALLS: dict[int, type[Calls]] = {2: Fmi2Calls, 3: Fmi3Calls}
"""By the major version."""
