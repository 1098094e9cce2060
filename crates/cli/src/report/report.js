"use strict";
// Tables sort and filter, films play, figures show the value next to the pointer. All of it works with the keyboard.

const element = (name, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
};

const UNITS = { s: 1, min: 60, h: 3600 };
// The number at the beginning of a cell, in seconds if it is a time; NaN if there is none.
const number = (text) => {
  const found = /^\s*([+-]?[\d.]+(?:e[+-]?\d+)?)\s*(s|min|h)?\b/i.exec(text.replace("\u2212", "-"));
  return found ? Number(found[1]) * (UNITS[found[2]] ?? 1) : NaN;
};

function sortable(table) {
  const body = table.tBodies[0];
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    const button = element("button", { type: "button" }, ...head.childNodes);
    if (!button.textContent) button.ariaLabel = `column ${column + 1}`;
    head.append(button);
    button.addEventListener("click", () => {
      const descends = head.getAttribute("aria-sort") === "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", descends ? "descending" : "ascending");
      const keys = [...body.rows].map((row) => {
        const text = row.cells[column]?.textContent ?? "";
        return { row, text, value: number(text) };
      });
      const empty = (key) => key.text === "" || key.text === "-";
      keys.sort((a, b) => {
        // What is missing stays last in both directions.
        if (empty(a) || empty(b)) return empty(a) - empty(b);
        const words = a.text.localeCompare(b.text);
        const order = isNaN(a.value) || isNaN(b.value) ? words : a.value - b.value || words;
        return descends ? -order : order;
      });
      body.append(...keys.map((key) => key.row));
    });
  });
}

function filters(wrapper) {
  const table = wrapper.querySelector("table");
  const rows = [...table.tBodies[0].rows];
  const heads = [...table.tHead.rows[0].cells];
  const search = element("input", { type: "search" });
  const bar = element("div", { className: "filters" }, element("label", {}, "Search", search));
  const choices = [];
  heads.forEach((head, column) => {
    const values = [...new Set(rows.map((row) => row.cells[column].textContent))];
    if (choices.length >= 6 || values.length < 2 || values.length > 12 || values.length > rows.length / 2) return;
    values.sort((a, b) => number(a) - number(b) || a.localeCompare(b));
    const select = element("select", {}, element("option", { value: "" }, "all"));
    values.forEach((value) => select.append(element("option", { value: "=" + value }, value || "(none)")));
    choices.push([column, select]);
    bar.append(element("label", {}, head.textContent, select));
  });
  const count = element("output", { className: "soft" });
  bar.append(count);
  const apply = () => {
    const words = search.value.toLowerCase().split(/\s+/);
    rows.forEach((row) => {
      const text = row.textContent.toLowerCase();
      const fits = ([column, select]) => !select.value || "=" + row.cells[column].textContent === select.value;
      row.hidden = !(words.every((word) => text.includes(word)) && choices.every(fits));
    });
    count.textContent = `${rows.filter((row) => !row.hidden).length} of ${rows.length} rows`;
  };
  bar.addEventListener("input", apply);
  apply();
  wrapper.before(bar);
}

function film(section) {
  const strip = section.querySelector(".strip");
  const frames = [...strip.querySelectorAll("img")];
  const last = frames.length - 1;
  const name = section.getAttribute("aria-label");
  const view = element("img", { className: "view" });
  const slider = element("input", { type: "range", min: 0, max: last, value: last, ariaLabel: name });
  const text = element("output");
  const play = element("button", { type: "button", className: "plain" }, "Play");
  let timer = 0;
  const show = () => {
    const frame = frames[slider.value];
    view.src = frame.src;
    view.alt = frame.alt;
    text.textContent = frame.alt.slice(frame.alt.indexOf(", step") + 2);
    slider.setAttribute("aria-valuetext", text.textContent);
    frames.forEach((other) => other.classList.toggle("shown", other === frame));
  };
  const stop = () => {
    clearInterval(timer);
    timer = 0;
    play.textContent = "Play";
  };
  play.addEventListener("click", () => {
    if (timer) return stop();
    play.textContent = "Pause";
    timer = setInterval(() => {
      slider.value = Number(slider.value) < last ? Number(slider.value) + 1 : 0;
      show();
    }, 120);
  });
  slider.addEventListener("input", () => (stop(), show()));
  strip.addEventListener("click", (event) => {
    const at = frames.indexOf(event.target);
    if (at >= 0) {
      stop();
      slider.value = at;
      show();
    }
  });
  section.classList.add("moves");
  const controls = element("div", { className: "controls" }, play, slider, text);
  strip.before(view, controls);
  if (last === 0) controls.replaceChildren(text);
  show();
}

