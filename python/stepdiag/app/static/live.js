// @ts-check
// What lives on the pages Align and Run: everything comes from one stream of events of the server.

/**
 * @typedef {{doing: string, failure: string, question: string, answers: string[], asked: number, visit: number, visits: number,
 *   set_up: number, line: string, run: number, direction: string, index: number, points: number, point: number,
 *   position_mm: number[], reasons: string[], signal: Record<string, number>,
 *   conditions: Record<string, number>, from_nominal_um: number | null,
 *   distance_mm: number | null, cross_urad: number[] | null, limit_urad: number | null, turns: string[],
 *   is_aligned: boolean, readings: number, lost: number, planned: number, minutes_left: number | null,
 *   messages: [number, number, string][]}} LiveState
 * @typedef {{again: number} | {visit: number, line: string, point: number, points: number, um: number | null}} Reading
 */

const DOING = /** @type {Record<string, string>} */ ({
  begins: "Begins",
  waits: "Waits for the machine",
  reads: "Reads: keep still",
  asks: "Waits for you",
  paused: "Paused",
  ended: "Ended",
});
const ANSWERS = /** @type {Record<string, string>} */ ({
  confirm: "Yes, go on",
  repeat_point: "Measure again",
  keep: "Leave it as it is",
});
const CONDITIONS = /** @type {Record<string, string>} */ ({
  temperature_c: "scales, °C",
  temperature_x_c: "scale X, °C",
  temperature_y_c: "scale Y, °C",
  temperature_z_c: "scale Z, °C",
  air_temperature_c: "air, °C",
  air_pressure_hpa: "pressure, hPa",
  air_humidity_percent: "humidity, %",
});
const SMALL = 1_000; // µm from nominal, beyond which the distance itself is shown
const NAMESPACE = "http://www.w3.org/2000/svg";

/** @param {string} id @returns {HTMLElement | null} */
const place = (id) => document.getElementById(id);

/** @param {string} id @param {string} text */
function write(id, text) {
  const element = place(id);
  if (element && element.textContent !== text) element.textContent = text;
}

/** @param {number} value @param {number} digits @returns {string} */
function local(value, digits) {
  return value.toLocaleString(undefined, { minimumFractionDigits: digits, maximumFractionDigits: digits });
}

class LivePage {
  /** @param {HTMLElement} root says where the stream is */
  constructor(root) {
    this.address = root.dataset.live ?? "";
    this.aligns = "aligns" in root.dataset;
    /** @type {Map<number, {line: string, points: number, values: Map<number, number | null>}>} */
    this.visits = new Map();
    this.asked = 0;
    this.lost = -1;
    this.told = 0;
    this.shown = false;
    /** @type {AudioContext | null} */
    this.audio = null;
  }

  begin() {
    const stream = new EventSource(`${this.address}/events`);
    stream.addEventListener("state", (event) => this.show(JSON.parse(event.data)));
    stream.addEventListener("readings", (event) => this.take(JSON.parse(event.data)));
    stream.addEventListener("said", (event) => this.said(JSON.parse(event.data)));
    stream.addEventListener("error", () => write("doing", "No connection: the measurement goes on without this page"));
    place("controls")?.addEventListener("click", (event) => {
      const control = /** @type {HTMLElement} */ (event.target).dataset?.control;
      if (control) void this.ask(control, "");
    });
    place("remarks")?.addEventListener("submit", (event) => {
      event.preventDefault();
      const field = /** @type {HTMLInputElement} */ (place("remark"));
      if (field.value) void this.ask("remark", field.value);
      field.value = "";
    });
    document.addEventListener("pointerdown", () => (this.audio ??= new AudioContext()), { once: true });
  }

  /** @param {string} text all that the command said; its last line is the reason where it has ended at once */
  said(text) {
    write("said", text);
    if (!this.shown) write("doing", text.trim().split("\n").pop() ?? "");
  }

  /** @param {string} control @param {string} text */
  async ask(control, text) {
    const body = new URLSearchParams({ control, text });
    const answer = await fetch(`${this.address}/control`, { method: "POST", body });
    if (!answer.ok) write("doing", await answer.text());
  }

