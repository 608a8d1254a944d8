"""The floor: six calls by ctypes on arrays that both FMUs share. Nothing is checked.

All arguments are C objects made before: to convert them costs more than the call.
"""

from ctypes import c_double, c_int, c_size_t, c_uint, c_void_p
from importlib.metadata import version

from rounds import initialised, job, serve

given = job()
inputs, outputs = given["inputs"], given["outputs"]
fmus = initialised(given["fmu"])
a, b = (c_void_p(fmu.component) for fmu in fmus)
y_a, y_b = (c_double * outputs)(), (c_double * outputs)()  # the inputs of the other one, too
u, y = (c_uint * inputs)(*range(inputs)), (c_uint * outputs)(*range(inputs, inputs + outputs))
n_u, n_y = c_size_t(inputs), c_size_t(outputs)
t, h, no = c_double(), c_double(given["step"]), c_int()
# Asked for anew by [] and without the types of arguments that FMPy has given its own.
set_a, set_b = (fmu.dll["fmi2SetReal"] for fmu in fmus)
do_a, do_b = (fmu.dll["fmi2DoStep"] for fmu in fmus)
get_a, get_b = (fmu.dll["fmi2GetReal"] for fmu in fmus)


def step(steps: int) -> None:
    """Jacobi."""
    for _ in range(steps):
        set_a(a, u, n_u, y_b)
        set_b(b, u, n_u, y_a)
        do_a(a, t, h, no)
        do_b(b, t, h, no)
        get_a(a, y, n_y, y_a)
        get_b(b, y, n_y, y_b)
        t.value += given["step"]


get_a(a, y, n_y, y_a)
get_b(b, y, n_y, y_b)
serve(version("fmpy"), step)
for fmu in fmus:
    fmu.freeInstance()
