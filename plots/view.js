"use strict";
// Plays a run: data of railcosim.plots.view.frames_of, by hand on two canvases.
(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const element = (id) => document.getElementById(id);
  const COLORS = ["#0072B2", "#D55E00", "#000000", "#56B4E9", "#009E73", "#E69F00", "#CC79A7"];
  const DASHES = [[], [6, 3], [8, 2, 2, 2], [2, 2], [12, 3], [6, 2, 2, 2, 2, 2], [3, 1]];
  const RADIUS = 0.46, BEYOND = 4.0, FAR = 500.0; // m
  const INK = "#1d2733", SOFT = "#8a949e";
  const last = data.time.length - 1;
  const span = data.time[last] - data.time[0];
  let frame = 0, playing = null, side = data.sides[0], scale = 1, panel = -1;

  const wheelsOf = (which) => data.wheels.filter((w) => w.side === which);
  const finite = (values) => (values || []).filter((v) => v !== null);
  // A variable that was not recorded, or is no number there, is drawn as none.
  const value = (values, k) => (values && values[k] !== null ? values[k] : 0);
  const surface = (w, k) => value(w.rail, k) + value(w.rough, k);

  // Not by spreading values over arguments: there may be too many.
  const largest = (lists) => lists.reduce(
    (most, list) => finite(list).reduce((m, v) => Math.max(m, Math.abs(v)), most), 0);
  const mostForce = largest(data.wheels.map((w) => w.force)) || 1;
  const mostDown = largest(data.wheels.flatMap((w) => [w.wheel, w.rail])) || 1e-3;

  function options(select, pairs, chosen) {
    for (const [words, v] of pairs) {
      const option = document.createElement("option");
      option.textContent = words;
      option.value = String(v);
      option.selected = v === chosen;
      select.append(option);
    }
  }

  // --- canvases, in CSS pixels whatever the screen ------------------------------------------

  function cleared(canvas) {
    const ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth || 1100, height = Number(canvas.dataset.height);
    canvas.style.height = height + "px";
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const c = canvas.getContext("2d");
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.clearRect(0, 0, width, height);
    c.font = "12px system-ui, sans-serif";
    return { c, width, height };
  }

  function line(c, points, color, width, dash) {
    c.strokeStyle = color;
    c.lineWidth = width;
    c.setLineDash(dash || []);
    c.beginPath();
    points.forEach(([x, y], i) => (i ? c.lineTo(x, y) : c.moveTo(x, y)));
    c.stroke();
    c.setLineDash([]);
  }

  function words(c, text, x, y, align, color) {
    c.fillStyle = color || INK;
    c.textAlign = align || "center";
    c.fillText(text, x, y);
  }

  // --- vehicle and rail ---------------------------------------------------------------------

  function train() {
    const { c, width, height } = cleared(element("train"));
    const x0 = data.place.map((p) => p[frame]);
    const front = Math.max(...x0), rear = Math.min(...x0);
    const perMetre = Math.min(90, width / (front - rear + 2 * BEYOND + 2));
    const middle = (front + rear) / 2;
    const X = (x) => width / 2 + (x - middle) * perMetre;
    const base = height * 0.57; // of the unloaded rail's top
    const Y = (down) => base + down * scale * perMetre; // deflections
    const up = (metres) => metres * perMetre;

    // Where along the track this is.
    const every = perMetre > 20 ? 5 : 20;
    for (let m = Math.ceil((middle - width / perMetre) / every) * every; X(m) < width; m += every) {
      line(c, [[X(m), height - 26], [X(m), height - 20]], SOFT, 1);
      words(c, m + " m", X(m), height - 7, "center", SOFT);
    }
    line(c, [[0, base], [width, base]], "#c6ccd2", 1, [2, 4]);

    const here = wheelsOf(side);
    places(c, X, Y, up);
    rail(c, here, x0, X, Y);
    for (const body of data.bodies) {
      drawn(c, body, x0, X, up, base);
    }
    here.forEach((w, i) => {
      const x = X(x0[w.wheelset - 1]);
      const y = Y(value(w.wheel, frame)) - up(RADIUS);
      c.strokeStyle = INK;
      c.lineWidth = 2;
      c.beginPath();
      c.arc(x, y, up(RADIUS), 0, 2 * Math.PI);
      c.stroke();
      const turned = x0[w.wheelset - 1] / RADIUS;
      line(c, [[x, y], [x + up(RADIUS) * Math.cos(turned), y + up(RADIUS) * Math.sin(turned)]], SOFT, 1);
      bar(c, w, i, x, height, perMetre);
    });
    words(c, "deflections × " + scale, 8, 16, "left", SOFT);
  }

  function rail(c, here, x0, X, Y) {
    const dots = here
      .map((w) => [x0[w.wheelset - 1], surface(w, frame), COLORS[1]])
      .concat(seen("rail").map((s) => [s.at, s.z[frame], COLORS[0]]))
      .sort((a, b) => a[0] - b[0]);
    if (!dots.length) return;
    // Level at a distance, at the ends and between wheels far from each other.
    const ends = [[dots[0][0] - FAR, 0], [dots[0][0] - BEYOND, 0]];
    dots.forEach((dot, i) => {
      if (i && dot[0] - dots[i - 1][0] > 2 * BEYOND) {
        ends.push([dots[i - 1][0] + BEYOND, 0], [dot[0] - BEYOND, 0]);
      }
      ends.push(dot);
    });
    ends.push([dots[dots.length - 1][0] + BEYOND, 0], [dots[dots.length - 1][0] + FAR, 0]);
    const through = [];
    for (let i = 0; i + 1 < ends.length; i++) {
      const [a, b] = [ends[i], ends[i + 1]];
      for (let s = 0; s <= 1; s += 0.05) {
        const t = s * s * (3 - 2 * s); // level at both ends
        through.push([X(a[0] + s * (b[0] - a[0])), Y(a[1] + t * (b[1] - a[1]))]);
      }
    }
    line(c, through, INK, 1.5, [7, 4]);
    for (const [x, z, color] of dots) {
      c.fillStyle = color;
      c.beginPath();
      c.arc(X(x), Y(z), 4, 0, 2 * Math.PI);
      c.fill();
    }
  }

  // Sensors of a side that tell a deflection now.
  const seen = (of) => data.sensors.filter(
    (s) => s.of === of && s.side === side && s.z && s.z[frame] !== null);

  // What is at fixed places of the track: slabs and layers move, of the rest there is a mark.
  function places(c, X, Y, up) {
    for (const s of data.sensors) {
      if ((s.side !== side && s.side !== "middle") || s.of === "rail") continue;
      const slab = s.of === "slab", fastening = s.of === "fastening";
      const deep = slab ? 0.95 : fastening ? 0.25 : 0.55;
      const [half, thick] = slab ? [0.6, 0.25] : fastening ? [0.1, 0.35] : [0.2, 0.25];
      const y = Y(value(s.z, frame)) + up(deep);
      const known = !s.z || s.z[frame] !== null;
      c.lineWidth = 1.2;
      c.strokeStyle = known ? COLORS[0] : SOFT;
      c.setLineDash(known ? [] : [2, 3]); // nothing is known of it now
      if (fastening) line(c, [[X(s.at), y - up(thick / 2)], [X(s.at), y + up(thick / 2)]], COLORS[0], 3);
      else {
        c.fillStyle = "#dde3e9";
        c.fillRect(X(s.at) - up(half), y - up(thick / 2), 2 * up(half), up(thick));
        c.strokeRect(X(s.at) - up(half), y - up(thick / 2), 2 * up(half), up(thick));
      }
      c.setLineDash([]);
    }
  }

  function drawn(c, body, x0, X, up, base) {
    const places = body.on.map((i) => x0[i]);
    const [low, high] = [Math.min(...places), Math.max(...places)];
    const car = body.kind === "carbody";
    const beyond = car ? 2.5 : 0.35;
    const half = (high - low) / 2 + beyond;
    const thick = up(car ? 2.0 : 0.3), height = up(car ? 2.5 : 0.75);
    const down = value(body.z, frame) * scale * up(1);
    c.save();
    c.translate(X((low + high) / 2), base - height + down);
    // Front, to the right, up is positive; the angle is drawn larger as deflections are.
    c.rotate(-Math.atan(value(body.pitch, frame) * scale));
    c.strokeStyle = INK;
    c.fillStyle = car ? "#eef4f9" : "#dde3e9";
    c.lineWidth = 1.5;
    c.fillRect(-up(half), -thick / 2, 2 * up(half), thick);
    c.strokeRect(-up(half), -thick / 2, 2 * up(half), thick);
    if (car) words(c, body.name, 0, 4);
    c.restore();
  }

  function bar(c, w, i, x, height, perMetre) {
    if (!w.force) return;
    const top = height * 0.74, most = height * 0.16, wide = Math.min(18, perMetre * 0.5);
    const long = (value(w.force, frame) / mostForce) * most;
    c.fillStyle = COLORS[i % COLORS.length];
    c.fillRect(x - wide / 2, top, wide, long);
    const rest = top + (value(w.force, 0) / mostForce) * most;
    line(c, [[x - wide, rest], [x + wide, rest]], INK, 1, [3, 2]);
    words(c, (value(w.force, frame) / 1e3).toFixed(1) + " kN", x, top - 4);
  }

  // --- forces, or what sensors tell, over time ------------------------------------------------

  const LEFT = 60, RIGHT = 250, TOP = 12, BOTTOM = 30;
  const wheelForces = () => ({
    label: "contact force (kN)",
    curves: wheelsOf(side).filter((w) => w.force).map((w) => (
      { name: w.name, extremes: w.extremes.map((ends) => ends.map((v) => (v === null ? v : v / 1e3))) }
    )),
  });
  const shown = () => (panel < 0 ? wheelForces() : data.panels[panel]);

  function curves() {
    const { c, width, height } = cleared(element("forces"));
    const { label, curves: here } = shown();
    const X = (t) => LEFT + ((t - data.time[0]) / span) * (width - LEFT - RIGHT);
    const [low, high] = here.map((one) => one.extremes).reduce(([least, most], [a, b]) => [
      finite(a).reduce((m, v) => Math.min(m, v), least), finite(b).reduce((m, v) => Math.max(m, v), most),
    ], [0, 0]);
    const wide = high - low || 1, top = high + 0.05 * wide, bottom = low < 0 ? low - 0.05 * wide : 0;
    const Y = (v) => TOP + ((top - v) / (top - bottom)) * (height - TOP - BOTTOM);
    const step = ticks(top - bottom);
    for (let k = Math.ceil(bottom / step); k * step <= top; k++) {
      line(c, [[LEFT, Y(k * step)], [width - RIGHT, Y(k * step)]], k ? "#e6eaee" : SOFT, 1);
      words(c, String(Number((k * step).toPrecision(6))), LEFT - 6, Y(k * step) + 4, "right");
    }
    const apart = ticks(span);
    for (let t = Math.ceil(data.time[0] / apart) * apart; t <= data.time[last] + 1e-9; t += apart) {
      words(c, String(Number(t.toPrecision(6))), X(t), height - 14);
    }
    words(c, "time (s)", width - RIGHT + 30, height - 14, "left", SOFT);
    words(c, label, LEFT + 6, TOP + 2, "left", SOFT);
    here.forEach((one, i) => {
      const color = COLORS[i % COLORS.length], dash = DASHES[i % DASHES.length];
      const [least, most] = one.extremes;
      let points = [];
      for (let k = 0; k <= last + 1; k++) { // what is not known parts the line
        if (k > last || least[k] === null || most[k] === null) {
          if (points.length) line(c, points, color, 1.2, dash);
          points = [];
          continue;
        }
        points.push([X(data.time[k]), Y(least[k])]);
        if (most[k] !== least[k]) points.push([X(data.time[k]), Y(most[k])]);
      }
      if (i < 12) {
        const y = TOP + 8 + 16 * i;
        line(c, [[width - RIGHT + 8, y], [width - RIGHT + 40, y]], color, 1.5, dash);
        words(c, one.name, width - RIGHT + 46, y + 4, "left");
      }
    });
    line(c, [[X(data.time[frame]), TOP], [X(data.time[frame]), height - BOTTOM]], INK, 1);
  }

  function ticks(most) {
    const power = Math.pow(10, Math.floor(Math.log10(most / 4)));
    return [1, 2, 5, 10].map((d) => d * power).find((d) => most / d <= 6) || most;
  }

  // --- time ---------------------------------------------------------------------------------

  function show(k) {
    frame = Math.max(0, Math.min(last, Math.round(k)));
    element("time").value = String(frame);
    element("now").textContent = data.time[frame].toFixed(4) + " of " + data.time[last].toFixed(3) + " s";
    document.body.dataset.frame = String(frame);
    train();
    curves();
  }

  function play(wanted) {
    element("play").textContent = wanted ? "stop" : "play";
    playing = null;
    if (!wanted) return;
    if (frame === last) show(0);
    const mine = (playing = {});
    const from = data.time[frame];
    let begun = null;
    const next = (now) => {
      if (playing !== mine) return;
      begun = begun === null ? now : begun;
      const t = from + ((now - begun) / 1e3) * Number(element("pace").value);
      show(((t - data.time[0]) / span) * last);
      if (t >= data.time[last]) play(false);
      else requestAnimationFrame(next);
    };
    requestAnimationFrame(next);
  }

  function scrub(event) {
    const box = element("forces").getBoundingClientRect();
    const part = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
    play(false);
    show(part * last);
  }

  for (const id of ["train", "forces"]) element(id).dataset.height = element(id).getAttribute("height");
  element("time").max = String(last);
  options(element("shown"), [["contact forces", -1], ...data.panels.map((p, k) => [p.label, k])], panel);
  element("shown").addEventListener("change", (e) => { panel = Number(e.target.value); show(frame); });
  options(element("side"), data.sides.map((s) => [s, s]), side);
  // About ten seconds for all of it, and so that deflections are some centimetres on the screen.
  const paces = [1, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.001];
  options(element("pace"), paces.map((p) => [p + " ×", p]), paces.find((p) => span / p >= 10) || 0.001);
  const scales = [1, 10, 50, 100, 200, 500, 1000, 2000, 5000, 10000];
  scale = scales.filter((s) => s * mostDown <= 0.7).pop() || 1;
  options(element("scale"), scales.map((s) => [s + " ×", s]), scale);
  element("play").addEventListener("click", () => play(playing === null));
  element("time").addEventListener("input", (e) => { play(false); show(Number(e.target.value)); });
  element("side").addEventListener("change", (e) => { side = e.target.value; show(frame); });
  element("scale").addEventListener("change", (e) => { scale = Number(e.target.value); show(frame); });
  element("pace").addEventListener("change", () => play(playing !== null));
  element("forces").addEventListener("pointerdown", scrub);
  element("forces").addEventListener("pointermove", (e) => { if (e.buttons) scrub(e); });
  window.addEventListener("resize", () => show(frame));
  window.addEventListener("keydown", (e) => {
    if (e.target.tagName === "SELECT") return;
    if (e.key === " ") { e.preventDefault(); play(playing === null); }
    if (e.key === "ArrowRight" || e.key === "ArrowLeft") {
      e.preventDefault();
      play(false);
      show(frame + (e.key === "ArrowRight" ? 1 : -1));
    }
  });
  show(0);
})();