  /** @param {LiveState} state */
  show(state) {
    this.shown = true;
    const dark = state.distance_mm === null && state.reasons.length > 0;
    write("doing", `${DOING[state.doing] ?? state.doing}${state.failure ? `: ${state.failure}` : ""}`);
    place("doing")?.classList.toggle("paused", state.doing === "paused");
    place("doing")?.classList.toggle("failed", state.failure !== "");
    place("distance")?.classList.toggle("lost", dark);
    const near = !this.aligns && state.from_nominal_um !== null && Math.abs(state.from_nominal_um) < SMALL;
    if (dark) write("distance", "no beam");
    else if (near) write("distance", (state.from_nominal_um ?? 0) < 0 ? `−${local(-(state.from_nominal_um ?? 0), 2)}` : `+${local(state.from_nominal_um ?? 0, 2)}`);
    else write("distance", state.distance_mm === null ? "–" : local(state.distance_mm, 4));
    write("unit", dark ? "" : near ? "µm from nominal" : "mm");
    write("beside", dark ? state.reasons.join("; ") : near && state.distance_mm !== null ? `${local(state.distance_mm, 4)} mm` : "");
    if (state.line) {
      const where = `Set-up ${state.set_up}, line ${state.line}`;
      const at = state.position_mm.map((value, axis) => `${"XYZ"[axis]} ${local(value, 3)}`).join(", ");
      write("where", this.aligns ? where : `${where}, point ${state.point} (${state.index + 1} of ${state.points}): ${at} mm`);
    }
    write("signal", Object.entries(state.signal).map(([name, value]) => `${name} ${local(value, 0)} ‰`).join(", "));
    const conditions = Object.entries(state.conditions).map(([name, value]) => `${CONDITIONS[name] ?? name} ${local(value, 2)}`);
    write("conditions", conditions.join(", "));
    const bar = /** @type {HTMLProgressElement | null} */ (place("share"));
    if (bar) bar.value = state.planned ? state.readings / state.planned : 0;
    const left = state.minutes_left === null ? "" : `, about ${local(state.minutes_left, 0)} min left`;
    write("left", ` ${state.readings} of ${state.planned} readings${state.lost ? `, ${state.lost} lost` : ""}${left}`);
    if (this.lost >= 0 && state.lost > this.lost) this.sound();
    this.lost = state.lost;
    this.question(state);
    this.cross(state);
    this.turns(state);
    this.messages(state.messages);
    const ended = place("ended");
    if (ended) ended.hidden = state.doing !== "ended";
    for (const id of ["controls", "remarks"]) {
      const element = place(id);
      if (element) element.hidden = state.doing === "ended";
    }
    const resume = place("resume");
    if (resume) resume.hidden = state.readings >= state.planned;
  }

