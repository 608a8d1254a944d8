"""Runs in the environment of fmu-manipulation-toolbox: JOB.json ANSWER.json.

It makes one FMU of both, and FMPy runs that.
"""

import json
import shutil
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
from fmpy import simulate_fmu
from fmu_manipulation_toolbox.assembly import Assembly


def assembled(job):
    files = {name: f"{name}.fmu" for name in job["fmus"]}
    for name, path in job["fmus"].items():
        shutil.copy(path, files[name])
    shown = [(name, output) for name, outputs in job["outputs"].items() for output in outputs]
    described = {
        "name": "pair.fmu",
        "step_size": job["step"],
        "sequential": job["sequential"],
        **dict.fromkeys(["auto_link", "auto_input", "auto_output"], False),
        "fmu": list(files.values()),
        "link": [
            [files[source], o, files[target], i] for source, o, target, i in job["connections"]
        ],
        "output": [[files[name], output, f"y[{k}]"] for k, (name, output) in enumerate(shown)],
        "start": [
            [files[name], parameter, value]
            for name, parameters in job["parameters"].items()
            for parameter, value in parameters.items()
        ],
    }
    Path("pair.json").write_text(json.dumps(described), encoding="utf-8")
    Assembly("pair.json", fmu_directory=Path()).make_fmu()
    return [f"y[{k}]" for k in range(len(shown))]  # links have the names of outputs already


def main(given, answer):
    job = json.loads(Path(given).read_text(encoding="utf-8"))
    names = assembled(job)
    found = simulate_fmu(
        "pair.fmu", stop_time=job["steps"] * job["step"], output_interval=job["step"], output=names
    )
    rows = np.stack([found[name] for name in names], axis=1)[1:].tolist()
    told = {"version": version("fmu-manipulation-toolbox"), "rows": rows}
    Path(answer).write_text(json.dumps(told), encoding="utf-8")


main(*sys.argv[1:])
