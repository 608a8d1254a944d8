"""Runs in the environment of FMPy: JOB.json ANSWER.json."""

import json
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
from fmpy import simulate_fmu
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import ParameterSet, read_ssd


def from_ssp(job):
    """FMPy applies no parameter bindings: they are handed to it, with the components' names."""
    parameters = ParameterSet()
    for component in read_ssd(job["ssp"]).system.elements:
        for binding in component.parameterBindings:
            for values in binding.parameterValues:
                for parameter in values.parameters:
                    parameter.name = f"{component.name}.{parameter.name}"
                    parameters.parameters.append(parameter)
    stop = (job["steps"] - 0.5) * job["step"]  # the loop sums its steps up, with rounding
    found = simulate_ssp(
        job["ssp"], stop_time=stop, step_size=job["step"], parameter_set=parameters
    )
    return [
        f"{name}.{output}" for name, outputs in job["outputs"].items() for output in outputs
    ], found


def alone(job):
    """One FMU, driven by signals."""
    signals = np.zeros(
        len(job["times"]), dtype=[("time", float), *((name, float) for name in job["signals"])]
    )
    signals["time"] = job["times"]
    for name, values in job["signals"].items():
        signals[name] = values
    found = simulate_fmu(
        job["fmu"],
        fmi_type="CoSimulation",
        stop_time=job["times"][-1],
        output_interval=job["step"],
        input=signals,
        output=job["record"],
    )
    return job["record"], found


def main(given, answer):
    job = json.loads(Path(given).read_text(encoding="utf-8"))
    names, found = alone(job) if "signals" in job else from_ssp(job)
    rows = np.stack([found[name] for name in names], axis=1).tolist()
    told = {"version": version("fmpy"), "rows": rows}
    Path(answer).write_text(json.dumps(told), encoding="utf-8")


main(*sys.argv[1:])
