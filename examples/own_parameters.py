"""Your own track: twice as stiff fastenings, from a parameter file.

python examples/own_parameters.py [PICTURE]
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from railcosim.parameters import read_toml
from railcosim.plots.picture import save_picture
from railcosim.plots.results import receptance_chart
from railcosim.track.parameters import Track
from railcosim.track.receptance import Point, direct_receptance

# `railcosim parameters --track` prints the whole file; what is left out keeps its default.
TOML = """
[fastening]
stiffness = 6e7  # N/m
"""

with TemporaryDirectory() as folder:
    file = Path(folder) / "my.toml"
    file.write_text(TOML)
    stiff = read_toml(Track, file)  # says which line is wrong, and what is allowed

frequency = np.geomspace(20, 400, 300)  # Hz
curves = {}
for name, track in {"30 kN/mm": Track(), "60 kN/mm": stiff}.items():
    seat = Point(x=track.fastening.spacing * 3.5)
    receptance = direct_receptance(track, 2 * np.pi * frequency, [seat], [seat])[:, 0, 0]
    curves[name] = (frequency, receptance)
    print(f"fastenings of {name}: {1e9 * abs(receptance[0]):.2f} nm/N at 20 Hz")
save_picture(
    receptance_chart(curves, "receptance (m/N)", "a railseat, a unit force on one rail"),
    Path(sys.argv[1] if len(sys.argv) > 1 else "own.png"),
)
