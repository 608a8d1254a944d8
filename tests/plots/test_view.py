"""The page that plays a run: what it draws, that it is safe and bounded, and that it plays."""

import importlib.util
import json
import re
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from railcosim.plots import view
from railcosim.plots.view import NothingToViewError, frames_of, write_view

BROWSER = Path(__file__).parents[1] / "paper" / "browser.py"
spec = importlib.util.spec_from_file_location("browser", BROWSER)
browser = importlib.util.module_from_spec(spec)
spec.loader.exec_module(browser)
HOSTILE = '</script><script>document.title="taken"</script><img src=x onerror=alert(1)>'


def a_run(n=5001, wheelsets=4, ring=None, **attrs):
    """A vehicle at 50 m/s over a wave; the force has one short peak."""
    t = np.linspace(0, 0.5, n)
    places = [18.5, 16.0, 2.8, 0.3][:wheelsets]
    values = {"carbody.z": 2e-3 * np.sin(9 * t), "carbody.pitch": 1e-4 * t}
    values |= {f"bogie[{b}].z": 3e-3 + 1e-3 * np.sin(20 * t + b) for b in (1, 2)}
    for i, place in enumerate(places, 1):
        x = place + 50 * t
        values[f"wheelset[{i}].position"] = x if ring is None else x % ring
        for side in ("left", "right"):
            wheel = f"wheelset[{i}].{side}"
            values[f"{wheel}.wheel_z"] = 1.5e-3 + 5e-4 * np.sin(x)
            values[f"{wheel}.rail_z"] = 1.4e-3 + 4e-4 * np.sin(x)
            force = 79e3 + 1e4 * np.sin(x)
            force[1234 % n] = 180e3
            values[f"{wheel}.force_z"] = force
    return xr.Dataset({k: ("time", v) for k, v in values.items()}, {"time": t}, attrs)


def test_as_many_frames_as_a_screen_shows_and_no_peak_is_lost(monkeypatch) -> None:
    frames = frames_of(a_run())
    n = len(frames["time"])
    assert n == view.MOST
    assert (frames["time"][0], frames["time"][-1]) == (0.0, 0.5)
    first = frames["wheels"][0]
    assert (first["name"], first["side"], first["rough"]) == ("wheelset 1, left", "left", None)
    low, high = first["extremes"]
    assert max(high) == 180e3  # between two frames
    assert len(low) == len(high) == len(first["force"]) == n
    monkeypatch.setattr(view, "NUMBERS", 10_000)  # of more wheelsets there are fewer
    assert len(frames_of(a_run())["time"]) == 10_000 // (6 * 8 + 4 + 2 * 3)


def with_sensors(run):
    """A rail and a slab at 20 m; nothing is known of the slab at first."""
    t = run["time"].values
    pressure = np.where(t < 0.1, np.nan, 4e3 * np.sin(9 * t))
    for name, values, said in (
        ("sensor[1].z", 1e-3 * np.cos(9 * t), {"of": "rail", "side": "left"}),
        ("sensor[2].pressure", pressure, {"of": "slab", "side": "middle"}),
        ("sensor[2].z", 1e-3 * pressure, {"of": "slab", "side": "middle"}),
    ):
        run[name] = "time", values, {**said, "at": 20.0, "long_name": f"{said['of']}: it"}
    return run


def test_sensors_are_drawn_where_they_are_and_in_panels() -> None:
    frames = frames_of(with_sensors(a_run(n=101)))
    assert [(s["of"], s["side"], s["at"]) for s in frames["sensors"]] == [
        ("rail", "left", 20.0), ("slab", "middle", 20.0)
    ]  # fmt: skip
    assert frames["sensors"][1]["z"][0] is None
    displaced, pressure = frames["panels"]
    assert displaced["label"] == "displacement (mm)"
    assert [curve["name"] for curve in displaced["curves"]] == ["rail", "slab"]
    low, high = pressure["curves"][0]["extremes"]
    assert low[0] is None
    assert max(v for v in high if v is not None) == pytest.approx(4.0, rel=1e-3)  # kPa
    assert frames_of(a_run(n=50))["panels"] == []


def test_a_place_that_is_none_is_no_sensor() -> None:
    run = with_sensors(a_run(n=50))
    run["sensor[1].z"].attrs["at"] = np.inf
    run["sensor[2].z"].attrs["at"] = "here"
    run["sensor[2].pressure"].attrs = {"at": 1.0}
    assert frames_of(run)["sensors"] == []


