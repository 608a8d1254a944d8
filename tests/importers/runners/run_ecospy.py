"""Runs in the environment of ecospy: JOB.json ANSWER.json."""

import json
import sys
from importlib.metadata import version
from pathlib import Path

from ecospy import EcosSimulation, EcosSimulationStructure


def structure(job):
    made = EcosSimulationStructure()
    for name, path in job["fmus"].items():
        made.add_model(name, path)
    for source, output, target, input_ in job["connections"]:
        made.make_real_connection(f"{source}::{output}", f"{target}::{input_}")
    parameters = {
        f"{name}::{parameter}": value
        for name, parameters in job["parameters"].items()
        for parameter, value in parameters.items()
    }
    made.add_parameter_set("start", parameters)
    return made


def main(given, answer):
    job = json.loads(Path(given).read_text(encoding="utf-8"))
    source = {"ssp_path": job["ssp"]} if job.get("from_ssp") else {"structure": structure(job)}
    rows = []
    with EcosSimulation(job["step"], **source) as simulation:
        simulation.init(parameter_set="start")
        for _ in range(job["steps"]):
            simulation.step()
            rows.append(
                [
                    simulation.get_real(f"{name}::{output}")
                    for name, outputs in job["outputs"].items()
                    for output in outputs
                ]
            )
        simulation.terminate()
    told = {"version": version("ecospy"), "rows": rows}
    Path(answer).write_text(json.dumps(told), encoding="utf-8")


main(*sys.argv[1:])
