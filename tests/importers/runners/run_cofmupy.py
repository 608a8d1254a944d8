"""Runs in the environment of cofmupy: JOB.json ANSWER.json."""

import json
import sys
from importlib.metadata import version
from pathlib import Path

from cofmupy import Coordinator


def end(component, variable):
    return {"type": "fmu", "id": component, "variable": variable, "unit": ""}


def main(given, answer):
    job = json.loads(Path(given).read_text(encoding="utf-8"))
    coordinator = Coordinator()
    coordinator.start(
        {
            "root": "",
            "edge_sep": " -> ",
            "cosim_method": job["method"],
            "iterative": False,
            "fmus": [
                {
                    "id": name,
                    "name": name,
                    "path": path,
                    "initialization": job["parameters"][name] | job["inputs"][name],
                }
                for name, path in job["fmus"].items()
            ],
            "connections": [
                {"source": end(source, output), "target": end(target, input_)}
                for source, output, target, input_ in job["connections"]
            ],
        }
    )
    for _ in range(job["steps"]):
        coordinator.do_step(job["step"])
    found = coordinator.get_results()
    recorded = [(name, output) for name, outputs in job["outputs"].items() for output in outputs]
    told = {
        "version": version("cofmupy"),
        "order": coordinator.master.sequence_order,
        "rows": [list(row) for row in zip(*(found[key] for key in recorded), strict=True)],
    }
    Path(answer).write_text(json.dumps(told), encoding="utf-8")


main(*sys.argv[1:])
