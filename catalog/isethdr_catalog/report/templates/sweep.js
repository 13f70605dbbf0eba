"use strict";
// The page of a sweep: any score against any parameter, and a table that sorts.
const data = JSON.parse(document.getElementById("sweep-data").textContent);
const SVG = "http://www.w3.org/2000/svg";
// Okabe and Ito 2008: distinct for readers with any colour vision, on white and on black
const COLOURS = ["#0f7bb8", "#e07b00", "#00a07a", "#cc79a7", "#56b4e9", "#c9a800", "#d55e00", "#8a8f98"];
const byId = (id) => document.getElementById(id);
const select = { x: byId("x"), y: byId("y"), colour: byId("colour") };

function node(name, attributes, parent, text) {
  const made = document.createElementNS(SVG, name);
  for (const key in attributes) made.setAttribute(key, attributes[key]);
  if (text !== undefined) made.textContent = text;
  if (parent) parent.appendChild(made);
  return made;
}

function option(list, value, text) {
  const made = document.createElement("option");
  made.value = value;
  made.textContent = text;
  list.appendChild(made);
}

function number(value) {
  if (value === null || value === undefined) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) return value.toExponential(2).replace("e+", "e");
  return String(Number(value.toPrecision(4)));
}

function scored(row, name) {
  const score = row.scores[name];
  if (!score || score[0] === null) return "";
  const half = score[1] === null || score[2] === null ? 0 : (score[2] - score[1]) / 2;
  return number(score[0]) + (half > 1e-9 * Math.abs(score[0]) ? " ± " + Number(half.toPrecision(1)) : "");
}

const unitOf = Object.fromEntries(data.scores.map((s) => [s.name, s.unit]));
const titled = (name) => name + (unitOf[name] ? " (" + unitOf[name] + ")" : "");
const described = (row) =>
  data.parameters.map((p) => p + "=" + row.parameters[p]).concat(data.cameras ? [row.camera] : []).join(", ");

// --- axes -----------------------------------------------------------------------------------------

function axisOf(kind, name) {
  // Return the axis of a parameter or a score: names at equal distances, or numbers on a scale.
  if (kind === "score") {
    const ends = data.rows.flatMap((r) => (r.scores[name] || []).filter((v) => v !== null));
    return scale(ends, (r) => (r.scores[name] || [null])[0], titled(name));
  }
  const values = [...new Set(data.rows.map((r) => r.parameters[name]))];
  const numbers = values.map(Number);
  if (values.every((v) => v !== "" && isFinite(Number(v))) && values.length > 1)
    return scale(numbers, (r) => Number(r.parameters[name]), name);
  return { title: name, of: (r) => (values.indexOf(r.parameters[name]) + 0.5) / values.length,
    at: null, ticks: values.map((v, k) => [(k + 0.5) / values.length, v]) };
}

function scale(numbers, value, title) {
  let low = Math.min(...numbers), high = Math.max(...numbers);
  const log = low > 0 && high / low >= 20;
  if (!isFinite(low)) { low = 0; high = 1; }
  const forth = log ? Math.log10 : (v) => v;
  let a = forth(low), b = forth(high);
  const room = (b - a) * 0.06 || Math.abs(a) * 0.06 || 1;
  a -= room; b += room;
  const at = (v) => (forth(v) - a) / (b - a);
  const marks = log ? logTicks(a, b) : linearTicks(a, b);
  return { title, at, ticks: marks.map((v) => [at(v), number(v)]),
    of: (r) => { const v = value(r); return v === null || v === undefined ? null : at(v); } };
}

function linearTicks(a, b) {
  const raw = (b - a) / 5, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= raw);
  const ticks = [];
  for (let k = Math.ceil(a / step); k * step <= b; k++) ticks.push(k * step);
  return ticks;
}

function logTicks(a, b) {
  const ticks = [], few = b - a < 2.5;
  for (let e = Math.floor(a); e <= Math.ceil(b); e++)
    for (const k of few ? [1, 2, 5] : [1]) {
      const v = k * 10 ** e;
      if (Math.log10(v) >= a && Math.log10(v) <= b) ticks.push(v);
    }
  return ticks;
}

// --- plot -----------------------------------------------------------------------------------------

