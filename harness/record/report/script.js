"use strict";
// No library: canvases with one zoom and one cursor for all that is drawn over time.
const problems = [];
window.addEventListener("error", e => problems.push(String(e.message)));
const report = JSON.parse(document.getElementById("data").textContent);
const page = document.getElementById("page");
let palette = {};
const css = name => palette[name] ??= getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const colour = i => css("--c" + i % 6);
const kinds = {
  delivered: "--c0", lost: "--bad", reordered: "--c3", duplicate: "--c4", damaged: "--c1", held: "--soft",
  injected: "--c5"};
const kindColour = kind => css(kinds[kind] || "--c1");

function element(tag, parent, text, className) {
  const e = document.createElement(tag);
  if (text !== undefined) e.textContent = text;
  if (className) e.className = className;
  if (parent) parent.appendChild(e);
  return e;
}
// Four digits, with a multiple of ten from which on plain figures grow long.
function shown(v, unit) {
  if (v === null || v === undefined) return "–";
  const a = Math.abs(v);
  if (unit === "bytes") {
    const [name, scale] = a >= 1e9 ? [" G", 1e9] : a >= 1e6 ? [" M", 1e6] : a >= 1e4 ? [" k", 1e3] : ["", 1];
    return Number((v / scale).toPrecision(5)) + name;
  }
  if (a !== 0 && (a < 1e-3 || a >= 1e6)) return v.toExponential(2);
  return String(Number(v.toPrecision(5)));
}
// 1:02:03.5; the step decides how many decimals.
function clock(s, step = 1) {
  const sign = s < 0 ? "-" : "", decimals = step >= 1 ? 0 : Math.min(3, Math.ceil(-Math.log10(step)));
  const t = Math.round(Math.abs(s) * 1000) / 1000, h = Math.floor(t / 3600), m = Math.floor(t / 60) % 60;
  const second = Math.floor((t % 60) * 10 ** decimals + 1e-6) / 10 ** decimals;
  const two = n => String(n).padStart(2, "0");
  return sign + h + ":" + two(m) + ":" + second.toFixed(decimals).padStart(decimals ? 3 + decimals : 2, "0");
}
function steps(lo, hi, step) {
  const all = [];
  for (let k = Math.ceil(lo / step - 1e-9); k * step <= hi + step * 1e-9; ++k) all.push(k * step);
  return all;
}
// Round numbers between lo and hi, at most `most` of them.
function ticks(lo, hi, most) {
  const raw = (hi - lo) / most, power = 10 ** Math.floor(Math.log10(raw));
  return steps(lo, hi, [1, 2, 5, 10].map(f => f * power).find(s => s >= raw));
}
function timeStep(lo, hi, most) {
  const raw = (hi - lo) / most;
  const round = [0.001, 0.01, 0.1, 0.5, 1, 2, 5, 10, 30, 60, 120, 300, 600, 1800, 3600, 7200, 14400, 21600, 43200, 86400, 172800,
    604800, 2592000];
  return round.find(s => s >= raw) || raw;
}
function prepared(canvas, height) {
  const width = canvas.clientWidth, scale = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  canvas.style.height = height + "px";
  const g = canvas.getContext("2d", {willReadFrequently: testing});
  g.setTransform(scale, 0, 0, scale, 0, 0);
  g.font = "11px system-ui,sans-serif";
  return [g, width, height];
}
function line(g, x0, y0, x1, y1) {
  g.beginPath(); g.moveTo(x0, y0); g.lineTo(x1, y1); g.stroke();
}
const crisp = x => Math.round(x) + 0.5;

