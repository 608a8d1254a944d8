"""The floor: six calls by ctypes on arrays that both FMUs share. Nothing is checked.

All arguments are made before, in the form that is passed on: to convert them costs more than to
call.
"""

from ctypes import byref, c_double, c_int, c_size_t, c_uint, c_void_p
from importlib.metadata import version

from rounds import initialised, job, serve

given = job()
inputs, outputs = given["inputs"], given["outputs"]
fmus = initialised(given["fmu"])
y_a, y_b = (c_double * outputs)(), (c_double * outputs)()  # the inputs of the other one, too
u = byref((c_uint * inputs)(*range(inputs)))
y = byref((c_uint * outputs)(*range(inputs, inputs + outputs)))
n_u, n_y = c_size_t.from_param(inputs), c_size_t.from_param(outputs)
t, h, final = c_double(), c_double.from_param(given["step"]), c_int.from_param(0)
# Asked for anew by [] and without the types of arguments that FMPy has given its own.
set_a, set_b = (fmu.dll["fmi2SetReal"] for fmu in fmus)
do_a, do_b = (fmu.dll["fmi2DoStep"] for fmu in fmus)
get_a, get_b = (fmu.dll["fmi2GetReal"] for fmu in fmus)
a, b = (c_void_p.from_param(fmu.component) for fmu in fmus)
setting = (a, u, n_u, byref(y_b)), (b, u, n_u, byref(y_a))
doing = (a, t, h, final), (b, t, h, final)
getting = (a, y, n_y, byref(y_a)), (b, y, n_y, byref(y_b))


def step(steps: int) -> None:
    """Jacobi."""
    (set_to_a, set_to_b), (do_to_a, do_to_b), (get_of_a, get_of_b) = setting, doing, getting
    for _ in range(steps):
        set_a(*set_to_a)
        set_b(*set_to_b)
        do_a(*do_to_a)
        do_b(*do_to_b)
        get_a(*get_of_a)
        get_b(*get_of_b)
        t.value += given["step"]


get_a(*getting[0])
get_b(*getting[1])
serve(version("fmpy"), step)
for fmu in fmus:
    fmu.freeInstance()