function draw() {
  const box = byId("plot");
  box.replaceChildren();
  const width = Math.max(box.clientWidth, 280), height = Math.min(440, Math.max(280, width * 0.5));
  const left = 64, right = 14, top = 10, bottom = 46;
  const [kind, name] = select.x.value.split(/:(.*)/s);
  const x = axisOf(kind, name), y = axisOf("score", select.y.value);
  const svg = node("svg", { viewBox: `0 0 ${width} ${height}`, width, height, role: "img" }, box);
  node("title", {}, svg, `${y.title} against ${x.title}`);
  const px = (u) => left + u * (width - left - right), py = (v) => height - bottom - v * (height - top - bottom);
  const line = { stroke: "currentColor", "stroke-opacity": 0.2 };
  // write every nth name only, so that names do not overlap
  const every = Math.ceil((Math.max(...x.ticks.map((t) => t[1].length)) * 7 + 8) * x.ticks.length / (width - left - right));
  x.ticks.forEach(([u, text], k) => {
    node("line", { x1: px(u), x2: px(u), y1: top, y2: height - bottom, ...line }, svg);
    if (k % every === 0)
      node("text", { x: px(u), y: height - bottom + 16, "text-anchor": "middle" }, svg, text);
  });
  for (const [v, text] of y.ticks) {
    node("line", { x1: left, x2: width - right, y1: py(v), y2: py(v), ...line }, svg);
    node("text", { x: left - 6, y: py(v) + 4, "text-anchor": "end" }, svg, text);
  }
  node("text", { x: (left + width - right) / 2, y: height - 8, "text-anchor": "middle" }, svg, x.title);
  node("text", { x: 0, y: 0, "text-anchor": "middle",
    transform: `translate(13 ${(top + height - bottom) / 2}) rotate(-90)` }, svg, y.title);
  const groupOf = colourOf();
  const groups = [...new Set(data.rows.map(groupOf))];
  legend(groups);
  for (const row of data.rows) {
    const u = x.of(row), v = y.of(row), score = row.scores[select.y.value];
    if (u === null || v === null) continue;
    const k = groups.indexOf(groupOf(row));
    // draw rows of one value side by side
    const shift = groups.length > 1 && !x.at ? ((k + 0.5) / groups.length - 0.5) * 0.5 * (width - left - right) / x.ticks.length : 0;
    const colour = COLOURS[k % COLOURS.length], cx = px(u) + shift;
    if (score[1] !== null && score[2] !== null)
      node("line", { x1: cx, x2: cx, y1: py(y.at(score[1])), y2: py(y.at(score[2])), stroke: colour, "stroke-width": 2 }, svg);
    const link = node("a", row.report ? { href: row.report } : { tabindex: 0 }, svg);
    const mark = node("circle", { cx, cy: py(v), r: 5.5, fill: colour }, link);
    const said = `${described(row)}: ${select.y.value} ${scored(row, select.y.value)} ${unitOf[select.y.value]}`;
    node("title", {}, mark, said);
    for (const event of ["mouseenter", "focus", "touchstart"])
      link.addEventListener(event, () => { byId("readout").textContent = said; }, { passive: true });
  }
}

function colourOf() {
  const by = select.colour.value;
  if (by === "") return () => "";
  return by === "camera:" ? (r) => r.camera : (r) => r.parameters[by.slice(2)];
}

function legend(groups) {
  const box = byId("legend");
  box.replaceChildren();
  if (groups.length < 2) return;
  groups.forEach((group, k) => {
    const entry = document.createElement("span"), mark = document.createElement("b");
    mark.textContent = "● ";
    mark.style.color = COLOURS[k % COLOURS.length];
    entry.append(mark, group);
    box.appendChild(entry);
  });
}

// --- table ----------------------------------------------------------------------------------------

let order = { column: 0, up: true };

function table() {
  const columns = [{ title: "report", text: (r) => String(r.job), key: (r) => r.job, link: true }];
  for (const p of data.parameters)
    columns.push({ title: p, text: (r) => r.parameters[p], key: (r) => (isFinite(Number(r.parameters[p])) ? Number(r.parameters[p]) : r.parameters[p]) });
  if (data.cameras) columns.push({ title: "camera", text: (r) => r.camera, key: (r) => r.camera });
  for (const s of data.scores)
    columns.push({ title: titled(s.name), numeric: true, text: (r) => scored(r, s.name),
      key: (r) => (r.scores[s.name] && r.scores[s.name][0] !== null ? r.scores[s.name][0] : Infinity) });
  const rows = [...data.rows].sort((a, b) => {
    const u = columns[order.column].key(a), v = columns[order.column].key(b);
    return (u < v ? -1 : u > v ? 1 : a.job - b.job) * (order.up ? 1 : -1);
  });
  const all = byId("all");
  all.replaceChildren();
  const head = all.createTHead().insertRow();
  columns.forEach((column, k) => {
    const cell = document.createElement("th"), button = document.createElement("button");
    button.textContent = column.title + (k === order.column ? (order.up ? " ▲" : " ▼") : "");
    button.addEventListener("click", () => {
      order = { column: k, up: k === order.column ? !order.up : true };
      table();
    });
    if (column.numeric) cell.className = "n";
    cell.appendChild(button);
    head.appendChild(cell);
  });
  const body = all.createTBody();
  for (const row of rows) {
    const line = body.insertRow();
    for (const column of columns) {
      const cell = line.insertCell();
      if (column.numeric) cell.className = "n";
      if (column.link && row.report) {
        const link = document.createElement("a");
        link.href = row.report;
        link.textContent = column.text(row);
        cell.appendChild(link);
      } else cell.textContent = column.text(row);
    }
  }
}

// --- start ----------------------------------------------------------------------------------------

for (const p of data.parameters) option(select.x, "parameter:" + p, p);
for (const s of data.scores) {
  option(select.x, "score:" + s.name, titled(s.name));
  option(select.y, s.name, titled(s.name));
}
option(select.colour, "", "one");
if (data.cameras) option(select.colour, "camera:", "camera");
for (const p of data.parameters) option(select.colour, "p:" + p, p);
// at first, the parameter with most values is the x axis, and another one sets the colour
const most = [...data.parameters].sort((a, b) => count(b) - count(a));
function count(p) { return new Set(data.rows.map((r) => r.parameters[p])).size; }
if (most.length) select.x.value = "parameter:" + most[0];
select.colour.value = data.cameras ? "camera:" : most.length > 1 ? "p:" + most[1] : "";
for (const list of Object.values(select)) list.addEventListener("change", draw);
window.addEventListener("resize", draw);
if (data.scores.length) draw();
table();
