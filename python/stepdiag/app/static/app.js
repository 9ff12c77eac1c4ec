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
    field.addEventListener("change", () => void take(field, status, field.files));
    place.addEventListener("dragover", (event) => {
      event.preventDefault();
      place.classList.add("over");
    });
    place.addEventListener("dragleave", () => place.classList.remove("over"));
    place.addEventListener("drop", (event) => {
      event.preventDefault();
      place.classList.remove("over");
      void take(field, status, /** @type {DragEvent} */ (event).dataTransfer?.files);
    });
  }
}

/**
 * @param {HTMLInputElement} field says where files go, and whether what is said of them is shown
 * @param {Element} status
 * @param {FileList | undefined | null} files
 */
async function take(field, status, files) {
  for (const file of files ?? []) {
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
  if (files?.length) location.reload();
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

localise();
limitSlider();
dropping();
waitForFrames();
void follow();
