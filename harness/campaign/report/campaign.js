"use strict";
const problems = [];
window.addEventListener("error", e => problems.push(e.message));
const c = JSON.parse(document.getElementById("data").textContent);
const page = document.getElementById("page");
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const colours = {passed: "--good", failed: "--bad", crashed: "--c3", timeout: "--c4", memory: "--c0", killed: "--c1", error: "--soft", missing: "--line"};

function element(tag, parent, text, className) {
  const e = document.createElement(tag);
  if (text !== undefined) e.textContent = text;
  if (className) e.className = className;
  if (parent) parent.appendChild(e);
  return e;
}
function shown(v) {
  if (v === null || v === undefined) return "–";
  const a = Math.abs(v);
  if (a !== 0 && (a < 1e-3 || a >= 1e6)) return v.toExponential(2);
  return String(Number(v.toPrecision(4)));
}
// Round numbers between lo and hi, about `most` of them.
function ticks(lo, hi, most) {
  if (!(hi > lo)) return [lo];
  const raw = (hi - lo) / most, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(f => f * power).find(s => s >= raw);
  const all = [];
  for (let k = Math.ceil(lo / step - 1e-9); k * step <= hi + step * 1e-9; ++k) all.push(k * step);
  return all;
}
const charts = [];
function chart(parent, height, draw, measure) {
  const canvas = element("canvas", parent);
  charts.push({canvas, measure, draw() {
    const width = canvas.clientWidth, scale = window.devicePixelRatio || 1;
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
    canvas.style.height = height + "px";
    const g = canvas.getContext("2d");
    g.scale(scale, scale);
    g.font = "11px system-ui, sans-serif";
    return draw(g, width, height);
  }});
}
const drawAll = () => charts.forEach(c => c.draw());

// Axes with labels; returns the two scales.
function axes(g, width, height, x, y, xName, yName) {
  const left = 54, right = 10, top = 8, bottom = xName ? 36 : 22;
  const X = v => left + (v - x[0]) / (x[1] - x[0] || 1) * (width - left - right);
  const Y = v => height - bottom - (v - y[0]) / (y[1] - y[0] || 1) * (height - top - bottom);
  g.strokeStyle = css("--line");
  g.fillStyle = css("--soft");
  g.lineWidth = 1;
  g.textAlign = "right";
  g.textBaseline = "middle";
  for (const v of ticks(y[0], y[1], 4)) {
    const at = Math.round(Y(v)) + 0.5;
    g.beginPath(); g.moveTo(left, at); g.lineTo(width - right, at); g.stroke();
    g.fillText(shown(v), left - 6, at);
  }
  g.textAlign = "center";
  g.textBaseline = "top";
  for (const v of ticks(x[0], x[1], Math.max(3, Math.floor(width / 80)))) g.fillText(shown(v), X(v), height - bottom + 5);
  if (xName) g.fillText(xName, left + (width - left - right) / 2, height - 15);
  if (yName) {
    g.save();
    g.translate(10, top + (height - top - bottom) / 2);
    g.rotate(-Math.PI / 2);
    g.textBaseline = "middle";
    g.fillText(yName, 0, 0);
    g.restore();
  }
  return {X, Y, left, right, top, bottom};
}
function table(parent, columns, rows, numbers) {
  const scroll = element("div", parent, undefined, "scroll");
  const t = element("table", scroll, undefined, numbers ? "numbers" : "");
  const head = element("tr", element("thead", t));
  columns.forEach(name => element("th", head, name));
  const body = element("tbody", t);
  for (const row of rows) {
    const tr = element("tr", body);
    for (const cell of row) {
      const td = element("td", tr);
      if (cell instanceof Node) td.appendChild(cell); else td.textContent = cell;
      if (cell === "passed" || cell === "failed") td.className = cell;
    }
  }
}
const code = text => element("code", null, text);