function readable(figure) {
  const source = figure.querySelector('script[type="application/json"]');
  const plot = figure.querySelector(".plot");
  const drawing = plot.querySelector("svg");
  if (!source) return;
  const { axes, curves } = JSON.parse(source.textContent);
  const points = curves.flatMap((curve, of) => curve.points.map((point, at) => ({ of, at, point })));
  if (!points.length) return;
  const tip = element("div", { className: "tip", hidden: true });
  tip.setAttribute("role", "status");
  figure.append(tip);
  const shape = (name, className) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", name);
    made.setAttribute("class", className);
    return made;
  };
  const hair = shape("line", "hair");
  const mark = shape("circle", "mark");
  mark.setAttribute("r", 9);
  const [, , width, height] = drawing.getAttribute("viewBox").split(" ").map(Number);
  const bottom = Math.max(...points.map(({ point }) => point[1]));
  let shown = null;

  const labels = axes.map((label) => {
    const [, name, unit] = /^(.*?)(?:\s*\(([^()]*)\))?$/.exec(label);
    return [name.split(" = ")[0] || "value", unit && unit !== "-" ? " " + unit : ""];
  });
  const digits = (value) => String(Number(value.toPrecision(5)));
  const hide = () => {
    shown = null;
    tip.hidden = true;
    hair.remove();
    mark.remove();
  };
  const show = (found) => {
    shown = found;
    const { label, colour } = curves[found.of];
    const [x, y, ...values] = found.point;
    const error = values[2] ? " \u00b1 " + digits(values[2]) : "";
    const line = (axis, more) => `${labels[axis][0]}: ${digits(values[axis])}${more}${labels[axis][1]}`;
    tip.replaceChildren(...(label ? [element("b", {}, label)] : []), line(0, ""), element("br"), line(1, error));
    mark.setAttribute("cx", x);
    mark.setAttribute("cy", y);
    mark.setAttribute("stroke", `rgb(${colour})`);
    for (const [name, value] of [["x1", x], ["x2", x], ["y1", y], ["y2", bottom]]) hair.setAttribute(name, value);
    drawing.append(hair, mark);
    tip.hidden = false;
    const box = drawing.getBoundingClientRect();
    const frame = figure.getBoundingClientRect();
    const left = box.left - frame.left + (x / width) * box.width;
    const top = box.top - frame.top + (y / height) * box.height;
    const beside = left + 16 + tip.offsetWidth < frame.width ? left + 16 : left - 16 - tip.offsetWidth;
    tip.style.left = Math.max(4, Math.min(beside, frame.width - tip.offsetWidth - 4)) + "px";
    tip.style.top = Math.max(4, top - tip.offsetHeight - 12) + "px";
  };
  const follow = (event) => {
    const box = drawing.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * width;
    const y = ((event.clientY - box.top) / box.height) * height;
    let best = null;
    let least = Infinity;
    for (const found of points) {
      const away = Math.hypot(found.point[0] - x, found.point[1] - y);
      if (away < least) [best, least] = [found, away];
    }
    show(best);
  };
  plot.addEventListener("pointermove", follow);
  plot.addEventListener("pointerdown", follow);
  plot.addEventListener("pointerleave", hide);
  plot.addEventListener("blur", hide);
  plot.tabIndex = 0;
  plot.setAttribute("role", "group");
  plot.setAttribute("aria-label", drawing.getAttribute("aria-label") + ": arrow keys read the values");
  const steps = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] };
  plot.addEventListener("keydown", (event) => {
    if (event.key === "Escape") return hide();
    const step = steps[event.key];
    if (!step) return;
    event.preventDefault();
    if (!shown) return show(points[0]);
    const drawn = curves.map((_, of) => of).filter((of) => curves[of].points.length);
    const of = drawn[(drawn.indexOf(shown.of) + step[0] + drawn.length) % drawn.length];
    const count = curves[of].points.length;
    const at = Math.max(0, Math.min(count - 1, shown.at + step[1]));
    show({ of, at, point: curves[of].points[at] });
  });
}

// Makes the elements below `root` move.
function enliven(root) {
  root.querySelectorAll("div.table").forEach((wrapper) => {
    sortable(wrapper.querySelector("table"));
    if ("filters" in wrapper.dataset) filters(wrapper);
  });
  root.querySelectorAll(".film").forEach(film);
  root.querySelectorAll("figure").forEach((figure) => figure.querySelector(".plot") && readable(figure));
}
enliven(document);
