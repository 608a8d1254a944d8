"""Railway vehicle and slab track as separate FMUs, coupled in time and in frequency.

The names below are what most users need; each is loaded when it is first used. Everything else is
in the packages ``railcosim.master`` (anyone's FMUs), ``railcosim.analysis`` (vehicle and track
together), ``railcosim.vehicle``, ``railcosim.track``, ``railcosim.fmus``.
"""

from __future__ import annotations

from functools import reduce
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from railcosim.analysis.compare import compare
    from railcosim.analysis.fitting.fit import fit
    from railcosim.analysis.pair.export_pair import export_pair as export
    from railcosim.analysis.response.decay_rate import track_decay_rate
    from railcosim.analysis.response.dispersion import track_dispersion
    from railcosim.analysis.response.frf import frequency_response
    from railcosim.analysis.response.hunting import critical_speed
    from railcosim.analysis.response.limit_cycle import limit_cycles
    from railcosim.analysis.response.map import response_map
    from railcosim.analysis.response.receptance import receptance
    from railcosim.analysis.response.ride import ride
    from railcosim.analysis.response.safety import running_safety
    from railcosim.analysis.response.sensitivity import sensitivities
    from railcosim.analysis.response.track_modes import track_modes
    from railcosim.analysis.response.track_receptance import track_receptance
    from railcosim.analysis.response.transmission import transmission
    from railcosim.analysis.response.vehicle_modes import vehicle_modes
    from railcosim.analysis.run import run
    from railcosim.analysis.schemes.advice import advise
    from railcosim.analysis.schemes.choice import scheme
    from railcosim.analysis.schemes.grid_run import study
    from railcosim.analysis.schemes.limits import stability
    from railcosim.analysis.sweep import sweep
    from railcosim.master.component import Variable
    from railcosim.master.cosimulation import cosimulate
    from railcosim.master.coupling import couple
    from railcosim.master.files import load as open_result
    from railcosim.master.files import save as save_result
    from railcosim.master.fmi.fmu import FmuComponent
    from railcosim.master.recording import Recorder
    from railcosim.master.signals import Signal
    from railcosim.parameters import changed
    from railcosim.track.files import read_track
    from railcosim.track.irregularity import Profile
    from railcosim.track.irregularity.named import irregularity
    from railcosim.track.parameters import Track
    from railcosim.vehicle.files import read_stock as read_vehicle
    from railcosim.vehicle.parameters import Vehicle
    from railcosim.vehicle.train import Train

    load = FmuComponent.load

    __version__: str

__all__ = [
    "Profile",
    "Recorder",
    "Signal",
    "Track",
    "Train",
    "Variable",
    "Vehicle",
    "__version__",
    "advise",
    "changed",
    "compare",
    "cosimulate",
    "couple",
    "critical_speed",
    "export",
    "fit",
    "frequency_response",
    "irregularity",
    "limit_cycles",
    "load",
    "open_result",
    "read_track",
    "read_vehicle",
    "receptance",
    "response_map",
    "ride",
    "run",
    "running_safety",
    "save_result",
    "scheme",
    "sensitivities",
    "stability",
    "study",
    "sweep",
    "track_decay_rate",
    "track_dispersion",
    "track_modes",
    "track_receptance",
    "transmission",
    "vehicle_modes",
]

_PLACES = {
    "Profile": "track.irregularity:Profile",
    "Recorder": "master.recording:Recorder",
    "Signal": "master.signals:Signal",
    "Track": "track.parameters:Track",
    "Train": "vehicle.train:Train",
    "Variable": "master.component:Variable",
    "Vehicle": "vehicle.parameters:Vehicle",
    "advise": "analysis.schemes.advice:advise",
    "changed": "parameters:changed",
    "compare": "analysis.compare:compare",
    "cosimulate": "master.cosimulation:cosimulate",
    "couple": "master.coupling:couple",
    "critical_speed": "analysis.response.hunting:critical_speed",
    "export": "analysis.pair.export_pair:export_pair",
    "fit": "analysis.fitting.fit:fit",
    "frequency_response": "analysis.response.frf:frequency_response",
    "irregularity": "track.irregularity.named:irregularity",
    "limit_cycles": "analysis.response.limit_cycle:limit_cycles",
    "load": "master.fmi.fmu:FmuComponent.load",
    "open_result": "master.files:load",
    "read_track": "track.files:read_track",
    "read_vehicle": "vehicle.files:read_stock",
    "receptance": "analysis.response.receptance:receptance",
    "response_map": "analysis.response.map:response_map",
    "ride": "analysis.response.ride:ride",
    "run": "analysis.run:run",
    "running_safety": "analysis.response.safety:running_safety",
    "save_result": "master.files:save",
    "scheme": "analysis.schemes.choice:scheme",
    "sensitivities": "analysis.response.sensitivity:sensitivities",
    "stability": "analysis.schemes.limits:stability",
    "study": "analysis.schemes.grid_run:study",
    "sweep": "analysis.sweep:sweep",
    "track_decay_rate": "analysis.response.decay_rate:track_decay_rate",
    "track_dispersion": "analysis.response.dispersion:track_dispersion",
    "track_modes": "analysis.response.track_modes:track_modes",
    "track_receptance": "analysis.response.track_receptance:track_receptance",
    "transmission": "analysis.response.transmission:transmission",
    "vehicle_modes": "analysis.response.vehicle_modes:vehicle_modes",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version("railcosim")
    if name not in _PLACES:
        raise AttributeError(f"module 'railcosim' has no attribute {name!r}")
    module, _, path = _PLACES[name].partition(":")
    found = reduce(getattr, path.split("."), import_module(f"railcosim.{module}"))
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