// ---- one zoom and one cursor for all that is drawn over time
const testing = location.hash.includes("selftest");
const whole = [0, Math.max(report.length, 1e-3)];
let view = whole.slice(), cursor = null, selection = null;
const charts = [];
let pending = false;
function redraw() {
  if (pending) return;
  pending = true;
  requestAnimationFrame(() => { pending = false; drawAll(); });
}
function drawAll() {
  charts.forEach(c => c.draw());
  describeNow();
}
function zoom(from, to) {
  view = [Math.max(whole[0], from), Math.min(whole[1], to)];
  if (view[1] - view[0] < 1e-3) view = whole.slice();
  redraw();
}
function shift(part) {
  const span = view[1] - view[0];
  const from = Math.min(Math.max(whole[0], view[0] + part * span), whole[1] - span);
  zoom(from, from + span);
}
function scaleAbout(t, factor) {
  zoom(t - (t - view[0]) * factor, t + (view[1] - t) * factor);
}
const left = 66, right = 12;
const xOf = (t, width) => left + (t - view[0]) / (view[1] - view[0]) * (width - left - right);
const tOf = (x, width) => view[0] + (x - left) / (width - left - right) * (view[1] - view[0]);
function listen(canvas) {
  const at = e => Math.min(view[1], Math.max(view[0], tOf(e.offsetX, canvas.clientWidth)));
  canvas.addEventListener("pointermove", e => {
    cursor = at(e);
    if (selection) selection[1] = cursor;
    redraw();
  });
  canvas.addEventListener("pointerleave", () => { cursor = null; redraw(); });
  canvas.addEventListener("pointerdown", e => {
    canvas.setPointerCapture(e.pointerId);
    selection = [at(e), at(e)];
  });
  canvas.addEventListener("pointerup", () => {
    if (selection) {
      const [a, b] = selection.sort((p, q) => p - q);
      if (b - a > (view[1] - view[0]) * 0.005) zoom(a, b);
    }
    selection = null;
    redraw();
  });
  canvas.addEventListener("pointercancel", () => { selection = null; redraw(); });
  canvas.addEventListener("dblclick", () => zoom(whole[0], whole[1]));
  canvas.addEventListener("wheel", e => {
    if (!e.ctrlKey) return;
    e.preventDefault();
    scaleAbout(at(e), e.deltaY > 0 ? 1.25 : 0.8);
  }, {passive: false});
}
document.addEventListener("keydown", e => {
  if (e.target.tagName === "INPUT" || e.altKey || e.metaKey || e.ctrlKey) return;
  const middle = cursor ?? (view[0] + view[1]) / 2;
  const does = {
    ArrowLeft: () => shift(-0.25), ArrowRight: () => shift(0.25), Escape: () => zoom(whole[0], whole[1]),
    "+": () => scaleAbout(middle, 0.5), "-": () => scaleAbout(middle, 2)}[e.key];
  if (does) { e.preventDefault(); does(); }
});
const spanOf = fault => [fault.from, fault.until ?? whole[1]];
// Behind everything that is drawn over time: the spans in which a fault was active. One that could
// act all the time is a line along the top, or there would be nothing but its shade.
function drawFaults(g, width, top, bottom) {
  for (const fault of report.faults) {
    const [from, until] = spanOf(fault);
    if (until < view[0] || from > view[1]) continue;
    const x = xOf(Math.max(from, view[0]), width), end = xOf(Math.min(until, view[1]), width);
    g.fillStyle = css("--fault");
    g.globalAlpha = from > whole[0] || until < whole[1] ? 0.13 : 0;
    g.fillRect(x, top, Math.max(end - x, 1.5), bottom - top);
    g.globalAlpha = 0.75;
    g.fillRect(x, top, Math.max(end - x, 1.5), 2);
    g.globalAlpha = 1;
  }
}
function drawTimeAxis(g, width, height) {
  drawFaults(g, width, 6, height - 18);
  const step = timeStep(view[0], view[1], Math.max(2, Math.floor((width - left - right) / 95)));
  g.textAlign = "center";
  for (const t of steps(view[0], view[1], step)) {
    const x = crisp(xOf(t, width));
    g.strokeStyle = css("--line");
    line(g, x, 6, x, height - 18);
    g.fillStyle = css("--soft");
    g.fillText(clock(t, step), Math.min(Math.max(x, 24), width - 24), height - 5);
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
  const x = crisp(xOf(cursor, width));
  g.strokeStyle = css("--ink"); g.globalAlpha = 0.6;
  line(g, x, 6, x, height - 18);
  g.globalAlpha = 1;
}
function clipped(g, width, height, draw) {
  g.save();
  g.beginPath(); g.rect(left, 4, width - left - right, height - 22); g.clip();
  draw();
  g.restore();
}
// Index of the last one at or before t; -1: none.
function indexAt(times, t) {
  let lo = 0, hi = times.length - 1;
  if (hi < 0 || times[0] > t) return -1;
  while (lo < hi) {
    const middle = (lo + hi + 1) >> 1;
    if (times[middle] <= t) lo = middle; else hi = middle - 1;
  }
  return lo;
}
function figure(parent, title) {
  const box = element("figure", parent), caption = element("figcaption", box), canvas = element("canvas", box);
  element("b", caption, title);
  canvas.dataset.chart = title;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", title);
  return [caption, canvas];
}
// A coloured square with a name; what is returned takes the value at the cursor.
function key(caption, name, fill) {
  const span = element("span", caption, undefined, "key"), square = element("i", span);
  square.dataset.fill = fill;
  element("span", span, name + " ");
  return element("span", span);
}
function paintKeys() {
  for (const square of document.querySelectorAll(".key i")) square.style.background = css(square.dataset.fill);
}

// t as differences in ms; what equals the least of a span is left out.
function unpack(values) {
  let ms = 0;
  const t = values.t.map(d => (ms += d) / 1000), lo = values.lo;
  const hi = values.hi ? values.hi.map((v, i) => v ?? lo[i]) : lo;
  const last = values.last ? values.last.map((v, i) => v ?? hi[i]) : hi;
  return {t, lo, hi, last};
}

class TimeChart {
  constructor(parent, chart) {
    this.chart = chart;
    this.series = chart.series.map(s => ({name: s.name, v: unpack(s.values)}));
    for (const {v} of this.series) this.findGaps(v);
    this.sigma = chart.sigma && unpack(chart.sigma);
    [this.caption, this.canvas] = figure(parent, chart.title + (chart.unit ? " [" + chart.unit + "]" : ""));
    this.keys = this.series.map((s, i) => key(this.caption, s.name, "--c" + (i + (chart.colour || 0)) % 6));
    if (this.sigma) {
      this.sigmaKey = key(this.caption, chart.sigma_name, "--band");
      this.cutNote = element("span", this.caption, "", "key");
    }
    if (chart.limit !== undefined) key(this.caption, chart.limit_name + " " + shown(chart.limit, chart.unit), "--bad");
    listen(this.canvas);
  }
  // No line across what lasts five times as long as usual, an outage say, and none at all through what
  // comes at irregular times, as impulses do: points. Of bytes there is one, for a heap keeps its size
  // from call to call.
  findGaps(v) {
    const lengths = v.t.slice(1).map((t, i) => t - v.t[i]).sort((a, b) => a - b);
    const at = part => lengths[Math.floor(part * (lengths.length - 1))] ?? 0;
    v.usual = at(0.5);
    const irregular = lengths.length > 1 && at(0.9) > 3 * at(0.1);
    v.gap = this.chart.unit === "bytes" ? Infinity : irregular ? 0 : 5 * v.usual || Infinity;
  }
  colour(i) { return colour(i + (this.chart.colour || 0)); }
  range() {
    let lo = Infinity, hi = -Infinity;
    const take = (v, sign) => {
      for (let i = Math.max(0, indexAt(v.t, view[0])); i < v.t.length && v.t[i] <= view[1]; ++i) {
        if (v.lo[i] !== null && v.lo[i] < lo) lo = v.lo[i];
        if (v.hi[i] > hi) hi = v.hi[i];
        if (sign && -v.hi[i] < lo) lo = -v.hi[i];
      }
    };
    this.series.forEach(s => take(s.v, false));
    if (lo > hi) return [0, 1];
    if (this.sigma) [lo, hi] = this.usual(lo, hi);
    // The band may be far wider than the error at first: it is not to flatten what is to be seen.
    const reach = (this.cut ? 1 : 3) * Math.max(Math.abs(lo), Math.abs(hi));
    if (this.sigma) {
      const most = Math.max(0, ...this.sigma.hi.filter((_, i) => this.sigma.t[i] >= view[0] && this.sigma.t[i] <= view[1]));
      lo = Math.min(lo, -Math.min(most, reach));
      hi = Math.max(hi, Math.min(most, reach));
    }
    if (this.chart.limit !== undefined && this.chart.limit < 2 * hi) hi = Math.max(hi, this.chart.limit);
    if (lo > 0 && lo < hi / 2) lo = 0;
    const pad = (hi - lo || Math.abs(hi) || 1) * 0.06;
    return [lo === 0 ? 0 : lo - pad, hi + pad];
  }
  // An error that is large for a moment, as before a filter has converged, would flatten all the rest
  // into a line. Where it is five times what 95 % of the spans stay below, these fill the chart; what
  // is beyond is marked at its edge and said beside the title. Zoomed in on, it is to be seen.
  usual(lo, hi) {
    const sizes = [];
    let peak = 0;
    this.cut = null;
    for (const {v} of this.series) {
      for (let i = Math.max(0, indexAt(v.t, view[0])); i < v.t.length && v.t[i] <= view[1]; ++i) {
        if (v.lo[i] === null) continue;
        const value = -v.lo[i] > v.hi[i] ? v.lo[i] : v.hi[i];
        sizes.push(Math.abs(value));
        if (Math.abs(value) > Math.abs(peak)) [peak, this.cut] = [value, {t: v.t[i], value}];
      }
    }
    const most = sizes.sort((a, b) => a - b)[Math.floor(0.95 * (sizes.length - 1))];
    if (sizes.length < 50 || most === 0 || Math.abs(peak) < 5 * most) this.cut = null;
    return this.cut ? [Math.max(lo, -1.8 * most), Math.min(hi, 1.8 * most)] : [lo, hi];
  }
  // Ticks at the edge beyond which the curve goes on.
  cutMarks(g, width, height, v, lo, hi, stroke) {
    g.fillStyle = stroke;
    v.t.forEach((t, i) => {
      if (t < view[0] || t > view[1] || v.lo[i] === null) return;
      if (v.hi[i] > hi) g.fillRect(xOf(t, width) - 1, 2, 3, 5);
      if (v.lo[i] < lo) g.fillRect(xOf(t, width) - 1, height - 21, 3, 5);
    });
  }
  draw(only) {
    const [g, width, height] = prepared(this.canvas, this.chart.height || 190);
    const [lo, hi] = this.axis = this.range();
    const yOf = this.yOf = v => 8 + (hi - v) / (hi - lo) * (height - 28);
    if (only === undefined) {
      drawTimeAxis(g, width, height);
      g.textAlign = "right";
      for (const v of ticks(lo, hi, Math.max(3, Math.floor(height / 26)))) {
        const y = crisp(yOf(v));
        g.strokeStyle = css(Math.abs(v) < 1e-12 ? "--soft" : "--line");
        line(g, left, y, width - right, y);
        g.fillStyle = css("--soft");
        g.fillText(shown(v, this.chart.unit), left - 6, y + 4);
      }
    }
    clipped(g, width, height, () => {
      if (only === undefined && this.sigma) this.band(g, width, yOf);
      this.series.forEach((s, i) => {
        if (only === undefined || only === i) this.curve(g, width, yOf, s.v, this.colour(i));
      });
      if (only === undefined && this.chart.limit !== undefined) {
        g.strokeStyle = css("--bad"); g.setLineDash([6, 4]);
        line(g, left, yOf(this.chart.limit), width - right, yOf(this.chart.limit));
        g.setLineDash([]);
      }
    });
    if (only !== undefined) return;
    if (this.cut) this.series.forEach((s, i) => this.cutMarks(g, width, height, s.v, lo, hi, this.colour(i)));
    if (this.cutNote) {
      this.cutNote.textContent = !this.cut ? "" :
        "off scale: up to " + shown(this.cut.value, this.chart.unit) + " " + this.chart.unit + " at " + clock(this.cut.t);
    }
    drawCursor(g, width, height);
    this.series.forEach((s, i) => {
      const k = cursor === null ? -1 : indexAt(s.v.t, cursor);
      this.keys[i].textContent = k < 0 ? "" : shown(s.v.last[k], this.chart.unit);
    });
    if (this.sigma) {
      const k = cursor === null ? -1 : indexAt(this.sigma.t, cursor);
      this.sigmaKey.textContent = k < 0 ? "" : shown(this.sigma.last[k], this.chart.unit);
    }
  }
  band(g, width, yOf) {
    const s = this.sigma;
    g.globalAlpha = 0.45; g.fillStyle = css("--band");
    g.beginPath();
    s.t.forEach((t, i) => g.lineTo(xOf(t, width), yOf(s.hi[i])));
    for (let i = s.t.length - 1; i >= 0; --i) g.lineTo(xOf(s.t[i], width), yOf(-s.hi[i]));
    g.fill();
    g.globalAlpha = 1;
  }
  // Least and most of each span, so that no peak is lost. Zoomed in on, a span of several samples is
  // a box, for where in it they lie is not known, and the line goes through the last of each.
  curve(g, width, yOf, v, stroke) {
    g.strokeStyle = g.fillStyle = stroke; g.lineWidth = 1.4; g.lineJoin = "round";
    const alone = [];
    g.beginPath();
    for (let i = Math.max(0, indexAt(v.t, view[0])); i < v.t.length; ++i) {
      const before = i > 0 ? v.t[i] - v.t[i - 1] : Infinity, after = i + 1 < v.t.length ? v.t[i + 1] - v.t[i] : Infinity;
      const x = xOf(v.t[i], width), next = after <= v.gap ? xOf(v.t[i + 1], width) : after < Infinity ? xOf(v.t[i] + v.usual, width) : x;
      if (before > v.gap) g.moveTo(x, yOf(v.lo[i]));
      if (before > v.gap && after > v.gap) alone.push([x, yOf(v.last[i])]);
      if (next - x > 3 && v.hi[i] !== v.lo[i]) {
        g.globalAlpha = 0.25;
        g.fillRect(x, yOf(v.hi[i]), next - x, yOf(v.lo[i]) - yOf(v.hi[i]));
        g.globalAlpha = 1;
        g.lineTo(next, yOf(v.last[i]));
        if (v.t[i] > view[1]) break;
        continue;
      }
      g.lineTo(x, yOf(v.lo[i]));
      if (v.hi[i] !== v.lo[i]) g.lineTo(x, yOf(v.hi[i]));
      if (v.last[i] !== v.hi[i]) g.lineTo(x, yOf(v.last[i]));
      if (v.t[i] > view[1]) break;
    }
    g.stroke();
    g.lineWidth = 1;
    if (v.t.length === 1) alone.push([xOf(v.t[0], width), yOf(v.lo[0])]);
    for (const [x, y] of alone) { g.beginPath(); g.arc(x, y, 2.2, 0, 7); g.fill(); }
  }
}

// One direction of a link: a line from the instant of sending, above, to that of arrival, below.
class LinkChart {
  constructor(parent, link) {
    this.link = link;
    [this.caption, this.canvas] = figure(parent, "Link " + link.name);
    this.groups = link.groups.map(group => {
      let ms = 0;
      const sent = group.sent.map(d => (ms += d) / 1000);
      return {kind: group.kind, sent, took: group.took.map(v => v === null ? null : v / 1000)};
    });
    for (const group of link.groups) {
      key(this.caption, group.kind, kinds[group.kind] || "--c1").textContent =
        group.count + (group.sent.length < group.count ? " (" + group.sent.length + " drawn)" : "");
    }
    listen(this.canvas);
  }
  draw() {
    const [g, width, height] = prepared(this.canvas, 96);
    drawTimeAxis(g, width, height);
    const top = 14, bottom = height - 24;
    g.fillStyle = css("--soft"); g.textAlign = "right";
    g.fillText("sent", left - 6, top + 4);
    g.fillText("received", left - 6, bottom + 4);
    g.strokeStyle = css("--soft");
    line(g, left, crisp(top), width - right, crisp(top));
    line(g, left, crisp(bottom), width - right, crisp(bottom));
    clipped(g, width, height, () => this.groups.forEach(group => this.messages(g, width, top, bottom, group)));
    drawCursor(g, width, height);
  }
  messages(g, width, top, bottom, group) {
    const visible = group.sent.filter(t => t >= view[0] && t <= view[1]).length;
    const plain = group.kind === "delivered", crosses = visible < 200;
    g.strokeStyle = g.fillStyle = kindColour(group.kind);
    g.globalAlpha = plain ? Math.max(0.15, Math.min(0.8, 250 / visible)) : 0.9;
    g.lineWidth = plain ? 1 : 1.5;
    g.beginPath();
    group.sent.forEach((sent, i) => {
      const took = group.took[i], x = xOf(sent, width);
      if (sent > view[1] || sent + (took ?? 0) < view[0]) return;
      if (took === null) {   // gone: a stub with a cross
        g.moveTo(x, top); g.lineTo(x, top + 14);
        if (!crosses) return;
        g.moveTo(x - 3, top + 14); g.lineTo(x + 3, top + 20);
        g.moveTo(x + 3, top + 14); g.lineTo(x - 3, top + 20);
      } else {
        g.moveTo(x, top); g.lineTo(xOf(sent + took, width), bottom);
      }
    });
    g.stroke();
    g.globalAlpha = 1; g.lineWidth = 1;
  }
}

// What each of several things was at a time: modes, attitudes, processes.
class LaneChart {
  constructor(parent, lanes) {
    this.lanes = lanes;
    [this.caption, this.canvas] = figure(parent, "Modes");
    const names = [...new Set(lanes.flatMap(lane => lane.states.map(s => s[1])))].filter(s => s !== "off");
    this.colours = new Map(names.map((name, i) => [name, i]));
    listen(this.canvas);
  }
  draw() {
    const row = 36, [g, width, height] = prepared(this.canvas, this.lanes.length * row + 28);
    drawTimeAxis(g, width, height);
    this.lanes.forEach((lane, k) => {
      const y = 22 + k * row;
      g.fillStyle = css("--soft"); g.textAlign = "left";
      g.fillText(lane.name, left + 2, y - 4);
      clipped(g, width, height, () => lane.states.forEach(([from, text], i) => {
        const until = lane.states[i + 1]?.[0] ?? whole[1];
        if (until < view[0] || from > view[1]) return;
        const x = Math.max(left, xOf(from, width)), end = Math.min(width - right, xOf(until, width));
        const fill = text === "off" ? css("--bad") : colour(this.colours.get(text));
        g.fillStyle = fill; g.globalAlpha = 0.25;
        g.fillRect(x, y, Math.max(end - x, 1), 18);
        g.globalAlpha = 1;
        g.fillRect(x, y, 2, 18);
        if (g.measureText(text).width > end - x - 8) return;
        g.fillStyle = css("--ink");
        g.fillText(text, x + 6, y + 13);
      }));
    });
    drawCursor(g, width, height);
  }
}

class PlaneChart {
  constructor(parent, title, xAxis, yAxis) {
    [this.title, this.xAxis, this.yAxis] = [title, xAxis, yAxis];
    [this.caption, this.canvas] = figure(parent, title);
    report.paths.forEach((p, i) => key(this.caption, p.name, "--c" + i % 6));
    key(this.caption, report.origin, "--ink");
  }
  draw() {
    const width = this.canvas.clientWidth;
    const [g, , height] = prepared(this.canvas, Math.max(220, Math.min(330, width * 0.85)));
    const all = axis => report.paths.flatMap(p => p[axis]).concat(0);
    const least = axis => all(axis).reduce((a, b) => Math.min(a, b)), most = axis => all(axis).reduce((a, b) => Math.max(a, b));
    this.box ??= [least(this.xAxis), most(this.xAxis), least(this.yAxis), most(this.yAxis)];
    const box = this.box, w = width - 64, h = height - 40;
    const perPixel = Math.max((box[1] - box[0]) / w, (box[3] - box[2]) / h, 1e-12) * 1.1;
    const middle = [(box[0] + box[1]) / 2, (box[2] + box[3]) / 2];
    this.perPixel = perPixel;
    const xOf = this.xOf = x => 56 + w / 2 + (x - middle[0]) / perPixel, yOf = this.yOf = y => 8 + h / 2 - (y - middle[1]) / perPixel;
    const reach = (k, size) => [middle[k] - size / 2 * perPixel, middle[k] + size / 2 * perPixel];
    g.textAlign = "center";
    for (const v of ticks(...reach(0, w), Math.max(3, Math.floor(w / 45)))) {
      g.strokeStyle = css(Math.abs(v) < 1e-9 ? "--soft" : "--line");
      line(g, crisp(xOf(v)), 8, crisp(xOf(v)), 8 + h);
      g.fillStyle = css("--soft");
      g.fillText(shown(v), xOf(v), height - 18);
    }
    g.fillText(this.xAxis + " [m]", 56 + w / 2, height - 4);
    g.textAlign = "right";
    for (const v of ticks(...reach(1, h), Math.max(3, Math.floor(h / 36)))) {
      g.strokeStyle = css(Math.abs(v) < 1e-9 ? "--soft" : "--line");
      line(g, 56, crisp(yOf(v)), 56 + w, crisp(yOf(v)));
      g.fillStyle = css("--soft");
      g.fillText(shown(v), 52, yOf(v) + 4);
    }
    g.save(); g.translate(11, 8 + h / 2); g.rotate(-Math.PI / 2); g.textAlign = "center"; g.fillText(this.yAxis + " [m]", 0, 0); g.restore();
    report.paths.forEach((p, i) => this.path(g, p, colour(i)));
    g.fillStyle = css("--ink");
    g.beginPath(); g.arc(xOf(0), yOf(0), 3, 0, 7); g.fill();
  }
  path(g, p, stroke) {
    g.strokeStyle = g.fillStyle = stroke; g.lineWidth = 1.2;
    const trace = (from, until) => {
      g.beginPath();
      for (let i = from; i <= until; ++i) g.lineTo(this.xOf(p[this.xAxis][i]), this.yOf(p[this.yAxis][i]));
      g.stroke();
    };
    const last = p.t.length - 1, from = Math.max(0, indexAt(p.t, view[0])), until = Math.max(from, indexAt(p.t, view[1]));
    g.globalAlpha = 0.18;
    trace(0, last);
    g.globalAlpha = 1;
    trace(from, until);
    const at = cursor === null ? until : Math.max(0, indexAt(p.t, cursor));
    g.beginPath(); g.arc(this.xOf(p[this.xAxis][at]), this.yOf(p[this.yAxis][at]), 3.5, 0, 7); g.fill();
    g.lineWidth = 1;
  }
}

class ArenaMap {
  constructor(parent, map) {
    this.map = map;
    [this.caption, this.canvas] = figure(parent, map.name);
    element("span", this.caption, map.caption, "key");
  }
  draw() {
    const rows = this.map.rows, columns = Math.max(...rows.map(r => r.length));
    const size = this.canvas.clientWidth / columns, high = Math.max(4, Math.min(size, 10));
    const [g] = prepared(this.canvas, rows.length * high + 2);
    rows.forEach((row, y) => [...row].forEach((c, x) => {
      const part = c === "." ? 0 : c === "#" ? 1 : Number(c) / 10;
      g.globalAlpha = 1; g.fillStyle = css("--line");
      g.fillRect(x * size, y * high, size - 0.5, high - 0.5);
      g.globalAlpha = part; g.fillStyle = css("--c0");
      if (part > 0) g.fillRect(x * size, y * high, size - 0.5, high - 0.5);
    }));
    g.globalAlpha = 1;
  }
}

// ---- the page
function addHeader() {
  const header = element("header", page);
  element("h1", header, report.title);
  element("span", header, report.result, "result " + report.result);
  element("span", header, undefined, "space");
  const themes = ["auto", "light", "dark"];
  let theme = themes.find(t => location.hash.includes(t)) || "auto";
  const button = element("button", header, undefined, "screen");
  const apply = () => {
    if (theme === "auto") delete document.documentElement.dataset.theme; else document.documentElement.dataset.theme = theme;
    button.textContent = theme + " colours";
    repaint();
  };
  button.addEventListener("click", () => { theme = themes[(themes.indexOf(theme) + 1) % 3]; apply(); });
  window.addEventListener("beforeprint", () => { document.documentElement.dataset.theme = "light"; repaint(true); });
  window.addEventListener("afterprint", apply);
  document.title = report.title + " – " + report.result;
  const facts = element("div", page, undefined, "facts");
  for (const [name, value] of report.header.concat(report.host)) {
    const wide = value.length > 40, row = element("div", facts, undefined, wide ? "wide" : "");
    element("span", row, name);
    element(wide ? "code" : "span", row, value);
  }
  return apply;
}
function addTable(parent, columns, rows, className) {
  const table = element("table", element("div", parent, undefined, "scroll"), undefined, className);
  const head = element("tr", element("thead", table)), body = element("tbody", table);
  columns.forEach(text => element("th", head, text));
  rows.forEach(cells => { const row = element("tr", body); cells.forEach(text => element("td", row, text)); });
  return body;
}
function addEvents() {
  element("h2", page, "Events");
  const search = element("input", page, undefined, "screen");
  search.type = "search";
  search.placeholder = "search " + report.events.length + " events";
  search.setAttribute("aria-label", "search events");
  const body = addTable(page, ["time", "where", "what"], [], "events"), more = element("div", page, undefined, "hint");
  const fill = () => {
    const words = search.value.toLowerCase().split(/\s+/);
    const found = report.events.filter(([t, where, what]) => {
      const text = (clock(t) + " " + where + " " + what).toLowerCase();
      return words.every(word => text.includes(word));
    });
    body.textContent = "";
    for (const [t, where, what] of found.slice(0, 500)) {
      const row = element("tr", body);
      element("td", row, clock(t)).title = t + " s";
      element("td", row, where);
      element("td", row, what);
      row.addEventListener("click", () => { cursor = t; redraw(); });
    }
    more.textContent = found.length > 500 ? "the first 500 of " + found.length + " are shown" : found.length === 0 ? "none" : "";
  };
  search.addEventListener("input", fill);
  fill();
}
let now = null;
function describeNow() {
  if (!now) return;
  now.textContent = "";
  const whole_ = view[0] === whole[0] && view[1] === whole[1];
  if (cursor === null) {
    now.textContent = whole_ ? "Drag across a chart to zoom; ctrl and wheel, + and - too. Arrow keys move, double click or Esc shows all."
      : "shown: " + clock(view[0]) + " to " + clock(view[1]) + " of " + clock(whole[1]) + "; double click or Esc shows all.";
    return;
  }
  element("b", now, "t = " + clock(cursor, 0.1));
  for (const fault of report.faults) {
    const [from, until] = spanOf(fault);
    if (cursor >= from && cursor <= until) element("em", now, fault.where + ": " + fault.what);
  }
}
function repaint(atOnce) {
  palette = {};
  paintKeys();
  if (atOnce) drawAll(); else redraw();
}
const applyTheme = addHeader();
if (report.table) addTable(page, report.table.columns, report.table.rows, "numbers");
if (report.host_table) addTable(page, report.host_table.columns, report.host_table.rows, "numbers");
if (report.paths.length) {
  element("h2", page, "Relative motion in the RTN frame of " + report.origin);
  const planes = element("div", page, undefined, "planes");
  charts.push(new PlaneChart(planes, "Along track and radial", "T", "R"), new PlaneChart(planes, "Cross track and radial", "N", "R"),
    new PlaneChart(planes, "Along track and cross track", "T", "N"));
}
if (report.charts.length || report.links.length || report.lanes.length) {
  element("h2", page, "Over time");
  now = element("div", page, undefined, "now screen");
}
if (report.lanes.length) charts.push(new LaneChart(page, report.lanes));
report.charts.forEach(c => charts.push(new TimeChart(page, c)));
report.links.forEach(link => charts.push(new LinkChart(page, link)));
if (report.arenas.length) {
  element("h2", page, "Heap arenas at the end");
  const box = element("div", page, undefined, "arenas");
  report.arenas.forEach(map => charts.push(new ArenaMap(box, map)));
}
report.films.forEach(film => {
  element("h2", page, film.name);
  const strip = element("div", page, undefined, "film");
  film.pictures.forEach(picture => {
    const box = element("figure", strip);
    const image = element("img", box);
    image.src = "data:image/png;base64," + picture.png;
    image.alt = picture.caption;
    element("figcaption", box, picture.caption + ", " + picture.at.toFixed(1) + " s");
  });
});
if (report.faults.length) {
  element("h2", page, "Faults");
  addTable(page, ["from", "until", "where", "what"],
    report.faults.map(f => [clock(f.from), f.until === undefined ? "end" : clock(f.until), f.where, f.what]), "");
}
if (report.events.length) addEvents();
window.addEventListener("resize", redraw);
window.matchMedia("(prefers-color-scheme:dark)").addEventListener("change", () => repaint());
applyTheme();
drawAll();

// ---- with #selftest, for the tests of this page: what the canvases show, read back from their pixels
function measured() {
  const result = {charts: [], problems, pictures: [...document.images].map(image => image.naturalWidth)};
  for (const chart of charts) {
    chart.draw();
    const pixels = chart.canvas.getContext("2d").getImageData(0, 0, chart.canvas.width, chart.canvas.height).data;
    let painted = 0;
    for (let i = 3; i < pixels.length; i += 4) painted += pixels[i] > 0;
    const one = {title: chart.canvas.dataset.chart, painted, series: []};
    if (chart instanceof TimeChart) chart.series.forEach((s, i) => one.series.push(measuredSeries(chart, s, i)));
    result.charts.push(one);
  }
  return result;
}
// Of one curve, drawn alone: the values at its topmost and lowest pixel in some columns.
function measuredSeries(chart, series, index) {
  chart.draw(index);
  const canvas = chart.canvas, scale = canvas.width / canvas.clientWidth, g = canvas.getContext("2d");
  const value = y => { const [lo, hi] = chart.axis; return hi - (y - 8) / (canvas.height / scale - 28) * (hi - lo); };
  const points = [];
  for (const part of [0.02, 0.1, 0.25, 0.5, 0.75, 0.9, 0.98]) {
    const x = Math.round(left + part * (canvas.clientWidth - left - right));
    const column = g.getImageData(Math.round(x * scale), 0, 1, canvas.height).data;
    const rows = [];
    for (let y = 0; y < canvas.height; ++y) if (column[4 * y + 3] > 100) rows.push((y + 0.5) / scale);
    if (rows.length) points.push({from: tOf(x, canvas.clientWidth), until: tOf(x + 1, canvas.clientWidth), most: value(rows[0]), least: value(rows[rows.length - 1])});
  }
  const onePixel = (chart.axis[1] - chart.axis[0]) / (canvas.height / scale - 28);
  return {name: series.name, pixel: onePixel, points};
}
// Pictures are decoded by then.
if (testing) addEventListener("load", () => { element("pre", document.body, JSON.stringify(measured())).id = "selftest"; });
