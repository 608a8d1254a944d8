"""Runs in a Python that has PyFMI: JOB.json ANSWER.json."""

import json
import sys
from pathlib import Path

import pyfmi
from pyfmi.fmi import FMUModelCS2


def main(given, answer):
    job = json.loads(Path(given).read_text(encoding="utf-8"))
    models = {name: FMUModelCS2(path) for name, path in job["fmus"].items()}
    for name, parameters in job["parameters"].items():
        for parameter, value in parameters.items():
            models[name].set(parameter, value)
    connections = [
        (models[source], output, models[target], input_)
        for source, output, target, input_ in job["connections"]
    ]
    master = pyfmi.Master(list(models.values()), connections)
    options = master.simulate_options()
    options["step_size"] = job["step"]
    options["result_handling"] = "memory"
    found = master.simulate(0.0, job["steps"] * job["step"], options=options)
    columns = [
        found[models[name]][output]
        for name, outputs in job["outputs"].items()
        for output in outputs
    ]
    rows = [list(map(float, row)) for row in zip(*columns, strict=True)][1:]
    told = {"version": pyfmi.__version__, "rows": rows}
    Path(answer).write_text(json.dumps(told), encoding="utf-8")


main(*sys.argv[1:])
