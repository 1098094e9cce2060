// The live page: asks for the state of the run, and for curves and pictures when there are new ones.
const byId = (id) => document.getElementById(id);
const ask = async (path, method = "GET") => {
  const headers = { "X-Turbid-Token": location.hash.slice(1) };
  const answer = await fetch(path, { method, headers, cache: "no-store" });
  if (!answer.ok) throw Object.assign(new Error(await answer.text()), { status: answer.status });
  return answer;
};
const PHASES = {
  starting: "Reading the case and placing the particles.",
  running: "Running.",
  stopping: "Stopping: the run writes a checkpoint.",
};
const shownPictures = new Map();
let drawn = 0;

const hasEnded = (state) => state.phase === "complete" || state.phase === "stopped";

async function curves(state) {
  const last = hasEnded(state);
  if (state.drawn === drawn && !last) return;
  const { figures, newest } = await (await ask("/curves")).json();
  drawn = state.drawn;
  const fresh = element("template", { innerHTML: figures });
  const old = new Map([...byId("figures").querySelectorAll("figure")].map((one) => [one.firstElementChild.textContent, one]));
  for (const figure of fresh.content.querySelectorAll("figure")) {
    const name = figure.firstElementChild.textContent;
    const before = old.get(name);
    // One that is being read stays, but at the end all are the last ones.
    if (!last && before && (before.matches(":hover") || before.contains(document.activeElement))) continue;
    const left = before ? before.querySelector(".plot").scrollLeft : 0;
    if (before) before.replaceWith(figure);
    else byId("figures").append(figure);
    readable(figure);
    figure.querySelector(".plot").scrollLeft = left;
  }
  if (last || !byId("newest").matches(":focus-within")) {
    byId("newest").innerHTML = newest;
    byId("newest").querySelectorAll("table").forEach(sortable);
  }
}

async function pictures(state) {
  for (const [at, [name, step]] of state.pictures.entries()) {
    const shown = shownPictures.get(name);
    if (shown?.step === step) continue;
    const blob = await (await ask(`/picture/${at}?${step}`)).blob();
    const image = shown?.image ?? element("img");
    const title = shown?.title ?? element("h3");
    if (!shown) byId("pictures").append(element("figure", {}, title, image));
    if (image.src) URL.revokeObjectURL(image.src);
    image.src = URL.createObjectURL(blob);
    title.textContent = image.alt = `${name.replaceAll("_", " ")}, step ${step}`;
    shownPictures.set(name, { step, image, title });
  }
}

function show(state) {
  const phase =
    state.phase === "complete" ? "Complete."
    : state.phase === "stopped" ? `Stopped after step ${state.step}. Resume with: turbid resume ${state.directory}`
    : PHASES[state.phase];
  if (byId("phase").textContent !== phase) byId("phase").textContent = phase;
  document.body.dataset.phase = state.phase;
  if (state.phase === "starting") return;
  const part = state.end ? state.step / state.end : 0;
  const percent = state.end ? `${(100 * part).toFixed(1)} %` : "";
  byId("case").textContent = state.case;
  document.title = `${percent} ${state.case}`.trim();
  byId("bar").value = part;
  byId("bar").hidden = !state.end;
  const facts = [
    ["done", percent],
    ["step", state.end ? `${state.step} of ${state.end}` : `${state.step}`],
    ["time", state.end ? state.time : ""],
    ["speed", state.controls || state.phase === "running" ? state.speed : ""],
    ["time left", state.phase === "running" && state.end ? state.left : ""],
    ["newest checkpoint", state.checkpoint === null ? "none" : `step ${state.checkpoint}`],
    ["files", state.directory],
  ].filter(([, value]) => value);
  byId("facts").replaceChildren(
    ...facts.map(([name, value]) => element("div", {}, element("dt", {}, name), element("dd", {}, value))),
  );
  byId("buttons").hidden = !state.controls;
  byId("stop").disabled = byId("yes").disabled = state.phase === "stopping";
  byId("checkpoint").disabled = state.saving || state.phase === "stopping";
  byId("saved").textContent = state.saving ? "The run writes a checkpoint." : "";
  const warnings = [...state.warnings, ...(state.error ? [state.error] : [])];
  byId("warnings").hidden = !warnings.length;
  byId("warnings").lastElementChild.replaceChildren(...warnings.map((text) => element("li", {}, text)));
}

async function poll() {
  let wait = 1000;
  try {
    const state = await (await ask("/state")).json();
    show(state);
    if (state.phase !== "starting") {
      await curves(state);
      await pictures(state);
    }
    if (hasEnded(state)) {
      if (!byId("buttons").hidden) byId("buttons").hidden = true;
      await ask("/seen", "POST");
      return;
    }
  } catch (error) {
    document.body.dataset.phase = "lost";
    byId("buttons").hidden = true;
    byId("phase").textContent = error.status
      ? `The program refuses: ${error.message}.`
      : "The program no longer answers: it has ended, or the connection is lost.";
    wait = 3000;
  }
  setTimeout(poll, wait);
}

const request = (path) => ask(path, "POST").then(() => ask("/state")).then((answer) => answer.json()).then(show, () => {});
byId("checkpoint").addEventListener("click", () => request("/checkpoint"));
const asks = (sure) => {
  byId("sure").hidden = !sure;
  byId("stop").hidden = sure;
  byId(sure ? "yes" : "stop").focus();
};
byId("stop").addEventListener("click", () => asks(true));
byId("no").addEventListener("click", () => asks(false));
byId("yes").addEventListener("click", () => {
  asks(false);
  request("/stop");
});
poll();
