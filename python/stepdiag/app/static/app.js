// @ts-check
// What lives on the pages of the application. Without it every page still shows what it has to show.

/** Days and numbers as the person's browser writes them; files and commands never have them so. */
function localise() {
  for (const time of document.querySelectorAll("time")) {
    const day = new Date(`${time.dateTime.slice(0, 10)}T12:00:00`);
    if (!Number.isNaN(day.getTime())) time.textContent = day.toLocaleDateString();
  }
  for (const data of /** @type {NodeListOf<HTMLDataElement>} */ (document.querySelectorAll("data.number"))) {
    data.textContent = localNumber(data.value);
  }
}

/**
 * @param {string} text a number with a decimal point
 * @returns {string}
 */
function localNumber(text) {
  const digits = text.split(".")[1]?.length ?? 0;
  return Number(text).toLocaleString(undefined, { minimumFractionDigits: digits, maximumFractionDigits: digits });
}

/** The answer for the limit at which the slider stands: ISO 14253-1, with 95 % on one side. */
function limitSlider() {
  const slider = /** @type {HTMLInputElement | null} */ (document.getElementById("limit-um"));
  const shown = document.getElementById("limit-value");
  const answer = document.getElementById("limit-answer");
  if (!slider || !shown || !answer) return;
  const above = Number(slider.dataset.above);
  const below = Number(slider.dataset.below);
  slider.addEventListener("input", () => {
    const limit = Number(slider.value);
    const [word, look, sign] =
      below <= limit ? ["within", "good", "✓"] : above > limit ? ["not within", "bad", "✕"] : ["undecided", "unsure", "?"];
    shown.textContent = localNumber(limit.toFixed(1));
    const mark = document.createElement("span");
    mark.className = `mark ${look}`;
    const symbol = document.createElement("span");
    symbol.setAttribute("aria-hidden", "true");
    symbol.textContent = sign;
    mark.append(symbol, ` ${word}`);
    answer.replaceChildren(mark);
  });
}

/** Files that are dropped or chosen go to the book one after the other. */
function dropping() {
  for (const field of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll(".drop input[type=file]"))) {
    const place = field.closest(".drop");
    const status = place?.querySelector("[role=status]");
    if (!place || !status) continue;
    const chosen = () => {
      const files = [...(field.files ?? [])];
      field.value = ""; // so that the same file can be chosen again
      void take(field, status, files);
    };
    field.addEventListener("change", chosen);
    if (field.files?.length) chosen(); // before this script was there
    place.addEventListener("dragover", (event) => {
      event.preventDefault();
      place.classList.add("over");
    });
    place.addEventListener("dragleave", () => place.classList.remove("over"));
    place.addEventListener("drop", (event) => {
      event.preventDefault();
      place.classList.remove("over");
      void take(field, status, [.../** @type {DragEvent} */ (event).dataTransfer?.files ?? []]);
    });
  }
}

/**
 * @param {HTMLInputElement} field says where files go, and whether what is said of them is shown
 * @param {Element} status
 * @param {File[]} files
 */
async function take(field, status, files) {
  for (const file of files) {
    status.textContent = `${file.name} …`;
    const address = `${field.dataset.target}?name=${encodeURIComponent(file.name)}`;
    const answer = await fetch(address, { method: "POST", body: file });
    if (!answer.ok) {
      status.textContent = `${file.name}: ${await answer.text()}`;
      return;
    }
    const { job } = await answer.json();
    const good = await ended(job, (doing) => (status.textContent = `${file.name}: ${doing}`));
    if (!good || "shows" in field.dataset) {
      location.assign(job);
      return;
    }
  }
  if (files.length) location.reload();
}

/**
 * Waits for the end of a command. Returns whether it did what it should.
 * @param {string} job its address
 * @param {(doing: string, share: number | null, next: string) => void} tell called again and again
 * @returns {Promise<boolean>}
 */
async function ended(job, tell) {
  for (;;) {
    const state = await (await fetch(`${job}/state`)).json();
    tell(state.doing, state.share, state.next);
    if (state.status !== null) return state.status === 0;
    await new Promise((resolve) => setTimeout(resolve, 250));
  }
}

/** On the page of a command: its progress, then its result, or what it said. */
async function follow() {
  const place = /** @type {HTMLElement | null} */ (document.querySelector("[data-job][data-running]"));
  if (!place) return;
  const doing = document.getElementById("doing");
  const bar = /** @type {HTMLProgressElement | null} */ (document.getElementById("share"));
  let result = "";
  const good = await ended(`/jobs/${place.dataset.job}`, (what, share, next) => {
    if (doing) doing.textContent = what || "working";
    if (bar && share !== null) bar.value = share;
    result = next;
  });
  if (good && result) location.replace(result);
  else location.reload();
}