function addHead() {
  const header = element("header", page);
  element("h1", header, c.test);
  const bad = c.contradictions.length > 0, whole = c.missing === 0;
  element("span", header, bad ? "results contradict each other" : whole ? c.n + " runs" : c.n - c.missing + " of " + c.n + " runs", "result " + (bad ? "failed" : ""));
  const rate = element("div", page, undefined, "rate");
  element("b", rate, c.n > 0 ? (100 * c.passed / c.n).toFixed(c.n >= 1000 ? 2 : 1) + " %" : "–");
  element("span", rate, "passed: " + c.passed + " of " + c.n);
  element("span", rate, "with 95 % confidence between " + (100 * c.low).toFixed(2) + " % and " + (100 * c.high).toFixed(2) + " % (Clopper-Pearson)", "hint");
  const bar = element("div", page, undefined, "bar"), keys = element("figcaption", page);
  for (const [name, count] of [...c.outcomes, ["missing", c.missing]]) {
    if (count === 0) continue;
    const part = element("i", bar);
    part.style.flex = count;
    part.style.background = "var(" + colours[name] + ")";
    const key = element("span", keys, undefined, "key");
    element("i", key).style.background = "var(" + colours[name] + ")";
    element("span", key, name + " " + count);
  }
  const facts = element("div", page, undefined, "facts");
  const fact = (name, value, wide) => {
    const div = element("div", facts, undefined, wide ? "wide" : "");
    element("span", div, name);
    element("span", div, value);
  };
  fact("base seed", String(c.seed));
  fact("metrics", String(c.metrics.length));
  fact("dispersions", String(c.dispersions.length));
  fact("program", c.program, true);
  fact("SHA-256", c.sha256, true);
  if (bad) {
    element("h2", page, "The same run, another result");
    c.contradictions.forEach(text => element("p", page, text, "failed"));
  }
}
function addFailures() {
  if (c.groups.length === 0) return;
  element("h2", page, "What did not pass");
  table(page, ["runs", "outcome", "first failing assertion or crash site"], c.groups.map(g => {
    const what = element("div");
    element("b", what, g.site);
    element("pre", what, g.text);
    element("span", what, "runs " + g.runs, "hint");
    what.appendChild(code(g.replay));
    return [String(g.count), g.outcome, what];
  }));
}
function addHistogram(parent, m) {
  const figure = element("figure", parent), caption = element("figcaption", figure);
  element("b", caption, m.name);
  element("span", caption, "mean " + shown(m.mean) + ", sigma " + shown(m.sd) + (m.without ? ", " + m.without + " runs without" : ""), "key");
  if (m.n === 0) return;
  chart(figure, 190, (g, width, height) => {
    const most = Math.max(...m.counts), bins = m.counts.length;
    const span = m.high > m.low ? [m.low, m.high] : [m.low - 0.5, m.low + 0.5];
    const {X, Y} = axes(g, width, height, span, [0, most * 1.08], "", "runs");
    g.fillStyle = css("--c0");
    const step = (span[1] - span[0]) / bins, edges = m.counts.map((_, i) => [X(span[0] + i * step), X(span[0] + (i + 1) * step)]);
    m.counts.forEach((n, i) => {
      const [x0, x1] = edges[i];
      g.fillRect(x0 + 0.5, Y(n), Math.max(1, x1 - x0 - 1), Y(0) - Y(n));
    });
    for (const [percent, colour] of [[50, "--ink"], [95, "--bad"]]) {
      const v = m.quantiles.find(q => q[0] === percent)[1], x = Math.round(X(v)) + 0.5;
      g.strokeStyle = css(colour);
      g.setLineDash([4, 3]);
      g.beginPath(); g.moveTo(x, 8); g.lineTo(x, Y(0)); g.stroke();
      g.setLineDash([]);
      g.fillStyle = css(colour);
      g.textAlign = x > width - 50 ? "right" : "left";
      g.textBaseline = "top";
      g.fillText(percent + " %", x + (x > width - 50 ? -4 : 4), 8 + (percent === 95 ? 12 : 0));
    }
    return {edges, perRun: Y(0) - Y(1)};
  }, (pixels, {edges, perRun}) => ({histogram: m.name, pixel: 1 / perRun,
    runs: edges.map(([x0, x1]) => pixels.tallest("--c0", x0, x1) / perRun)}));
  const line = element("div", figure, undefined, "quantiles");
  m.quantiles.forEach(([p, v]) => {
    const key = element("span", line, undefined, "key");
    element("span", key, (p === 100 ? "largest " : p + " % "));
    element("span", key, shown(v));
  });
}
function addScatter(parent, metric, dispersion, rho) {
  const m = c.metrics[metric], d = c.dispersions[dispersion];
  const figure = element("figure", parent), caption = element("figcaption", figure);
  element("b", caption, m.name + " over " + d.name);
  element("span", caption, "rank correlation " + rho.toFixed(2), "key");
  chart(figure, 210, (g, width, height) => {
    const range = values => {
      let lo = Infinity, hi = -Infinity;
      for (const v of values) if (v !== null) { lo = Math.min(lo, v); hi = Math.max(hi, v); }
      const pad = (hi - lo || Math.abs(hi) || 1) * 0.04;
      return [lo - pad, hi + pad];
    };
    const {X, Y} = axes(g, width, height, range(d.values), range(m.values), d.name, m.name);
    const size = c.runs.length > 2000 ? 1.5 : c.runs.length > 300 ? 2.2 : 3.2;
    for (const failed of [0, 1]) {
      g.fillStyle = css(failed ? "--bad" : "--c0");
      g.globalAlpha = c.runs.length > 300 && !failed ? 0.5 : 0.9;
      for (let i = 0; i < c.runs.length; ++i) {
        if (c.failed[i] !== failed || m.values[i] === null || d.values[i] === null) continue;
        g.fillRect(X(d.values[i]) - size / 2, Y(m.values[i]) - size / 2, size, size);
      }
    }
    g.globalAlpha = 1;
    return {X, Y};
  }, (pixels, {X, Y}) => {
    const at = i => [X(d.values[i]), Y(m.values[i])], both = c.runs.map((_, i) => i).filter(i => m.values[i] !== null && d.values[i] !== null);
    return {scatter: m.name + " over " + d.name, dots: both.length,
      shown: both.filter(i => pixels.is("--c0", ...at(i)) || pixels.is("--bad", ...at(i))).length,
      failed: both.filter(i => c.failed[i] && pixels.is("--bad", ...at(i))).length};
  });
}
function addImportance() {
  if (c.dispersions.length === 0) return;
  element("h2", page, "Dispersions");
  const names = [...c.metrics.map(m => m.name), "having failed"];
  const by = c.dispersions.map(() => []);
  for (const [m, d, rho] of c.correlations) by[d][m] = rho;
  table(page, ["parameter", "distribution", ...names], c.dispersions.map((d, i) =>
    [d.name, d.distribution, ...names.map((_, m) => {
      const rho = by[i][m] ?? 0, cell = element("span", null, rho.toFixed(2).replace("-0.00", "0.00"));
      cell.style.color = Math.abs(rho) >= c.least ? "var(--ink)" : "var(--soft)";
      cell.style.fontWeight = Math.abs(rho) >= c.least ? "600" : "400";
      return cell;
    })]), true);
  element("p", page, "Spearman's rank correlation. Bold: beyond what " + c.runs.length + " runs show by chance once in a thousand (" + c.least.toFixed(2) + ").", "hint");
}
function addWorst() {
  const rows = list => list.map(([run, seed, value, outcome, replay]) => [String(run), String(seed), shown(value), outcome, code(replay)]);
  element("h2", page, "Worst runs");
  if (c.metrics.length > 0) {
    const select = element("select", page), place = element("div", page);
    c.metrics.forEach((m, i) => { element("option", select, "largest " + m.name).value = i; });
    const show = () => {
      place.textContent = "";
      table(place, ["run", "seed", c.metrics[select.value].name, "outcome", "replay"], rows(c.worst[select.value]));
    };
    select.addEventListener("change", show);
    show();
  }
  element("h2", page, "Slowest runs");
  table(page, ["run", "seed", "host time s", "outcome", "replay"], rows(c.slowest));
}

