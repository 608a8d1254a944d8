"""Runs in the environment of libcosimpy: JOB.json ANSWER.json."""

import json
import sys
from importlib.metadata import version
from pathlib import Path

from libcosimpy.CosimEnums import CosimVariableType
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

NANOSECONDS = 1_000_000_000


def references(execution, index):
    """Value reference of every Real variable by name."""
    return {
        v.name.decode(): v.reference
        for v in execution.slave_variables(index)
        if v.type == CosimVariableType.REAL.value
    }


def from_fmus(job, step):
    execution = CosimExecution.from_step_size(step)
    slaves = [CosimLocalSlave(path, name) for name, path in job["fmus"].items()]
    index = {
        name: execution.add_local_slave(slave)
        for name, slave in zip(job["fmus"], slaves, strict=True)
    }
    known = {name: references(execution, k) for name, k in index.items()}
    for name, parameters in job["parameters"].items():
        for parameter, value in parameters.items():
            execution.real_initial_value(index[name], known[name][parameter], value)
    for source, output, target, input_ in job["connections"]:
        execution.connect_real_variables(
            index[source], known[source][output], index[target], known[target][input_]
        )
    return execution, index, known, slaves


def from_ssp(job, step):
    execution = CosimExecution.from_ssp_file(job["ssp"], step)
    index = {name: execution.slave_index_from_instance_name(name) for name in job["fmus"]}
    return execution, index, {name: references(execution, k) for name, k in index.items()}, []


def main(given, answer):
    job = json.loads(Path(given).read_text(encoding="utf-8"))
    step = round(job["step"] * NANOSECONDS)
    execution, index, known, _alive = (from_ssp if job.get("from_ssp") else from_fmus)(job, step)
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    rows = []
    for _ in range(job["steps"]):
        assert execution.step()
        row = []
        for name, outputs in job["outputs"].items():
            row += observer.last_real_values(index[name], [known[name][o] for o in outputs])
        rows.append(row)
    told = {"version": version("libcosimpy"), "rows": rows}
    Path(answer).write_text(json.dumps(told), encoding="utf-8")


main(*sys.argv[1:])
