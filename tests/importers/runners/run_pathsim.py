"""Runs in the environment of pathsim-fmi: JOB.json ANSWER.json."""

import json
import sys
from importlib.metadata import version
from pathlib import Path

from pathsim import Connection, Simulation
from pathsim.blocks import Scope
from pathsim_fmi import CoSimulationFMU


def main(given, answer):
    job = json.loads(Path(given).read_text(encoding="utf-8"))
    blocks = {
        name: CoSimulationFMU(
            path,
            instance_name=name,
            start_values=job["parameters"][name] | job["inputs"][name],
            dt=job["step"],
        )
        for name, path in job["fmus"].items()
    }
    scope = Scope()
    recorded = [(name, output) for name, outputs in job["outputs"].items() for output in outputs]
    connections = [
        Connection(blocks[source][output], blocks[target][input_])
        for source, output, target, input_ in job["connections"]
    ]
    connections += [
        Connection(blocks[name][output], scope[k]) for k, (name, output) in enumerate(recorded)
    ]
    simulation = Simulation([*blocks.values(), scope], connections, dt=job["step"], log=False)
    # The first step of the FMUs is made at time 0, before any step of the simulation.
    simulation.run((job["steps"] - 1) * job["step"])
    _, values = scope.read()
    told = {"version": version("pathsim-fmi"), "rows": values.T.tolist()}
    Path(answer).write_text(json.dumps(told), encoding="utf-8")


main(*sys.argv[1:])
