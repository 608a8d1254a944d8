"""libcosimpy: the loop is in C++, and there is no observer."""

from importlib.metadata import version

from libcosimpy.CosimEnums import CosimVariableType
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimSlave import CosimLocalSlave
from rounds import connections, job, serve

given = job()
log_output_level(CosimLogLevel.ERROR)
execution = CosimExecution.from_step_size(round(given["step"] * 1e9))  # ns
slaves = [CosimLocalSlave(given["fmu"], name) for name in "ab"]
index = {name: execution.add_local_slave(slave) for name, slave in zip("ab", slaves, strict=True)}
reference = {
    v.name.decode(): v.reference
    for v in execution.slave_variables(index["a"])
    if v.type == CosimVariableType.REAL.value
}
for source, output, target, input_ in connections(given):
    execution.connect_real_variables(
        index[source], reference[output], index[target], reference[input_]
    )


def step(steps: int) -> None:
    """Fixed steps, all FMUs with inputs from the step's beginning."""
    if not execution.step(steps):
        raise RuntimeError("libcosim failed")


serve(version("libcosimpy"), step)
