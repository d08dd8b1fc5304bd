#include <orrery/harness/record/report_template.hpp>

namespace orrery {
namespace {

// No library: canvases, one zoom and one cursor for all charts over time. Drag to zoom,
// double-click to see all, arrow keys to move.
constexpr std::string_view kPage = R"html(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>Orrery</title>
<style>
:root{--paper:#fff;--ink:#1a1c20;--soft:#5c6370;--line:#d9dce1;--fill:#f4f5f7;--good:#1a7f37;--bad:#c62828;
--c0:#1f6fb2;--c1:#d1651a;--c2:#2e8b57;--c3:#8e44ad;--c4:#b8860b;--c5:#c0392b}
@media (prefers-color-scheme:dark){:root{--paper:#15171b;--ink:#e6e8eb;--soft:#9aa2ae;--line:#343941;--fill:#1e2127;
--good:#4ac26b;--bad:#ff7b72;--c0:#61afef;--c1:#e5a05a;--c2:#7bc77e;--c3:#c58ae0;--c4:#e0c060;--c5:#ff7b72}}
@media print{:root{--paper:#fff;--ink:#000;--soft:#444;--line:#bbb;--fill:#fff}.screen{display:none}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);font:14px/1.45 system-ui,sans-serif}
main{max-width:1180px;margin:0 auto;padding:20px 24px 60px}
h1{font-size:20px;margin:0 0 2px;overflow-wrap:anywhere}h2{font-size:15px;margin:26px 0 6px}
.result{font-weight:600}.passed{color:var(--good)}.failed{color:var(--bad)}
.facts{display:grid;grid-template-columns:repeat(auto-fill,minmax(250px,1fr));gap:2px 22px;margin:12px 0;padding:10px 14px;
background:var(--fill);border:1px solid var(--line);border-radius:6px}
.facts div{display:flex;justify-content:space-between;gap:12px;min-width:0}
.facts span:first-child{color:var(--soft);white-space:nowrap}
.facts .wide{grid-column:1/-1;justify-content:flex-start}
.facts span:last-child{font-variant-numeric:tabular-nums;overflow-wrap:anywhere}
code{font:12px ui-monospace,monospace}
figure{margin:0 0 14px}figcaption{display:flex;gap:16px;flex-wrap:wrap;align-items:baseline;margin:0 0 2px}
figcaption b{font-size:13px}figcaption .key{font-size:12px;color:var(--soft);font-variant-numeric:tabular-nums}
.key i{display:inline-block;width:10px;height:10px;border-radius:2px;margin-right:5px}
canvas{display:block;width:100%;touch-action:none}
.planes{display:grid;grid-template-columns:repeat(auto-fit,minmax(300px,1fr));gap:16px}
table{border-collapse:collapse;width:100%;font-size:13px}td,th{text-align:left;padding:3px 10px;border-bottom:1px solid var(--line)}
td:first-child,th:first-child{font-variant-numeric:tabular-nums;text-align:right;width:110px}
input{font:inherit;padding:4px 8px;width:320px;max-width:100%;background:var(--paper);color:inherit;border:1px solid var(--line);border-radius:4px}
.hint{color:var(--soft);font-size:12px}
</style>
</head>
<body>
<main id="page"></main>
<script type="application/json" id="data">@DATA@</script>
<script>
"use strict";
const report = JSON.parse(document.getElementById("data").textContent);
const page = document.getElementById("page");
const style = getComputedStyle(document.documentElement);
const css = name => style.getPropertyValue(name).trim();
const colour = i => css("--c" + i % 6);
const kinds = {delivered: "--c2", lost: "--c5", reordered: "--c3", duplicate: "--c4", damaged: "--c1", held: "--soft"};

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
  if (a !== 0 && (a < 1e-3 || a >= 1e6)) return v.toExponential(3);
  return String(Number(v.toPrecision(5)));
}
function clock(s) {
  const sign = s < 0 ? "-" : "", t = Math.abs(s), h = Math.floor(t / 3600), m = Math.floor(t / 60) % 60;
  const two = n => String(n).padStart(2, "0");
  return sign + h + ":" + two(m) + ":" + two(Math.floor(t % 60));
}
// Round numbers between lo and hi, about `most` of them.
function ticks(lo, hi, most) {
  const raw = (hi - lo) / most, power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = [1, 2, 5, 10].map(f => f * power).find(s => s >= raw);
  const all = [];
  for (let v = Math.ceil(lo / step) * step; v <= hi + step * 1e-9; v += step) all.push(Math.abs(v) < step * 1e-9 ? 0 : v);
  return all;
}
function timeTicks(lo, hi, most) {
  const raw = (hi - lo) / most;
  const steps = [1, 2, 5, 10, 30, 60, 120, 300, 600, 1800, 3600, 7200, 14400, 43200, 86400, 172800, 604800, 2592000];
  const step = steps.find(s => s >= raw) || raw;
  const all = [];
  for (let v = Math.ceil(lo / step) * step; v <= hi; v += step) all.push(v);
  return all;
}
function prepared(canvas, height) {
  const width = canvas.clientWidth, scale = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  canvas.style.height = height + "px";
  const g = canvas.getContext("2d");
  g.setTransform(scale, 0, 0, scale, 0, 0);
  g.clearRect(0, 0, width, height);
  g.font = "11px system-ui,sans-serif";
  g.lineWidth = 1;
  return [g, width, height];
}

// ---- one zoom and one cursor for all charts over time
const whole = [0, Math.max(report.length, 1e-3)];
let view = whole.slice(), cursor = null, selection = null;
const charts = [];
let pending = false;
function redraw() {
  if (pending) return;
  pending = true;
  requestAnimationFrame(() => { pending = false; charts.forEach(c => c.draw()); });
}
function zoom(from, to) {
  const least = 1e-3;
  view = [Math.max(whole[0], from), Math.min(whole[1], to)];
  if (view[1] - view[0] < least) view = whole.slice();
  redraw();
}
const left = 64, right = 14;
const xOf = (t, width) => left + (t - view[0]) / (view[1] - view[0]) * (width - left - right);
const tOf = (x, width) => view[0] + (x - left) / (width - left - right) * (view[1] - view[0]);
function listen(canvas) {
  canvas.addEventListener("pointermove", e => {
    cursor = tOf(e.offsetX, canvas.clientWidth);
    if (selection) selection[1] = cursor;
    redraw();
  });
  canvas.addEventListener("pointerleave", () => { cursor = null; redraw(); });
  canvas.addEventListener("pointerdown", e => {
    canvas.setPointerCapture(e.pointerId);
    selection = [tOf(e.offsetX, canvas.clientWidth), tOf(e.offsetX, canvas.clientWidth)];
  });
  canvas.addEventListener("pointerup", () => {
    if (selection) {
      const [a, b] = selection.sort((p, q) => p - q);
      if (b - a > (view[1] - view[0]) * 0.005) zoom(a, b);
    }
    selection = null;
    redraw();
  });
  canvas.addEventListener("dblclick", () => zoom(whole[0], whole[1]));
}
document.addEventListener("keydown", e => {
  if (e.target.tagName === "INPUT") return;
  const span = view[1] - view[0];
  if (e.key === "ArrowLeft") zoom(Math.max(whole[0], view[0] - span / 4), Math.max(whole[0], view[0] - span / 4) + span);
  if (e.key === "ArrowRight") zoom(Math.min(whole[1], view[1] + span / 4) - span, Math.min(whole[1], view[1] + span / 4));
  if (e.key === "Escape") zoom(whole[0], whole[1]);
});
function drawTimeAxis(g, width, height) {
  g.strokeStyle = css("--line");
  g.fillStyle = css("--soft");
  g.textAlign = "center";
  for (const t of timeTicks(view[0], view[1], 9)) {
    const x = Math.round(xOf(t, width)) + 0.5;
    g.beginPath(); g.moveTo(x, 6); g.lineTo(x, height - 18); g.stroke();
    g.fillText(clock(t), x, height - 5);
  }
}
function drawCursor(g, width, height) {
  if (selection) {
    const [a, b] = selection.map(t => xOf(t, width));
    g.globalAlpha = 0.15; g.fillStyle = css("--c0");
    g.fillRect(Math.min(a, b), 6, Math.abs(b - a), height - 24);
    g.globalAlpha = 1;
  }
  if (cursor === null || cursor < view[0] || cursor > view[1]) return;
  const x = Math.round(xOf(cursor, width)) + 0.5;
  g.strokeStyle = css("--soft");
  g.beginPath(); g.moveTo(x, 6); g.lineTo(x, height - 18); g.stroke();
}
// Index of the last span that begins at or before t.
function indexAt(times, t) {
  let lo = 0, hi = times.length - 1;
  if (hi < 0 || times[0] > t) return -1;
  while (lo < hi) {
    const middle = (lo + hi + 1) >> 1;
    if (times[middle] <= t) lo = middle; else hi = middle - 1;
  }
  return lo;
}

class TimeChart {
  constructor(parent, chart) {
    this.chart = chart;
    const figure = element("figure", parent), caption = element("figcaption", figure);
    element("b", caption, chart.title + (chart.unit ? " [" + chart.unit + "]" : ""));
    this.keys = chart.series.map((s, i) => this.key(caption, s.name, colour(i)));
    if (chart.sigma) this.sigmaKey = this.key(caption, chart.sigma_name, css("--line"));
    this.canvas = element("canvas", figure);
    this.canvas.dataset.chart = chart.title;
    listen(this.canvas);
  }
  key(caption, name, fill) {
    const span = element("span", caption, undefined, "key");
    element("i", span).style.background = fill;
    element("span", span, name + " ");
    return element("span", span);
  }
  range() {
    let lo = Infinity, hi = -Infinity;
    for (const s of this.chart.series) {
      const v = s.values;
      const from = Math.max(0, indexAt(v.t, view[0]));
      for (let i = from; i < v.t.length && v.t[i] <= view[1]; ++i) {
        if (v.lo[i] < lo) lo = v.lo[i];
        if (v.hi[i] > hi) hi = v.hi[i];
      }
    }
    if (lo > hi) return [0, 1];
    if (lo > 0 && lo < hi / 2) lo = 0;
    const pad = (hi - lo || Math.abs(hi) || 1) * 0.06;
    return [lo === 0 ? 0 : lo - pad, hi + pad];
  }
  draw() {
    const [g, width, height] = prepared(this.canvas, 190);
    const [lo, hi] = this.range();
    const yOf = v => 8 + (hi - v) / (hi - lo) * (height - 28);
    drawTimeAxis(g, width, height);
    g.textAlign = "right";
    for (const v of ticks(lo, hi, 5)) {
      const y = Math.round(yOf(v)) + 0.5;
      g.strokeStyle = css("--line");
      g.beginPath(); g.moveTo(left, y); g.lineTo(width - right, y); g.stroke();
      g.fillText(shown(v), left - 6, y + 4);
    }
    g.save();
    g.beginPath(); g.rect(left, 6, width - left - right, height - 24); g.clip();
    if (this.chart.sigma) this.area(g, width, yOf, this.chart.sigma);
    this.chart.series.forEach((s, i) => this.line(g, width, yOf, s.values, colour(i)));
    g.restore();
    drawCursor(g, width, height);
    this.chart.series.forEach((s, i) => {
      const at = cursor === null ? -1 : indexAt(s.values.t, cursor);
      this.keys[i].textContent = at < 0 ? "" : shown(s.values.last[at]);
    });
  }
  area(g, width, yOf, sigma) {
    g.globalAlpha = 0.6; g.fillStyle = css("--line");
    g.beginPath();
    sigma.t.forEach((t, i) => g.lineTo(xOf(t, width), yOf(sigma.hi[i])));
    for (let i = sigma.t.length - 1; i >= 0; --i) g.lineTo(xOf(sigma.t[i], width), yOf(-sigma.hi[i]));
    g.fill();
    g.globalAlpha = 1;
  }
  line(g, width, yOf, v, stroke) {
    g.strokeStyle = stroke; g.lineWidth = 1.4; g.lineJoin = "round";
    g.beginPath();
    const from = Math.max(0, indexAt(v.t, view[0]));
    for (let i = from; i < v.t.length; ++i) {
      const x = xOf(v.t[i], width);
      g.lineTo(x, yOf(v.lo[i]));
      if (v.hi[i] !== v.lo[i]) g.lineTo(x, yOf(v.hi[i]));
      if (v.last[i] !== v.hi[i]) g.lineTo(x, yOf(v.last[i]));
      if (v.t[i] > view[1]) break;
    }
    g.stroke();
    g.lineWidth = 1;
  }
}

class Timelines {
  constructor(parent, timelines) {
    this.timelines = timelines;
    const figure = element("figure", parent), caption = element("figcaption", figure);
    element("b", caption, "Links");
    const present = [...new Set(timelines.flatMap(t => t.marks.map(m => m.kind)))];
    for (const kind of present) {
      const span = element("span", caption, undefined, "key");
      element("i", span).style.background = css(kinds[kind] || "--c5");
      const count = timelines.reduce((n, t) => n + t.marks.filter(m => m.kind === kind).reduce((k, m) => k + m.count, 0), 0);
      element("span", span, kind + " " + count);
    }
    this.canvas = element("canvas", figure);
    this.canvas.dataset.chart = "Links";
    listen(this.canvas);
  }
  draw() {
    const row = 46, [g, width, height] = prepared(this.canvas, this.timelines.length * row + 24);
    drawTimeAxis(g, width, height);
    this.timelines.forEach((timeline, k) => {
      g.fillStyle = css("--soft"); g.textAlign = "left";
      g.fillText(timeline.name, left + 4, 16 + k * row);
      for (const marks of timeline.marks) {
        const plain = marks.kind === "delivered", y = 20 + k * row;
        g.strokeStyle = css(kinds[marks.kind] || "--c5");
        g.globalAlpha = plain ? 0.5 : 1;
        g.beginPath();
        for (const t of marks.at) {
          if (t < view[0] || t > view[1]) continue;
          const x = Math.round(xOf(t, width)) + 0.5;
          g.moveTo(x, plain ? y + 6 : y); g.lineTo(x, plain ? y + 14 : y + 20);
        }
        g.stroke();
        g.globalAlpha = 1;
      }
    });
    drawCursor(g, width, height);
  }
}

class PlaneChart {
  constructor(parent, chart) {
    this.chart = chart;
    const figure = element("figure", parent), caption = element("figcaption", figure);
    element("b", caption, chart.title);
    chart.paths.forEach((p, i) => {
      const span = element("span", caption, undefined, "key");
      element("i", span).style.background = colour(i);
      element("span", span, p.name);
    });
    this.canvas = element("canvas", figure);
    this.canvas.dataset.chart = chart.title;
  }
  draw() {
    const [g, width, height] = prepared(this.canvas, 300);
    let box = [Infinity, -Infinity, Infinity, -Infinity];
    for (const p of this.chart.paths) {
      p.x.forEach((x, i) => { box = [Math.min(box[0], x), Math.max(box[1], x), Math.min(box[2], p.y[i]), Math.max(box[3], p.y[i])]; });
    }
    box = [Math.min(box[0], 0), Math.max(box[1], 0), Math.min(box[2], 0), Math.max(box[3], 0)];
    const w = width - 60, h = height - 40;
    const perPixel = Math.max((box[1] - box[0]) / w, (box[3] - box[2]) / h, 1e-12) * 1.08;
    const middle = [(box[0] + box[1]) / 2, (box[2] + box[3]) / 2];
    const xOf = x => 50 + w / 2 + (x - middle[0]) / perPixel, yOf = y => 8 + h / 2 - (y - middle[1]) / perPixel;
    const reach = [middle[0] - w / 2 * perPixel, middle[0] + w / 2 * perPixel, middle[1] - h / 2 * perPixel, middle[1] + h / 2 * perPixel];
    g.strokeStyle = css("--line"); g.fillStyle = css("--soft");
    g.textAlign = "center";
    for (const v of ticks(reach[0], reach[1], 5)) {
      g.beginPath(); g.moveTo(xOf(v), 8); g.lineTo(xOf(v), 8 + h); g.stroke();
      g.fillText(shown(v), xOf(v), height - 18);
    }
    g.fillText(this.chart.x, 50 + w / 2, height - 4);
    g.textAlign = "right";
    for (const v of ticks(reach[2], reach[3], 5)) {
      g.beginPath(); g.moveTo(50, yOf(v)); g.lineTo(50 + w, yOf(v)); g.stroke();
      g.fillText(shown(v), 46, yOf(v) + 4);
    }
    g.save(); g.translate(10, 8 + h / 2); g.rotate(-Math.PI / 2); g.textAlign = "center"; g.fillText(this.chart.y, 0, 0); g.restore();
    this.chart.paths.forEach((p, i) => {
      g.strokeStyle = colour(i); g.lineWidth = 1.2;
      g.beginPath();
      p.x.forEach((x, k) => g.lineTo(xOf(x), yOf(p.y[k])));
      g.stroke();
      const last = p.x.length - 1;
      g.fillStyle = colour(i);
      g.beginPath(); g.arc(xOf(p.x[last]), yOf(p.y[last]), 3.5, 0, 7); g.fill();
    });
    g.fillStyle = css("--ink");
    g.beginPath(); g.arc(xOf(0), yOf(0), 3, 0, 7); g.fill();
  }
}

// ---- the page
element("h1", page, report.title);
element("div", page, report.result, "result " + report.result);
document.title = report.title;
const facts = element("div", page, undefined, "facts");
for (const [name, value] of report.header.concat(report.host)) {
  const row = element("div", facts, undefined, value.length > 40 ? "wide" : "");
  element("span", row, name);
  element(value.length > 40 ? "code" : "span", row, value);
}
element("div", page, "Drag across a chart to zoom, double-click to see all, arrow keys to move.", "hint screen");
if (report.planes.length) {
  element("h2", page, "Relative motion");
  const planes = element("div", page, undefined, "planes");
  report.planes.forEach(p => charts.push(new PlaneChart(planes, p)));
}
if (report.charts.length || report.timelines.length) element("h2", page, "Over time");
report.charts.forEach(c => charts.push(new TimeChart(page, c)));
if (report.timelines.length) charts.push(new Timelines(page, report.timelines));
if (report.events.length) {
  element("h2", page, "Events");
  const search = element("input", page, undefined, "screen");
  search.placeholder = "search " + report.events.length + " events";
  const table = element("table", page), head = element("tr", element("thead", table)), body = element("tbody", table);
  ["time", "where", "what"].forEach(t => element("th", head, t));
  const fill = () => {
    body.textContent = "";
    const word = search.value.toLowerCase();
    let rows = 0;
    for (const [t, where, what] of report.events) {
      if (word && !(where + " " + what).toLowerCase().includes(word)) continue;
      if (++rows > 500) break;
      const row = element("tr", body);
      element("td", row, clock(t)).title = t + " s";
      element("td", row, where);
      element("td", row, what);
    }
  };
  search.addEventListener("input", fill);
  fill();
}
window.addEventListener("resize", redraw);
window.matchMedia("(prefers-color-scheme:dark)").addEventListener("change", redraw);
charts.forEach(c => c.draw());
window.orreryReport = {report, zoom, charts};
</script>
</body>
</html>
)html";

}  // namespace

std::string_view report_template() {
  return kPage;
}

}  // namespace orrery
