"""FMPy as its examples use it: setReal and getReal with lists."""

from importlib.metadata import version

from rounds import initialised, job, serve

given = job()
inputs, outputs, h = given["inputs"], given["outputs"], given["step"]
a, b = fmus = initialised(given["fmu"])
u, y = list(range(inputs)), list(range(inputs, inputs + outputs))


def step(steps: int) -> None:
    """Jacobi."""
    global t, y_a, y_b  # noqa: PLW0603
    for _ in range(steps):
        a.setReal(u, y_b[:inputs])
        b.setReal(u, y_a[:inputs])
        a.doStep(t, h)
        b.doStep(t, h)
        y_a, y_b = a.getReal(y), b.getReal(y)
        t += h


t, y_a, y_b = 0.0, a.getReal(y), b.getReal(y)
serve(version("fmpy"), step)
for fmu in fmus:
    fmu.freeInstance()