  /** @param {LiveState} state */
  question(state) {
    const box = place("asks");
    const answers = place("answers");
    if (!box || !answers) return;
    box.hidden = !state.question;
    if (!state.question || state.asked === this.asked) return;
    this.asked = state.asked;
    write("question", state.question);
    const buttons = state.answers.map((answer, k) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = ANSWERS[answer] ?? answer;
      if (k === 0) button.className = "main";
      button.addEventListener("click", () => void this.ask(answer, answer === "repeat_point" ? "" : String(state.asked)));
      return button;
    });
    answers.replaceChildren(...buttons);
  }

  /** @param {LiveState} state */
  cross(state) {
    const figure = place("cross");
    const spot = place("cross-spot");
    if (!figure || !spot) return;
    figure.hidden = state.cross_urad === null;
    spot.setAttribute("visibility", state.cross_urad === null ? "hidden" : "visible");
    if (state.cross_urad === null) return;
    const [right, up] = state.cross_urad;
    const size = Math.hypot(right, up);
    const limit = state.limit_urad ?? 1000;
    // Half of the radius is the limit; what is far out stands at the edge.
    const scale = Math.min(50 / limit, 96 / Math.max(size, 1));
    spot.setAttribute("cx", (right * scale).toFixed(1));
    spot.setAttribute("cy", (-up * scale).toFixed(1));
    const within = size <= limit;
    spot.classList.toggle("out", state.limit_urad !== null && !within);
    place("cross-limit")?.setAttribute("visibility", state.limit_urad === null ? "hidden" : "visible");
    const words = state.limit_urad === null ? "" : within ? `, within ${local(limit, 0)}` : `, above ${local(limit, 0)}`;
    const sideways = `${local(Math.abs(right), 0)} µrad ${right < 0 ? "left" : "right"}`;
    const upward = `${local(Math.abs(up), 0)} ${up < 0 ? "down" : "up"}`;
    write("cross-said", `Mirror against the beam: ${sideways}, ${upward}${words}`);
  }

  /** @param {LiveState} state */
  turns(state) {
    const list = place("turns");
    if (!list) return;
    list.hidden = state.turns.length === 0;
    list.classList.toggle("good", state.is_aligned);
    const words = state.is_aligned ? [...state.turns, "✓ ready"] : state.turns;
    if (list.textContent === words.join("")) return;
    list.replaceChildren(...words.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  }

  /** @param {[number, number, string][]} messages */
  messages(messages) {
    const list = place("messages");
    if (!list) return;
    for (const [number, seconds, text] of messages) {
      if (number <= this.told) continue;
      this.told = number;
      const item = document.createElement("li");
      const time = document.createElement("time");
      time.textContent = new Date(1000 * seconds).toLocaleTimeString();
      item.append(time, ` ${text}`);
      item.classList.toggle("warns", text.startsWith("warning:") || text.includes("lost:"));
      list.prepend(item);
    }
  }

  /** @param {Reading[]} readings */
  take(readings) {
    for (const reading of readings) {
      if ("again" in reading) {
        for (const visit of [...this.visits.keys()]) if (visit >= reading.again) this.visits.delete(visit);
        continue;
      }
      const own = this.visits.get(reading.visit) ?? { line: reading.line, points: reading.points, values: new Map() };
      own.values.set(reading.point, reading.um);
      this.visits.set(reading.visit, own);
    }
    this.draw();
  }

  /** All lines so far: the one of now strong, the others thin, lost points as crosses at the bottom. */
  draw() {
    const figure = place("deviations");
    if (!figure || this.visits.size === 0) return;
    const [left, right, top, bottom] = [64, 712, 10, 232];
    /** @type {number[]} */
    const all = [];
    for (const one of this.visits.values()) for (const value of one.values.values()) if (value !== null) all.push(value);
    const low = Math.min(0, ...all);
    const high = Math.max(0, ...all, low + 1);
    const most = Math.max(...[...this.visits.values()].map((one) => one.points)) - 1;
    /** @param {number} point @param {number} points */
    const x = (point, points) => left + ((right - left) * point * (most / Math.max(points - 1, 1))) / Math.max(most, 1);
    /** @param {number} value */
    const y = (value) => bottom - ((bottom - top) * (value - low)) / (high - low);
    /** @param {string} name @param {Record<string, string | number>} attributes @param {string} [text] */
    const element = (name, attributes, text) => {
      const made = document.createElementNS(NAMESPACE, name);
      for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
      if (text !== undefined) made.textContent = text;
      return made;
    };
    const parts = [];
    for (const value of new Set([low, 0, high])) {
      parts.push(element("line", { x1: left, x2: right, y1: y(value), y2: y(value), class: "grid" }));
      const apart = value === 0 || Math.abs(y(value) - y(0)) > 14;
      if (apart) parts.push(element("text", { x: left - 6, y: y(value) + 4, "text-anchor": "end" }, local(value, 1)));
    }
    parts.push(element("text", { x: right, y: 254, "text-anchor": "end" }, `point ${most}`));
    parts.push(element("text", { x: left, y: 254 }, "point 0"));
    const last = Math.max(...this.visits.keys());
    for (const [visit, one] of this.visits) {
      const places = [...one.values].sort((a, b) => a[0] - b[0]);
      const drawn = places.filter(([, value]) => value !== null).map(([point, value]) => [x(point, one.points), y(value ?? 0)]);
      const points = drawn.map(([a, b]) => `${a.toFixed(1)},${b.toFixed(1)}`).join(" ");
      parts.push(element("polyline", { points, class: visit === last ? "now" : "before" }));
      if (visit === last && drawn.length > 0) {
        const [a, b] = drawn[drawn.length - 1];
        parts.push(element("circle", { cx: a, cy: b, r: 4, class: "now" }));
        parts.push(element("text", { x: Math.min(a + 8, right - 30), y: Math.max(b - 8, 20) }, one.line));
      }
      for (const [point, value] of places) {
        if (value === null) parts.push(element("text", { x: x(point, one.points), y: bottom, class: "lost", "text-anchor": "middle" }, "✕"));
      }
    }
    figure.replaceChildren(...parts);
  }

  /** A lost reading is heard, where the browser lets us: after the person has touched the page. */
  sound() {
    if (!this.audio) return;
    const tone = this.audio.createOscillator();
    const loudness = this.audio.createGain();
    tone.frequency.value = 440;
    loudness.gain.value = 0.2;
    tone.connect(loudness).connect(this.audio.destination);
    tone.start();
    tone.stop(this.audio.currentTime + 0.4);
  }
}

const root = /** @type {HTMLElement | null} */ (document.querySelector("[data-live]"));
if (root) new LivePage(root).begin();
