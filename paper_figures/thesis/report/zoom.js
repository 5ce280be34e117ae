
// Runs over time: a canvas for each table, whose data the page holds already. Wheel, fingers, keys and buttons zoom.
for (const part of document.querySelectorAll("details.zoom")) {
  part.addEventListener("toggle", () => part.open && !part.querySelector("canvas") && zoomable(part));
}

const COLOURS = ["#d55e00", "#0072b2", "#009e73", "#e69f00", "#cc79a7", "#56b4e9", "#000000", "#7f7f7f", "#4d4d4d"];
const SHOWN = 3; // runs that are drawn at first
const INK = "#1a1a1a";
const PALE = "#dddddd";
const MARGIN = { left: 64, right: 12, top: 20, bottom: 30, panel: 190 };

async function zoomable(part) {
  const { time, panels, runs } = series(new TextDecoder().decode(await tables.get(part.dataset.table)));
  const whole = [time[0], time.at(-1)];
  const least = 10 * Math.min(...time.slice(1).map((t, k) => t - time[k]).filter((step) => step > 0));
  let [from, to] = whole;
  let cursor = null;

  const canvas = document.createElement("canvas");
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "application");
  canvas.setAttribute("aria-roledescription", "plot over time");
  canvas.setAttribute("aria-label", `${part.dataset.table}: ${[...panels.keys()].join(", ")}`);
  const said = document.createElement("output");
  const bar = document.createElement("p");
  const keys = document.createElement("fieldset");
  const legend = document.createElement("legend");
  legend.textContent = "Runs";
  keys.append(legend);
  for (const [run, look] of runs) {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = look.shown;
    box.addEventListener("change", () => {
      look.shown = box.checked;
      draw();
    });
    label.append(box, run.replaceAll("_", " "));
    label.style.setProperty("--mark", look.colour);
    keys.append(label);
  }
  for (const [name, act] of [
    ["Zoom in", () => zoom(0.5)],
    ["Zoom out", () => zoom(2)],
    ["Earlier", () => move(-0.25)],
    ["Later", () => move(0.25)],
    ["Whole run", () => show(...whole)],
  ]) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = name;
    button.addEventListener("click", act);
    bar.append(button);
  }
  const how = document.createElement("p");
  how.className = "how";
  how.textContent =
    "Drag to move in time. Pinch, or select the plot and turn the wheel, to zoom. Keys: + and - zoom, arrows move, 0 shows the whole run.";
  part.append(keys, bar, canvas, said, how);

  const height = panels.size * MARGIN.panel + MARGIN.bottom;
  const width = () => canvas.clientWidth - MARGIN.left - MARGIN.right;
  const toTime = (x) => from + ((x - MARGIN.left) / width()) * (to - from);

  function show(first, last) {
    const span = Math.min(Math.max(last - first, least), whole[1] - whole[0]);
    from = Math.min(Math.max((first + last - span) / 2, whole[0]), whole[1] - span);
    to = from + span;
    draw();
  }

  function zoom(factor, at = (from + to) / 2) {
    show(at - (at - from) * factor, at + (to - at) * factor);
  }

  function move(share) {
    const step = share * (to - from);
    const kept = Math.min(Math.max(step, whole[0] - from), whole[1] - to);
    show(from + kept, to + kept);
  }

  function draw() {
    const ratio = devicePixelRatio;
    canvas.style.height = `${height}px`;
    canvas.width = canvas.clientWidth * ratio;
    canvas.height = height * ratio;
    const paint = canvas.getContext("2d");
    paint.scale(ratio, ratio);
    paint.fillStyle = "#ffffff";
    paint.fillRect(0, 0, canvas.clientWidth, height);
    paint.font = "12px system-ui, sans-serif";
    const begin = Math.max(time.findLastIndex((t) => t <= from), 0);
    const end = time.findIndex((t) => t >= to) + 1 || time.length;
    const toX = (t) => MARGIN.left + ((t - from) / (to - from)) * width();
    let top = MARGIN.top;
    for (const [quantity, lines] of panels) {
      const drawn = lines.filter((line) => line.look.shown);
      const visible = drawn.flatMap((line) => line.values.slice(begin, end).filter(Number.isFinite));
      const [low, high] = view(visible);
      const bottom = top + MARGIN.panel - MARGIN.top - 8;
      const toY = (value) => bottom - ((value - low) / (high - low)) * (bottom - top);
      paint.fillStyle = INK;
      paint.textAlign = "left";
      paint.fillText(quantity, MARGIN.left, top - 6);
      for (const value of ticks(low, high, 4)) line(PALE, 1, [MARGIN.left, toY(value)], [MARGIN.left + width(), toY(value)]);
      for (const t of ticks(from, to, width() / 90)) line(PALE, 1, [toX(t), top], [toX(t), bottom]);
      paint.textAlign = "right";
      for (const value of ticks(low, high, 4)) paint.fillText(short(value), MARGIN.left - 6, toY(value) + 4);
      paint.save();
      paint.beginPath();
      paint.rect(MARGIN.left, top - 1, width(), bottom - top + 2);
      paint.clip();
      for (const { values, look } of drawn) {
        paint.strokeStyle = look.colour;
        paint.lineWidth = look.width;
        paint.setLineDash(look.dash);
        paint.beginPath();
        for (let k = begin, up = true; k < end; k++) {
          if (!Number.isFinite(values[k])) up = true;
          else {
            paint[up ? "moveTo" : "lineTo"](toX(time[k]), toY(values[k]));
            up = false;
          }
        }
        paint.stroke();
        paint.setLineDash([]);
      }
      if (cursor !== null) line(INK, 0.5, [toX(cursor), top], [toX(cursor), bottom]);
      paint.restore();
      paint.strokeStyle = INK;
      paint.lineWidth = 1;
      paint.strokeRect(MARGIN.left, top, width(), bottom - top);
      top += MARGIN.panel;
    }
    paint.fillStyle = INK;
    paint.textAlign = "center";
    for (const t of ticks(from, to, width() / 90)) paint.fillText(short(t), toX(t), height - 23);
    paint.fillText("Time t [s]", MARGIN.left + width() / 2, height - 5);
    said.value = cursor === null ? `${short(from)} s to ${short(to)} s` : readout();

    function line(colour, thick, start, stop) {
      paint.strokeStyle = colour;
      paint.lineWidth = thick;
      paint.beginPath();
      paint.moveTo(...start);
      paint.lineTo(...stop);
      paint.stroke();
    }
  }

  function readout() {
    const k = Math.max(time.findLastIndex((t) => t <= cursor), 0);
    const parts = [...panels].map(([quantity, lines]) => {
      const values = lines.filter(({ look }) => look.shown).map(({ run, values }) => `${run} ${short(values[k])}`);
      return `${quantity}: ${values.join(", ")}`;
    });
    return `t = ${short(time[k])} s. ${parts.join(". ")}`;
  }

  // One finger or the mouse moves in time, two fingers zoom; a vertical stroke still scrolls the page.
  const fingers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event.offsetX);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    cursor = Math.min(Math.max(toTime(event.offsetX), from), to);
    if (before === undefined) return draw();
    const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
    fingers.set(event.pointerId, event.offsetX);
    if (other === undefined) move((before - event.offsetX) / width());
    else zoom(Math.abs(before - other) / Math.max(Math.abs(event.offsetX - other), 1), toTime((event.offsetX + other) / 2));
  });
  for (const name of ["pointerup", "pointercancel", "pointerleave"]) {
    canvas.addEventListener(name, (event) => {
      fingers.delete(event.pointerId);
      if (name === "pointerleave") cursor = null;
      draw();
    });
  }
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return; // the page scrolls
    event.preventDefault();
    zoom(Math.exp(Math.sign(event.deltaY) * 0.2), toTime(event.offsetX));
  }, { passive: false });
  const pressed = {
    "+": () => zoom(0.5),
    "=": () => zoom(0.5),
    "-": () => zoom(2),
    "0": () => show(...whole),
    ArrowLeft: () => move(-0.1),
    ArrowRight: () => move(0.1),
  };
  canvas.addEventListener("keydown", (event) => {
    if (!(event.key in pressed) || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    pressed[event.key]();
  });
  new ResizeObserver(draw).observe(bar);
}

