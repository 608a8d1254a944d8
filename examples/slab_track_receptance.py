"""Receptance of a slab track, straight from its finite elements.

A unit force on each rail, at a railseat and between two: the first resonance of slab and rail on
the foundation, and the pinned-pinned resonance between the fastenings.

    python examples/slab_track_receptance.py [PICTURE]
"""

import sys
from pathlib import Path

import numpy as np

from railcosim.plots.picture import save_picture
from railcosim.plots.results import receptance_chart
from railcosim.track.cell import railseats
from railcosim.track.parameters import Track
from railcosim.track.receptance import Point, direct_receptance

track = Track()  # the paper's; every number has its unit, range and source in the class
frequency = np.union1d(np.geomspace(5, 1500, 300), np.arange(1040, 1075, 1.0))  # Hz
seat = railseats(track)[track.bays // 2]  # m from the beginning of a cell

curves = {}
for name, x in {"railseat": seat, "mid-span": seat + track.fastening.spacing / 2}.items():
    left, right = Point(x=x, side=-1), Point(x=x, side=1)
    response = direct_receptance(track, 2 * np.pi * frequency, [left, right], [left])
    curves[name] = (frequency, response.sum(axis=2)[:, 0])  # both forces together

size = abs(curves["railseat"][1])
low = frequency < 100
print(f"first resonance: {frequency[low][size[low].argmax()]:.1f} Hz")
between = abs(curves["mid-span"][1])
high = frequency > 1000
print(f"pinned-pinned: {frequency[high][between[high].argmax()]:.0f} Hz")
save_picture(
    receptance_chart(curves, "receptance (m/N)", "slab track, a unit force on each rail"),
    Path(sys.argv[1] if len(sys.argv) > 1 else "receptance.png"),
)
