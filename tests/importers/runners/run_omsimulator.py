"""Starts the program OMSimulator on the SSP file alone: JOB.json ANSWER.json."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.io import loadmat


def results(path):
    """Values over time by name; its CSV files have 12 digits only."""
    found = loadmat(path, chars_as_strings=False)
    names = ["".join(letters).strip() for letters in found["name"].T]
    where, values = found["dataInfo"], found["data_2"]
    return {
        name: values[row - 1]
        for name, part, row in zip(names, where[0], where[1], strict=True)
        if part in (0, 2)  # of time, and of what changes
    }


def main(given, answer):
    job = json.loads(Path(given).read_text(encoding="utf-8"))
    stop = f"--stopTime={job['steps'] * job['step']!r}"
    done = subprocess.run(
        ["OMSimulator", "--resultFile=found.mat", stop, job["ssp"]],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    found = results("found.mat")
    # A point has more than one row, the last after inputs were set; the first one is the start.
    points = {round(time / job["step"]): row for row, time in enumerate(found["time"])}
    wanted = [points[k] for k in range(1, job["steps"] + 1)]
    names = [
        f"Pair.Pair.{name}.{output}" for name in job["outputs"] for output in job["outputs"][name]
    ]
    rows = np.stack([found[name][wanted] for name in names], axis=1).tolist()
    told = subprocess.run(["OMSimulator", "--version"], capture_output=True, text=True, check=True)
    Path(answer).write_text(json.dumps({"version": told.stdout, "rows": rows}), encoding="utf-8")


main(*sys.argv[1:])