// A table time_s, reference, QUANTITY_RUN, ... as a panel for each quantity and a look for each run.
function series(text) {
  const [head, ...body] = text.split(/\r?\n/).filter((line) => line && !line.startsWith("#")).map((line) => line.split(","));
  const columns = head.map((_, k) => body.map((row) => (row[k] === "" ? NaN : Number(row[k]))));
  const panels = new Map();
  const runs = new Map();
  head.forEach((name, k) => {
    if (k === 0) return;
    const cut = name.indexOf("_");
    const [quantity, run] = cut < 0 ? ["output", name] : [name.slice(0, cut), name.slice(cut + 1)];
    if (!runs.has(run)) runs.set(run, lookOf(run, runs.size));
    if (!panels.has(quantity)) panels.set(quantity, []);
    panels.get(quantity).push({ run, values: columns[k], look: runs.get(run) });
  });
  return { time: columns[0], panels, runs };
}

function lookOf(run, place) {
  const reference = run === "reference";
  return {
    colour: LOOKS[run] ?? COLOURS[place % COLOURS.length],
    width: run === "corrected" ? 2 : 1.2,
    dash: reference ? [4, 3] : place > COLOURS.length / 2 ? [6, 3] : [],
    shown: place < SHOWN + 1,
  };
}

function view(values) {
  let [low, high] = values.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
  if (low > high) [low, high] = [-1, 1];
  const room = 0.05 * (high - low) || Math.abs(high) || 1;
  return [low - room, high + room];
}

function ticks(low, high, count) {
  const rough = (high - low) / Math.max(count, 2);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * ([1, 2, 5, 10].find((each) => each * power >= rough) ?? 10);
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.max(Math.floor(high / step) - first + 1, 0) }, (_, k) => (first + k) * step);
}

function short(value) {
  return String(Number(value.toPrecision(5))).replace("-", "\u2212");
}