def test_bodies_stand_on_wheelsets_in_their_order() -> None:
    on = {body["name"]: body["on"] for body in frames_of(a_run())["bodies"]}
    assert on == {"car body": [0, 1, 2, 3], "bogie 1": [0, 1], "bogie 2": [2, 3]}
    uneven = {body["name"] for body in frames_of(a_run(wheelsets=3))["bodies"]}
    assert uneven == {"car body"}  # two bogies on three wheelsets: nobody knows how


def test_a_ring_has_no_jump() -> None:
    place = frames_of(a_run(ring=19.0))["place"]
    assert np.diff(place[0]) == pytest.approx(0.5 / (view.MOST - 1) * 50, rel=0.3)
    assert place[0][0] - place[3][0] == pytest.approx(18.2)


def test_numbers_that_are_none_are_none() -> None:
    run = a_run(n=50)
    run["carbody.z"][3] = np.nan
    frames = json.loads(json.dumps(frames_of(run), allow_nan=False))
    (car,) = (body for body in frames["bodies"] if body["kind"] == "carbody")
    assert car["z"][3] is None


@pytest.mark.parametrize(
    "run",
    [
        xr.Dataset({"a": ("time", [0.0, 1.0])}, {"time": [0.0, 1.0]}),
        a_run(n=50).isel(time=[0]),
        a_run(n=50).drop_vars("wheelset[2].position"),
        xr.Dataset({"wheelset[1].left.rail_z": ("frequency", [1.0])}, {"frequency": [1.0]}),
    ],
)
def test_what_is_no_run_is_refused(run, tmp_path) -> None:
    with pytest.raises(NothingToViewError):
        write_view(run, tmp_path / "a.html")
    assert not list(tmp_path.iterdir())


class Tags(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.links: list[str] = []

    def handle_starttag(self, tag, attrs) -> None:
        self.tags.append(tag)
        self.links += [v for k, v in attrs if k in ("src", "href") and v]


def test_words_of_a_stranger_s_file_do_nothing(tmp_path) -> None:
    write_view(a_run(n=50, title=HOSTILE, **{HOSTILE: HOSTILE}), tmp_path / "a.html")
    text = (tmp_path / "a.html").read_text()
    seen = Tags()
    seen.feed(text)
    assert seen.tags.count("script") == 2
    assert "img" not in seen.tags
    assert seen.links == ["data:,"]  # nothing is fetched
    assert "http" not in re.sub(r"http-equiv|<dl>.*</dl>", "", text, flags=re.DOTALL)


# 5 s of a browser.
@pytest.mark.slow
@pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed")
def test_a_browser_plays_it(tmp_path) -> None:
    """By its own buttons, with a few lines more in the page; without a complaint."""
    page = tmp_path / "a.html"
    write_view(with_sensors(a_run(title=HOSTILE)), page)
    probe = """<script>
    const went = [];
    const note = () => went.push(document.body.dataset.frame);
    note();
    document.getElementById("time").value = "700";
    document.getElementById("time").dispatchEvent(new Event("input"));
    note();
    window.dispatchEvent(new KeyboardEvent("keydown", {key: "ArrowRight"}));
    note();
    const pixels = (id) => {
      const c = document.getElementById(id);
      return new Set(c.getContext("2d").getImageData(0, 0, c.width, c.height).data).size;
    };
    const colours = pixels("train") + pixels("forces");
    const picture = (id) => document.getElementById(id).toDataURL();
    const forces = picture("forces"), labels = [];
    for (const option of document.getElementById("shown").options) {
      document.getElementById("shown").value = option.value;
      document.getElementById("shown").dispatchEvent(new Event("change"));
      labels.push(option.textContent + (picture("forces") === forces ? "" : "*"));
    }
    document.getElementById("pace").value = "1";
    document.getElementById("play").click();
    // However slowly it is drawn: the button says when the run has been played.
    const waiting = setInterval(() => {
      if (document.getElementById("play").textContent !== "play") return;
      clearInterval(waiting);
      note();
      document.body.dataset.went = went.join(" ");
      document.body.dataset.colours = String(colours);
      document.body.dataset.labels = labels.join(", ");
      document.body.dataset.title = document.title;
    }, 100);
    </script></body>"""
    page.write_text(page.read_text().replace("</body>", probe))
    dom, complaints = browser.render(page)
    assert complaints == []
    begin, there, next_, end = re.search(r'data-went="([^"]*)"', dom)[1].split()
    assert (begin, there, next_, end) == ("0", "700", "701", str(view.MOST - 1))
    assert int(re.search(r'data-colours="(\d+)"', dom)[1]) > 20
    shown = re.search(r'data-labels="([^"]*)"', dom)[1]  # each another picture than forces
    assert shown == "contact forces, displacement (mm)*, slab: pressure on the foundation (kPa)*"
    assert unescape(re.search(r'data-title="([^"]*)"', dom)[1]) == HOSTILE  # as words