document.title = c.test + ": campaign";
addHead();
addFailures();
if (c.metrics.length > 0) {
  element("h2", page, "Metrics");
  const grid = element("div", page, undefined, "grid");
  c.metrics.forEach(m => addHistogram(grid, m));
}
addImportance();
if (c.scatters.length > 0) {
  element("h2", page, "Metrics over dispersions, strongest first");
  const grid = element("div", page, undefined, "grid scatters");
  c.scatters.forEach(([m, d, rho]) => addScatter(grid, m, d, rho));
}
addWorst();
drawAll();
window.addEventListener("resize", drawAll);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);

// ---- with #selftest, for the tests of this page: what the canvases show, read back from their pixels
class Pixels {
  constructor(canvas) {
    this.scale = canvas.width / canvas.clientWidth;
    this.width = canvas.width;
    this.height = canvas.height;
    this.data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
  }
  // A tenth of a line beneath may show through.
  isAt(rgb, x, y) {
    const at = 4 * (y * this.width + x);
    return this.data[at + 3] > 100 && rgb.every((v, k) => Math.abs(v - this.data[at + k]) <= 25);
  }
  colour(name) {
    const hex = css(name);
    return [1, 3, 5].map(at => parseInt(hex.slice(at, at + 2), 16));
  }
  // Of that colour, in CSS pixels: a point; the tallest column between two.
  is(name, x, y) { return this.isAt(this.colour(name), Math.floor(x * this.scale), Math.floor(y * this.scale)); }
  tallest(name, x0, x1) {
    const rgb = this.colour(name);
    let most = 0;
    for (let x = Math.ceil(x0 * this.scale); x < Math.floor(x1 * this.scale); ++x) {
      let n = 0;
      for (let y = 0; y < this.height; ++y) n += this.isAt(rgb, x, y);
      most = Math.max(most, n);
    }
    return most / this.scale;
  }
}
function measured() {
  const texts = selector => [...document.querySelectorAll(selector)].map(e => e.textContent);
  return {problems, charts: charts.map(c => { const scales = c.draw(); return c.measure(new Pixels(c.canvas), scales); }),
    title: document.title, rate: texts(".rate b"), quantiles: texts(".quantiles"), groups: texts("td pre"), headings: texts("h2"),
    replays: texts("td code")};
}
if (location.hash.includes("selftest")) element("pre", document.body, JSON.stringify(measured())).id = "selftest";
