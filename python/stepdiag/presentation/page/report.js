"use strict";
(() => {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const { layout: common, figures, colours: meaning } = read("stepdiag-figures");
  const words = read("stepdiag-words");
  const say = (text, ...values) => words[text].replace(/\{(\d)\}/g, (_, k) => values[k]);
  const decimal = (text) => (document.documentElement.lang === "de" ? String(text).replace(".", ",") : String(text));
  const root = document.documentElement;
  const config = { displayModeBar: false, responsive: false, scrollZoom: false, doubleClick: false, showTips: false };
  const byId = (id) => document.getElementById(id);
  const flat = Object.keys(figures).map(byId);
  const drawn = new Set();
  let printing = false;

  // --- times, as the reader's clock has them ---
  for (const time of document.querySelectorAll("time"))
    time.textContent = new Date(time.dateTime).toLocaleString(undefined, {
      year: "numeric", month: "2-digit", day: "2-digit", hour: "2-digit", minute: "2-digit", timeZoneName: "short",
    });

  // --- curves and other flat figures ---
  const sizeOf = (div) => ({ width: div.clientWidth, height: div.clientHeight });
  function drawFlat(div) {
    if (drawn.has(div)) return;
    drawn.add(div);
    const { data, layout } = figures[div.id];
    div.replaceChildren(); // the preview
    Plotly.newPlot(div, data, { ...common, ...layout, ...sizeOf(div) }, config);
  }
  function resize() {
    for (const div of drawn) {
      const { width, height } = sizeOf(div);
      const letters = printing ? 10 : common.font.size;
      if (div._fullLayout.width !== width || div._fullLayout.font.size !== letters)
        Plotly.relayout(div, { width, height, "font.size": letters });
    }
  }

  // --- the volume ---
  const volume = byId("figure-volume");
  const { nodes_mm: nodes, lines, worst, ...errors } = read("stepdiag-volume");
  const [nx, ny, nz] = nodes.map((n) => n.length);
  const edges = nodes.map((n) => n[n.length - 1]);
  const at = (i, j, k) => (i * ny + j) * nz + k;
  const chosen = (name) => {
    const found = document.querySelector(`input[name="${name}"]:checked`);
    return found && found.value;
  };
  const state = () => ({
    view: chosen("volume-view"),
    error: errors[chosen("volume-of") || "error_um"],
    factor: Number(byId("exaggeration").value) * 1e-3, // mm for a µm
    axis: Number(byId("slice-axis").value),
    place: Number(byId("slice-place").value),
  });
  const size = (e) => Math.hypot(...e);
  const largest = Math.max(...[errors.error_um, errors.before_um].filter(Boolean).flatMap((all) => all.map(size)));
  const colours = {
    colorscale: "Cividis", cmin: 0, cmax: largest, showscale: true,
    colorbar: { title: { text: say("error (µm)"), side: "right" }, thickness: 12, len: 0.6, outlinewidth: 0 },
  };
  const label = (p, e) => `X ${p[0]}, Y ${p[1]}, Z ${p[2]} mm<br>${size(e).toFixed(2)} µm (${e.map((c) => c.toFixed(2)).join(", ")})`;
  const path = (name, extra) => ({ type: "scatter3d", mode: "lines", name, x: [], y: [], z: [], ...extra });
  const push = (trace, p) => { trace.x.push(p[0]); trace.y.push(p[1]); trace.z.push(p[2]); };
  const gap = (trace) => push(trace, [null, null, null]);

  function box() {
    const trace = path("commanded", { line: { color: "#7b8794", width: 2 }, hoverinfo: "skip" });
    for (let a = 0; a < 3; a++)
      for (const u of [0, 1])
        for (const v of [0, 1]) {
          for (const t of [0, 1]) {
            const p = [0, 0, 0];
            p[a] = t * edges[a]; p[(a + 1) % 3] = u * edges[(a + 1) % 3]; p[(a + 2) % 3] = v * edges[(a + 2) % 3];
            push(trace, p);
          }
          gap(trace);
        }
    return trace;
  }
  function measured() {
    const trace = path("measured lines", { mode: "lines+text", line: { color: meaning.limit, width: 4, dash: "dash" }, text: [], textfont: { size: 12, color: "#1f2933" }, hoverinfo: "skip" });
    for (const { name, from, to } of lines) {
      push(trace, from); push(trace, from.map((x, d) => 0.7 * x + 0.3 * to[d])); push(trace, to); gap(trace);
      trace.text.push("", name, "", "");
    }
    return trace;
  }
  const every = (n, step) => [...Array(n).keys()].filter((k) => k % step === 0);
  function deformed({ error, factor }) {
    const trace = path("deformed", { line: { color: [], width: 3, ...colours }, text: [], hoverinfo: "text" });
    const counts = [nx, ny, nz];
    const tick = 3;
    for (let a = 0; a < 3; a++) {
      const [b, c] = [(a + 1) % 3, (a + 2) % 3];
      for (const u of every(counts[b], tick))
        for (const v of every(counts[c], tick)) {
          for (let t = 0; t < counts[a]; t++) {
            const n = [0, 0, 0];
            n[a] = t; n[b] = u; n[c] = v;
            const e = error[at(...n)], p = n.map((m, d) => nodes[d][m]);
            push(trace, p.map((x, d) => x + factor * e[d]));
            trace.line.color.push(size(e)); trace.text.push(label(p, e));
          }
          gap(trace); trace.line.color.push(0); trace.text.push("");
        }
    }
    return [trace];
  }
  function arrows({ error, factor }) {
    const shafts = path("arrows", { line: { color: [], width: 4, ...colours }, text: [], hoverinfo: "text" });
    const heads = { type: "cone", x: [], y: [], z: [], u: [], v: [], w: [], anchor: "tip", sizemode: "raw", sizeref: 1, showscale: false, cmin: 0, cmax: 1, colorscale: [[0, "#1f2933"], [1, "#1f2933"]], hoverinfo: "skip" };
    const tip = 0.022 * Math.min(...edges);
    for (const i of every(nx, 3)) for (const j of every(ny, 3)) for (const k of every(nz, 3)) {
      const e = error[at(i, j, k)], p = [nodes[0][i], nodes[1][j], nodes[2][k]], q = p.map((x, d) => x + factor * e[d]);
      push(shafts, p); push(shafts, q); gap(shafts);
      shafts.line.color.push(size(e), size(e), 0); shafts.text.push(label(p, e), label(p, e), "");
      if (factor * size(e) > 0) {
        heads.x.push(q[0]); heads.y.push(q[1]); heads.z.push(q[2]);
        const scale = Math.min(tip, factor * size(e)) / size(e);
        heads.u.push(scale * e[0]); heads.v.push(scale * e[1]); heads.w.push(scale * e[2]);
      }
    }
    return [shafts, heads];
  }
  function slice({ error, axis, place }) {
    const [b, c] = [0, 1, 2].filter((d) => d !== axis);
    const trace = { type: "surface", x: [], y: [], z: [], surfacecolor: [], text: [], hoverinfo: "text", ...colours, lighting: { ambient: 1, diffuse: 0, specular: 0 }, contours: { x: { highlight: false }, y: { highlight: false }, z: { highlight: false } } };
    for (let u = 0; u < nodes[b].length; u++) {
      const rows = { x: [], y: [], z: [], surfacecolor: [], text: [] };
      for (let v = 0; v < nodes[c].length; v++) {
        const n = [0, 0, 0];
        n[axis] = place; n[b] = u; n[c] = v;
        const e = error[at(...n)], p = n.map((m, d) => nodes[d][m]);
        rows.x.push(p[0]); rows.y.push(p[1]); rows.z.push(p[2]); rows.surfacecolor.push(size(e)); rows.text.push(label(p, e));
      }
      for (const name in rows) trace[name].push(rows[name]);
    }
    return [trace];
  }
  function worstPoint({ view, error, factor }) {
    if (!worst || error !== errors.error_um) return [];
    const moved = view === "slice" ? 0 : factor;
    const p = worst.at_mm.map((x, d) => x + moved * worst.error_um[d]);
    return [{
      type: "scatter3d", mode: "markers+text", name: "worst point", x: [p[0]], y: [p[1]], z: [p[2]],
      marker: { size: 6, color: meaning.rejected, symbol: "diamond" }, text: [say("largest: {0} µm", decimal(size(worst.error_um).toFixed(1)))],
      textposition: "top center", textfont: { size: 13, color: meaning.rejected }, hovertext: [label(worst.at_mm, worst.error_um)], hoverinfo: "text",
    }];
  }
  const VIEWS = { arrows, grid: deformed, slice };
  function traces() {
    const now = state();
    const shown = byId("show-lines") && byId("show-lines").checked ? [measured()] : [];
    return [box(), ...VIEWS[now.view](now), ...shown, ...worstPoint(now)];
  }
  function tell() {
    const { view, factor, axis, place } = state();
    const letter = "XYZ"[axis];
    byId("exaggeration-value").textContent = `× ${Math.round(factor * 1e3).toLocaleString("en").replaceAll(",", "\u202f")}`;
    byId("slice-value").textContent = `${letter} ${Number(nodes[axis][place].toFixed(1))} mm`;
    const drawnAs = say("10 µm are drawn as {0} mm", decimal(Number((10 * factor).toPrecision(3))));
    byId("volume-caption").textContent = {
      grid: say("The grid as the tool really moves; {0}. Grey: the commanded volume.", drawnAs),
      arrows: say("From commanded to actual position; {0}.", drawnAs),
      slice: say("Length of the error in the plane {0} = {1} mm.", letter, decimal(Number(nodes[axis][place].toFixed(1)))),
    }[view];
  }
  const axis3d = (k) => ({
    title: { text: `${"XYZ"[k]} (mm)` }, range: [-0.12 * Math.min(...edges), edges[k] + 0.12 * Math.min(...edges)],
    tickvals: [0, edges[k] / 2, edges[k]], backgroundcolor: "#ffffff", gridcolor: "#e4e7eb", zerolinecolor: "#e4e7eb", showspikes: false,
  });
  function drawVolume() {
    if (drawn.has(volume)) return Promise.resolve();
    drawn.add(volume);
    tell();
    const scene = { xaxis: axis3d(0), yaxis: axis3d(1), zaxis: axis3d(2), aspectmode: "data", camera: { eye: { x: -1.15, y: -1.48, z: 0.77 }, center: { x: 0, y: 0, z: -0.13 } }, dragmode: "orbit" };
    const layout = { ...common, ...sizeOf(volume), margin: { l: 0, r: 0, t: 0, b: 0 }, scene, hovermode: "closest", uirevision: "same" };
    return Plotly.newPlot(volume, traces(), layout, { ...config, displayModeBar: false });
  }
  // Browsers print no WebGL canvas: a photograph of it stands in its place on paper.
  function photograph() {
    const canvas = volume.querySelector(".gl-container canvas");
    if (!canvas) return;
    volume._fullLayout.scene._scene.glplot.redraw();
    const picture = volume.querySelector("img") || new Image();
    picture.alt = "";
    picture.className = "photograph";
    picture.src = canvas.toDataURL();
    canvas.parentElement.append(picture);
  }
  function redraw() {
    tell();
    if (drawn.has(volume)) Plotly.react(volume, traces(), volume.layout, config);
  }
  let asked = 0;
  byId("volume-controls").addEventListener("input", () => {
    cancelAnimationFrame(asked);
    asked = requestAnimationFrame(redraw);
  });
  byId("volume-controls").addEventListener("submit", (event) => event.preventDefault());

  // --- order: what is seen first is drawn first ---
  const later = window.requestIdleCallback || ((work) => setTimeout(work, 30));
  function finish() {
    return drawVolume().then(() => {
      root.dataset.drawn = "all";
      if (printing) photograph();
    });
  }
  function drawRest() {
    const next = flat.find((div) => !drawn.has(div));
    if (next) { drawFlat(next); later(drawRest); } else later(finish);
  }
  function drawAll() { flat.forEach(drawFlat); return finish(); }
  // Plotly is packed to a third of its size. The policy of the page knows the text that comes out.
  async function unpack() {
    const packed = Uint8Array.from(atob(byId("stepdiag-plotly").textContent), (letter) => letter.charCodeAt(0));
    const script = document.createElement("script");
    script.textContent = await new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
    document.head.append(script);
  }

  function paper(on) {
    if (printing === on) return;
    printing = on;
    root.classList.toggle("printing", on);
    if (on) drawAll();
    resize();
    if (on) photograph();
  }
  function start() {
    window.addEventListener("beforeprint", () => paper(true));
    window.addEventListener("afterprint", () => { if (location.hash !== "#print") paper(false); });
    if (location.hash === "#print") {
      paper(true);
    } else {
      flat.filter((div) => div.getBoundingClientRect().top < 1.2 * innerHeight).forEach(drawFlat);
      if (!drawn.size && flat.length) drawFlat(flat[0]);
      performance.mark("stepdiag-first-figure");
      later(drawRest);
      let asked2 = 0;
      window.addEventListener("resize", () => { clearTimeout(asked2); asked2 = setTimeout(resize, 100); });
    }
  }
  unpack().then(start, () => {
    byId("volume-caption").textContent = say("This browser is too old to draw it; the values are in the table below.");
  });
})();
