"""What functions of FMI 3.0 take after the instance; all of them give a status."""

from __future__ import annotations

import ctypes

from railcosim.master.fmi.kinds import KINDS
from railcosim.master.fmi.library import POINTER, Signature

_BOOL, _SIZE, _REAL = ctypes.c_bool, ctypes.c_size_t, ctypes.c_double
_PASS = (POINTER, _SIZE, POINTER, _SIZE)
"""Value references, how many, values, how many."""
_BYTES = (POINTER, _SIZE, POINTER, POINTER, _SIZE)
_SENSITIVITY = (POINTER, _SIZE, POINTER, _SIZE, POINTER, _SIZE, POINTER, _SIZE)

SIGNATURES: dict[str, Signature] = {
    "fmi3EnterInitializationMode": (_BOOL, _REAL, _REAL, _BOOL, _REAL),
    **{
        f"fmi3{way}{kind.function}": _BYTES if kind.name == "Binary" else _PASS
        for way in ("Set", "Get")
        for kind in KINDS[3].values()
    },
    **dict.fromkeys(
        (
            "fmi3ExitInitializationMode",
            "fmi3EnterConfigurationMode",
            "fmi3ExitConfigurationMode",
            "fmi3EnterEventMode",
            "fmi3EnterStepMode",
            "fmi3EnterContinuousTimeMode",
            "fmi3Terminate",
        ),
        (),
    ),
    "fmi3GetFMUState": (POINTER,),
    "fmi3SetFMUState": (POINTER,),
    "fmi3FreeFMUState": (POINTER,),
    "fmi3SerializedFMUStateSize": (POINTER, POINTER),
    "fmi3SerializeFMUState": (POINTER, POINTER, _SIZE),
    "fmi3DeserializeFMUState": (POINTER, _SIZE, POINTER),
    "fmi3GetDirectionalDerivative": _SENSITIVITY,
    "fmi3GetAdjointDerivative": _SENSITIVITY,
    "fmi3GetOutputDerivatives": (POINTER, _SIZE, POINTER, POINTER, _SIZE),
    "fmi3DoStep": (_REAL, _REAL, _BOOL, POINTER, POINTER, POINTER, POINTER),
    "fmi3UpdateDiscreteStates": (POINTER,) * 6,
    "fmi3SetClock": (POINTER, _SIZE, POINTER),
    "fmi3GetIntervalDecimal": (POINTER, _SIZE, POINTER, POINTER),
    "fmi3SetContinuousStates": (POINTER, _SIZE),
    "fmi3GetContinuousStates": (POINTER, _SIZE),
    "fmi3GetNominalsOfContinuousStates": (POINTER, _SIZE),
}
