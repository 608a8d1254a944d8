"""The documentation page of an FMU, from its interface table."""

from __future__ import annotations

import html
from collections.abc import Sequence

from .description.about import Description
from .interface import Scalar


def documentation(about: Description, table: Sequence[Scalar], parameters: str) -> str:
    """documentation/index.html: conventions, start, holds, variables and model parameters."""
    rows = "\n".join(
        f"<tr><td><code>{html.escape(v.name)}</code></td><td>{v.causality}</td>"
        f"<td>{html.escape(v.unit)}</td><td>{'' if v.start is None else v.start}</td>"
        f"<td>{html.escape(v.description)}</td></tr>"
        for v in table
    )
    return PAGE.format(
        name=about.name,
        text=html.escape(about.text),
        version=about.version,
        rows=rows,
        parameters=html.escape(parameters),
    )


PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{name}</title>
<style>body{{font-family:sans-serif;max-width:60em;margin:2em auto;line-height:1.4}}
td,th{{border-bottom:1px solid #ccc;padding:.2em .6em;text-align:left;vertical-align:top}}
pre{{background:#f4f4f4;padding:1em;overflow:auto}}</style></head><body>
<h1>{name}</h1>
<p>{text} Made by railcosim {version}.</p>
<h2>Conventions</h2>
<p>SI units. x forward, y to the right, z <b>down</b>; a positive pitch lifts the front. Wheelsets
1 to 4 from the front. Displacements are measured from the unloaded track and from the vehicle
whose wheels just touch it; forces are absolute, compression positive: down on the rail, up on the
wheel. The compression of a contact is wheel_z - rail_z - irregularity_z.</p>
<h2>Start</h2>
<p>A run starts at rest under the inputs and parameters set in initialisation mode: the track under
the contact forces, the vehicle with its wheelsets held at the heights start_z. The two are in
equilibrium if the accelerations wheelset[i].az are then zero.</p>
<h2>Between communication points</h2>
<p>The linear part is stepped exactly for any step size. The parameter input_hold says how inputs go
on over the step: 0 held, 1 extrapolated on the line through the last two values set, 2 interpolated
from the last value set to the present one, which is then that at the END of the step. State can be
saved, restored and serialised; a repeated step gives the same bits.</p>
<h2>Variables</h2>
<table><tr><th>name</th><th>causality</th><th>unit</th><th>start</th><th>meaning</th></tr>
{rows}
</table>
<h2>Parameters of the model inside</h2>
<pre>{parameters}</pre>
</body></html>
"""
