"""Starts the program fmusim: JOB.json ANSWER.json."""

import csv
import json
import subprocess
import sys
from pathlib import Path


def main(given, answer):
    job = json.loads(Path(given).read_text(encoding="utf-8"))
    inputs, found = Path("inputs.csv"), Path("found.csv")
    columns = [job["times"], *job["signals"].values()]
    with inputs.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["time", *job["signals"]])
        rows.writerows(zip(*columns, strict=True))
    wanted = [word for name in job["record"] for word in ("--output-variable", name)]
    subprocess.run(
        ["fmusim", "--interface-type", "cs", "--stop-time", repr(job["times"][-1]),
         "--output-interval", repr(job["step"]), "--input-file", inputs, "--output-file", found,
         *wanted, job["fmu"]],
        check=True,
    )  # fmt: skip
    with found.open(newline="", encoding="utf-8") as file:
        rows = [[float(row[name]) for name in job["record"]] for row in csv.DictReader(file)]
    told = subprocess.run(["fmusim", "--version"], capture_output=True, text=True, check=True)
    Path(answer).write_text(json.dumps({"version": told.stdout, "rows": rows}), encoding="utf-8")


main(*sys.argv[1:])
