"""Run for test_resume.py in a process that is killed: a JSON of what to run.

If there is a checkpoint, it goes on from there. Prints a line at every point; at the end it writes
the results.
"""

import json
import sys
from pathlib import Path

import numpy as np

from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey, open_pair
from railcosim.master.checkpoint import Checkpoints, resume
from railcosim.master.cosimulation import cosimulate
from railcosim.master.pace import FixedStep
from railcosim.master.recording import Recorder
from railcosim.master.schemes.catalogue import CATALOGUE
from railcosim.master.step_control import StepControl
from railcosim.track.irregularity import synthesise

SPEED, STOP = 250 / 3.6, 0.01

job = json.loads(sys.argv[1])
folder, path = Path(job["folder"]), Path(job["path"])
vehicle, track = (folder / f"{name}.fmu" for name in FMUS[Owner(job["owner"])])
about = {"contact.nonlinear": 1.0, "speed": SPEED, "irregularity": "german-low"}
scheme = CATALOGUE[job["scheme"]].make(CATALOGUE[job["scheme"]].degrees[0], "vehicle")
pace = (
    StepControl(order=scheme.order, relative=1e-3, absolute=1e-3, largest=1e-3, smallest=1e-7)
    if job["adaptive"]
    else FixedStep(1e-4)
)
journey = Journey(speed=SPEED, held=False, profile=synthesise("german-low", SPEED * STOP))
with open_pair(vehicle, track, {"contact.nonlinear": True}, journey) as pair:
    recorder = Recorder(pair.system)
    run = cosimulate(pair.system, scheme, pace, STOP)
    if path.exists():
        resume(path, run, recorder, about)
    points = (
        run if job["every"] is None else Checkpoints(path, job["every"]).watch(run, recorder, about)
    )
    for point in points:
        recorder.add(point)
        print("point".ljust(4095), flush=True)  # test_resume.py: a page
np.save(job["results"], recorder.rows())
