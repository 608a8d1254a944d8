"""documentation/index.html: what an engineer wants to know before using an FMU."""

from __future__ import annotations

from collections.abc import Sequence

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import FORCE, RAIL, WHEEL, Layout, wheelset_name
from railcosim.track.decay import PROMISED, PROMISED_TO

from ..interface import Scalar
from .about import Description
from .drawing import Drawing, drawn
from .kind import Kind
from .reference import STEP, Run
from .structure import states_of
from .terminals import terminals
from .units import displayed

# What the plot shows, the most telling first: an input and two outputs of the left wheels.
SHOWN = (FORCE, RAIL.motion, WHEEL.motion, RAIL.rate, WHEEL.rate)
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")  # Okabe and Ito, told apart by everybody
CAUSALITIES = ("input", "output", "parameter")


def page(
    about: Description,
    kind: Kind,
    table: Sequence[Scalar],
    body: ModalBody,
    run: Run,
    *,
    fmi: int,
    parameters: str,
    model_exchange: bool,
    with_sources: bool,
) -> bytes:
    """The page; see `extras` for the parameters."""
    environment = Environment(
        loader=PackageLoader(__package__, "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = _number
    environment.filters["depends"] = lambda v: _depends(v, table)
    groups = {c: [v for v in table if v.causality == c] for c in CAUSALITIES}
    quantity = {c: {v.quantity for v in rows} for c, rows in groups.items()}
    causality = {v.name: v.causality for v in table}
    members = next(iter(terminals(table).values()))  # all terminals are alike
    text = environment.get_template("page.html.j2").render(
        about=about,
        can=about.capabilities,
        kind=kind,
        promised=f"{PROMISED:.0%}",
        promised_to=f"{PROMISED_TO:g}",
        layout=body.layout,
        facts=kind.facts(body),
        groups=groups,
        takes=quantity["input"],
        owns_contact="force_z" in quantity["output"],
        internal_step="internal_step" in quantity["parameter"],
        states=states_of(body).blocks if model_exchange else (),
        members=[(m.name, m.variable, causality[m.variable]) for m in members],
        run=run,
        step=STEP,
        fmi=fmi,
        model_exchange=model_exchange,
        with_sources=with_sources,
        parameters=parameters,
    )
    return text.encode()


def _number(value: float | bool | None) -> str:
    """Six digits, which the eye can take in; modelDescription.xml has them all."""
    if value is None:
        return ""
    return str(value).lower() if isinstance(value, bool) else f"{value:.6g}"


def _depends(v: Scalar, table: Sequence[Scalar]) -> str:
    """What an output depends on at once, all inputs in short."""
    inputs = [known.name for known in table if known.causality == "input"]
    if set(inputs) <= set(v.depends_on):
        return ", ".join(["all inputs", *(n for n in v.depends_on if n not in inputs)])
    return ", ".join(v.depends_on)


def result_plot(run: Run, table: Sequence[Scalar], layout: Layout) -> Drawing:
    """The reference run: what drives the left wheels, and how they answer."""
    known = {v.name: v for v in table}
    first = layout.ports[0]
    alike = [p for p in layout.ports if (p.side, p.direction) == (first.side, first.direction)]
    ports = alike[: len(COLOURS)]
    driven = [q for q in SHOWN if ports[0].name(q) in run.inputs][:1]
    answers = [q for q in SHOWN if ports[0].name(q) in run.outputs][:2]
    columns = run.inputs | run.outputs

    def draw(figure: Figure) -> None:
        # Fixed margins: to look for the best ones takes half as long as all the rest of an FMU.
        figure.set_layout_engine("none")
        margins = {"left": 0.12, "right": 0.97, "bottom": 0.09, "top": 0.88, "hspace": 0.33}
        panels = figure.subplots(len(driven + answers), 1, sharex=True, gridspec_kw=margins)
        for axes, quantity in zip(panels, driven + answers, strict=True):
            for port, colour in zip(ports, COLOURS, strict=False):
                name = port.name(quantity)
                factor, unit = displayed(known[name], 1.0)
                axes.plot(1e3 * run.time, factor * columns[name], color=colour, lw=1.3)
                axes.set_ylabel(f"{known[name].quantity}, {unit}")
            kind = "input" if quantity in driven else "output"
            axes.set_title(f"{kind}: wheelset[i].left.{known[name].quantity}", loc="left", size=9)
            axes.spines[["top", "right"]].set_visible(False)
            axes.grid(color="#e6ebef", lw=0.8)
        panels[-1].set(xlabel="time, ms", xlim=(0, 1e3 * run.time[-1]))
        lines = panels[0].get_lines()
        labels = [wheelset_name(port.wheelset) for port in ports]
        figure.legend(lines, labels, loc="upper center", ncols=4, frameon=False)

    return drawn(draw, (7.6, 5.6), endings=["svg"])