/** The words under a frame go when its content is there. */
function waitForFrames() {
  for (const words of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-waits-for]"))) {
    const frame = document.getElementById(words.dataset.waitsFor ?? "");
    frame?.addEventListener("load", () => words.remove());
  }
}

/**
 * @typedef {{name: string, setUp: number, head: number[], frame: number[][], points: number[][]}} PlannedLine
 * @typedef {{projection: number[], mirror: number[], lines: PlannedLine[]}} DryRun
 */

/** The moves of a plan, slowly: mirror and beam go from point to point, over the picture of its lines. */
function dryRun() {
  const picture = /** @type {SVGSVGElement | null} */ (document.querySelector("svg[data-dry-run]"));
  const place = document.getElementById("dry-run");
  const slider = /** @type {HTMLInputElement | null} */ (document.getElementById("dry-run-at"));
  const play = document.getElementById("dry-run-play");
  const said = document.getElementById("dry-run-said");
  if (!picture || !place || !slider || !play || !said) return;
  /** @type {DryRun} */
  const run = JSON.parse(picture.dataset.dryRun ?? "");
  const moves = run.lines.flatMap((line) => line.points.map((_, at) => ({ line, at })));
  const group = document.createElementNS("http://www.w3.org/2000/svg", "g");
  const [way, beam, mirror, head] = ["polyline", "polyline", "polygon", "circle"].map((name) =>
    group.appendChild(document.createElementNS("http://www.w3.org/2000/svg", name)),
  );
  way.setAttribute("class", "way");
  beam.setAttribute("class", "beam");
  mirror.setAttribute("class", "mirror");
  head.setAttribute("class", "head");
  head.setAttribute("r", "6");
  picture.append(group);
  slider.max = `${moves.length - 1}`;
  place.hidden = false;

  /** @param {number[]} p a point in mm @returns {number[]} in the picture */
  const flat = ([x, y, z]) => {
    const m = run.projection;
    return [m[0] * x + m[1] * y + m[2] * z + m[6], m[3] * x + m[4] * y + m[5] * z + m[7]];
  };
  /** @param {number[][]} points */
  const path = (points) => points.map((p) => flat(p).map((v) => v.toFixed(1)).join(",")).join(" ");

  const show = () => {
    const number = Number(slider.value);
    const { line, at } = moves[number];
    const point = line.points[at];
    const [[right, up], [width, height]] = [line.frame, run.mirror];
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) =>
      point.map((value, k) => value + (a * width * right[k] + b * height * up[k]) / 2),
    );
    way.setAttribute("points", path(line.points.slice(0, at + 1)));
    beam.setAttribute("points", path([line.head, point]));
    mirror.setAttribute("points", path(corners));
    const [x, y] = flat(line.head);
    head.setAttribute("cx", x.toFixed(1));
    head.setAttribute("cy", y.toFixed(1));
    picture.classList.add("moving");
    const before = line.points[at - 1];
    const moved = [0, 1, 2].filter((k) => before && before[k] !== point[k]);
    const what = moved.map((k) => `${"XYZ"[k]} to ${localNumber(point[k].toFixed(1))} mm`).join(", ");
    const first = `head and mirror are placed, the axes stand at ${point.map((v) => localNumber(v.toFixed(1))).join(" / ")} mm`;
    said.textContent = `Set-up ${line.setUp}, line ${line.name}, point ${at + 1} of ${line.points.length}: ${what || first}`;
  };
  /** @type {number | undefined} */
  let timer;
  const stop = () => {
    clearInterval(timer);
    timer = undefined;
    play.textContent = "Play";
  };
  slider.addEventListener("input", () => {
    stop();
    show();
  });
  play.addEventListener("click", () => {
    if (timer !== undefined) {
      stop();
      return;
    }
    play.textContent = "Pause";
    if (Number(slider.value) >= moves.length - 1) slider.value = "0";
    show();
    timer = window.setInterval(() => {
      const next = Number(slider.value) + 1;
      if (next >= moves.length) {
        stop();
        return;
      }
      slider.value = `${next}`;
      show();
    }, 350);
  });
}

localise();
dryRun();
limitSlider();
dropping();
waitForFrames();
void follow();
