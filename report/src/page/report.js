'use strict';
// Draws the page's figures in place of their still pictures: axes, zoom and grid by uPlot, what stands on them here,
// since a path runs back and forth in x. What is read off stands in the legend; linked figures point at one sample.
(() => {

const { lists, figures: specs } = JSON.parse(document.getElementById('figures').textContent);
const drawn = [];
const inkOf = name => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
const said = v => v === null || v === undefined ? '–' : String(+v.toPrecision(4));
const matesOf = one => one.spec.link ? drawn.filter(o => o !== one && o.spec.link === one.spec.link) : [];

function element(tag, className, parent, text) {
  const e = document.createElement(tag);
  if (className) e.className = className;
  if (text) e.textContent = text;
  if (parent) parent.append(e);
  return e;
}

// Index of the number nearest to `key`, -1 if there is none.
function nearest(keys, key) {
  let best = -1, off = Infinity;
  keys.forEach((k, i) => {
    if (k !== null && Math.abs(k - key) < off) { off = Math.abs(k - key); best = i; }
  });
  return best;
}

// Decades, and within few of them 2 and 5 as well: uPlot counts from the lower end, which need not be a round number.
function logSplits(low, high) {
  const steps = Math.log10(high / low) > 2 ? [1] : [1, 2, 5], at = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); ++power)
    for (const step of steps) if (step * 10 ** power >= low && step * 10 ** power <= high) at.push(step * 10 ** power);
  return at;
}

// Names, colours and values, in one row; a click on a name hides what it names.
class Legend {
  constructor(parent, of, redraw) {
    this.row = element('div', 'legend', parent);
    this.values = of.map(s => {
      if (!s.label) return null;
      const button = element('button', '', this.row);
      button.type = 'button';
      const swatch = element('i', s.kind, button);
      swatch.style.color = `var(--${s.colour})`;
      button.append(s.label);
      button.onclick = () => { s.off = !s.off; button.classList.toggle('off', s.off); redraw(); };
      return element('b', '', button);
    });
    this.at = element('span', 'at', this.row);
  }
  clear() { this.values.forEach(v => { if (v) v.textContent = ''; }); this.at.textContent = ''; }
}

function strokeOn(context, points, close) {
  let down = false;
  context.beginPath();
  for (const p of points) {
    if (p === null) { down = false; continue; }
    if (down) context.lineTo(p[0], p[1]); else context.moveTo(p[0], p[1]);
    down = true;
  }
  if (close) context.closePath();
}

class Chart {
  constructor(holder, spec) {
    this.spec = spec;
    this.holder = holder;
    for (const s of spec.series) {
      for (const name of ['x', 'y', 'high', 'key']) if (s[name] !== undefined) s[name] = lists[s[name]];
      s.ordered = s.x.every((v, i) => i === 0 || v === null || s.x[i - 1] === null || v >= s.x[i - 1]);
    }
    this.keyed = spec.series.some(s => s.key);
    this.height = spec.height + (spec.x ? 46 : 28);
    this.x = spec.x_range;
    this.y = spec.y_range;
    this.live = element('div', 'live', holder);
    if (spec.title) element('div', 'name', this.live, spec.title);
    this.legend = new Legend(this.live, spec.series, () => this.plot.redraw());
    this.box = element('div', '', this.live);
    this.resetButton = element('button', 'reset', this.live, 'whole');
    this.resetButton.type = 'button';
    this.resetButton.hidden = true;
    this.resetButton.onclick = () => this.zoom(null, null, true);
    holder.classList.add('drawn');
    this.build();
    new ResizeObserver(() => {
      const width = this.box.clientWidth;
      if (width > 0 && width !== this.plot.width) this.plot.setSize({ width, height: this.height });
    }).observe(this.box);
  }

  build() {
    if (this.plot) this.plot.destroy();
    const spec = this.spec, soft = inkOf('soft'), grid = inkOf('grid');
    const axis = { stroke: soft, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, size: 4 }, font: '11px system-ui, sans-serif',
      labelFont: '11px system-ui, sans-serif', labelGap: 0, values: (_, at) => at.map(v => v === null ? '' : said(v)) };
    const chart = this;
    const logarithmic = { splits: (_, index, low, high) => logSplits(low, high), filter: (_, at) => at };
    this.plot = new uPlot({
      width: this.box.clientWidth || 600, height: this.height, legend: { show: false },
      cursor: { x: false, y: false, points: { show: false }, drag: { x: true, y: true, uni: 24, setScale: false },
        bind: { dblclick: () => () => { chart.zoom(null, null, true); return null; } } },
      scales: { x: { time: false, distr: spec.log_x ? 3 : 1, range: () => chart.x },
                y: { distr: spec.log_y ? 3 : 1, range: () => chart.y } },
      axes: [{ ...axis, ...(spec.log_x ? logarithmic : {}), label: spec.x || null, labelSize: spec.x ? 18 : 0, size: 26, space: 55 },
             { ...axis, ...(spec.log_y ? logarithmic : {}), label: spec.y, labelSize: 18, space: 26,
               // Panels below each other line up: all of one width unless a number needs more.
               size: (_, values) => Math.max(this.box.clientWidth > 500 ? 54 : 30, 12 + 6.4 * Math.max(2, ...(values || []).map(v => v.length))) }],
      series: [{}, { show: true, paths: () => null, points: { show: false } }],
      hooks: { drawClear: [u => this.drawSpans(u)], draw: [u => this.draw(u)], setSelect: [u => this.selected(u)] },
    }, [spec.x_range, spec.y_range], this.box);
    const over = this.plot.over;
    this.hair = element('div', 'hair', over);
    this.marks = spec.series.map(s => { const m = element('div', 'mark', over); m.style.background = `var(--${s.colour})`; return m; });
    over.addEventListener('pointermove', e => {
      const box = over.getBoundingClientRect();
      this.hover(e.clientX - box.left, e.clientY - box.top);
    });
    over.addEventListener('pointerleave', () => { this.leave(); matesOf(this).forEach(m => m.leave()); });
  }

  // ---- drawing

  clipped(u, what) {
    const c = u.ctx;
    c.save();
    c.beginPath();
    c.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    c.clip();
    what(c, window.devicePixelRatio || 1);
    c.restore();
  }

  drawSpans(u) {
    this.clipped(u, c => {
      c.fillStyle = inkOf('span');
      for (const [from, to] of this.spec.spans || []) {
        const left = u.valToPos(from, 'x', true), right = u.valToPos(to, 'x', true);
        c.fillRect(left, u.bbox.top, Math.max(right - left, 2), u.bbox.height);
      }
    });
  }

  draw(u) {
    this.clipped(u, (c, scale) => {
      const px = (x, y) => x === null || y === null ? null : [u.valToPos(x, 'x', true), u.valToPos(y, 'y', true)];
      c.font = `${11 * scale}px system-ui, sans-serif`;
      for (const r of this.spec.references || []) {
        const { left, top, width, height } = u.bbox;
        const at = u.valToPos(r.at, r.level ? 'y' : 'x', true);
        strokeOn(c, r.level ? [[left, at], [left + width, at]] : [[at, top], [at, top + height]]);
        c.setLineDash([3 * scale, 3 * scale]);
        c.strokeStyle = c.fillStyle = inkOf('soft');
        c.lineWidth = scale;
        c.stroke();
        c.setLineDash([]);
      }
      for (const s of this.spec.series) if (!s.off) this.drawSeries(c, scale, s, px);
      const labels = [];
      const edges = this.spec.series.flatMap(s => s.off ? [] : labelPlace.edgesOf(s, px));
      for (const r of this.spec.references || []) {  // with a rim of the ground, should there be no place without a curve
        if (!r.label) continue;
        const at = u.valToPos(r.at, r.level ? 'y' : 'x', true), wide = c.measureText(r.label).width;
        const box = labelPlace.leastCrossed(labelPlace.placesOn(u.bbox, r.level, at, wide, scale), edges, scale);
        edges.push([[box.left, box.top], [box.right, box.bottom]], [[box.left, box.bottom], [box.right, box.top]]);
        labels.push({ text: r.label, ...box });
        const place = [box.left, box.bottom - 2 * scale];
        c.textAlign = 'left';
        c.lineWidth = 3 * scale;
        c.lineJoin = 'round';
        c.strokeStyle = inkOf('ground');
        c.fillStyle = inkOf('soft');
        c.strokeText(r.label, ...place);
        c.fillText(r.label, ...place);
      }
      c.canvas.dataset.labels = JSON.stringify(labels);  // where they stand, for who looks
    });
  }

  drawSeries(c, scale, s, px) {
    const ink = inkOf(s.colour), points = s.x.map((x, i) => px(x, s.y[i]));
    c.strokeStyle = c.fillStyle = ink;
    if (s.kind === 'points') {
      c.globalAlpha = s.faint ? 0.35 : 1;
      const r = scale * (s.faint ? 1.3 : points.length > 60 ? 1.8 : 3.2);
      for (const p of points) if (p) { c.beginPath(); c.arc(p[0], p[1], r, 0, 7); c.fill(); }
    } else if (s.kind === 'band') {
      c.globalAlpha = 0.22;
      let low = [], high = [];
      for (let i = 0; i <= points.length; ++i) {
        const top = i < points.length && points[i] ? px(s.x[i], s.high[i]) : null;
        if (top) { low.push(points[i]); high.push(top); continue; }
        if (low.length === 1) { c.lineWidth = 5 * scale; strokeOn(c, [low[0], high[0]]); c.stroke(); }
        if (low.length > 1) { strokeOn(c, high.concat(low.reverse()), true); c.fill(); }
        low = []; high = [];
      }
    } else if (s.kind === 'bars') {
      c.globalAlpha = 0.6;
      c.lineWidth = 3 * scale;
      points.forEach((p, i) => { if (p) { strokeOn(c, [p, px(s.x[i], s.high[i])]); c.stroke(); } });
    } else {
      const path = s.kind !== 'step' ? points : points.flatMap((p, i) => i && p && points[i - 1] ? [[p[0], points[i - 1][1]], p] : [p]);
      c.lineWidth = 1.8 * scale;
      c.lineJoin = 'round';
      c.setLineDash(s.kind === 'dashed' ? [6 * scale, 4 * scale] : []);
      strokeOn(c, path);
      c.stroke();
      c.setLineDash([]);
    }
    c.globalAlpha = 1;
  }

  // ---- reading off

  hover(left, top) {
    const u = this.plot;
    let main = null, closest = Infinity;
    const found = this.spec.series.map(s => {
      let best = -1, off = Infinity, away = Infinity;
      for (let i = 0; !s.off && i < s.x.length; ++i) {
        if (!this.seen(s, i)) continue;
        const dx = u.valToPos(s.x[i], 'x') - left;
        if (Math.abs(dx) > 40) continue;
        const y = s.high ? Math.min(Math.max(top, u.valToPos(s.high[i], 'y')), u.valToPos(s.y[i], 'y')) : u.valToPos(s.y[i], 'y');
        const distance = Math.hypot(dx, y - top), here = s.ordered ? Math.abs(dx) + 1e-3 * distance : distance;
        if (here < off) { off = here; away = distance; best = i; }
      }
      if (best >= 0 && away < closest && (s.key || !this.keyed)) { closest = away; main = { s, i: best }; }
      return best;
    });
    if (!main) { this.leave(); return; }
    const key = main.s.key ? main.s.key[main.i] : main.s.x[main.i];
    if (this.keyed) this.receive(key); else this.show(found, main.s.x[main.i]);
    matesOf(this).forEach(m => m.receive(key));
  }

  // A sample that a linked figure points at.
  receive(key) {
    const found = this.spec.series.map(s => {
      if (s.off || (this.keyed && !s.key)) return -1;
      return nearest(this.keyed ? s.key : s.x, key);
    });
    const first = found.findIndex((i, k) => this.seen(this.spec.series[k], i));
    if (first < 0) this.leave(); else this.show(found, this.spec.series[first].x[found[first]]);
  }

  seen(s, i) { return i >= 0 && s.x[i] !== null && s.y[i] !== null; }

  show(found, x) {
    const u = this.plot;
    found.forEach((i, k) => {
      const s = this.spec.series[k], there = this.seen(s, i);
      const value = !there ? '–' : s.high ? `${said(s.y[i])} to ${said(s.high[i])}` : said(s.y[i]);
      if (this.legend.values[k]) this.legend.values[k].textContent = value;
      const dot = this.marks[k], to = there && !s.high ? [u.valToPos(s.x[i], 'x'), u.valToPos(s.y[i], 'y')] : null;
      const inside = to && to[0] >= 0 && to[1] >= 0 && to[0] <= u.over.clientWidth && to[1] <= u.over.clientHeight;
      dot.style.display = inside ? 'block' : 'none';
      if (inside) { dot.style.left = to[0] + 'px'; dot.style.top = to[1] + 'px'; }
    });
    this.legend.at.textContent = `at ${said(x)}`;
    const left = u.valToPos(x, 'x');
    this.hair.style.display = left >= 0 && left <= u.over.clientWidth ? 'block' : 'none';
    this.hair.style.left = left + 'px';
  }

  leave() {
    this.legend.clear();
    this.hair.style.display = 'none';
    this.marks.forEach(m => { m.style.display = 'none'; });
  }

  // ---- zoom

  selected(u) {
    const { left, top, width, height } = u.select;
    if (width < 4 && height < 4) return;
    const whole = height >= u.over.clientHeight - 1, wide = width >= u.over.clientWidth - 1;
    const x = wide || width < 4 ? this.x : [u.posToVal(left, 'x'), u.posToVal(left + width, 'x')];
    const y = whole || height < 4 ? null : [u.posToVal(top + height, 'y'), u.posToVal(top, 'y')];
    u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.zoom(x, y, true);
  }

  // What is seen between these x, with a little room; null if there is nothing.
  extentWithin([from, to]) {
    let low = Infinity, high = -Infinity;
    for (const s of this.spec.series) {
      if (s.off) continue;
      s.x.forEach((x, i) => {
        if (x === null || s.y[i] === null || x < from || x > to) return;
        low = Math.min(low, s.y[i]);
        high = Math.max(high, s.high ? s.high[i] : s.y[i]);
      });
    }
    if (!(low <= high)) return null;
    if (this.spec.log_y) return low > 0 ? [low / 1.2, high * 1.2] : null;
    const room = high > low ? 0.06 * (high - low) : 0.5 * Math.abs(low) || 1;
    return [low - room, high + room];
  }

  zoom(x, y, tell) {
    const u = this.plot, whole = x === null;
    this.x = whole ? this.spec.x_range : x;
    this.y = y || (whole ? this.spec.y_range : this.extentWithin(this.x) || this.spec.y_range);
    u.batch(() => {
      u.setScale('x', { min: this.x[0], max: this.x[1] });
      u.setScale('y', { min: this.y[0], max: this.y[1] });
    });
    this.leave();
    this.resetButton.hidden = whole;
    if (tell && !this.keyed) matesOf(this).forEach(m => { if (m.zoom && !m.keyed) m.zoom(x, null, false); });
  }
}

// Paths in space: z, the way in, to the right; drag to turn.
class SpaceView {
  constructor(holder, spec) {
    for (const p of spec.paths) {
      const [x, y, z] = p.at.map(place => lists[place]);
      p.at = x.map((v, i) => [v, y[i], z[i]]);
      if (p.key !== undefined) p.key = lists[p.key];
    }
    this.spec = spec;
    this.home = { turn: -0.6, tilt: 0.45 };  // as the still picture
    this.eye = { ...this.home };
    this.live = element('div', 'live', holder);
    this.legend = new Legend(this.live, spec.paths, () => this.build());
    this.canvas = element('canvas', 'space', this.live);
    this.canvas.style.height = spec.height + 'px';
    element('div', 'at', this.live, 'Drag to turn, double-click for the first view. One scale on all three axes.').style.cssText =
      'font-size:11.5px;color:var(--soft)';
    holder.classList.add('drawn');
    const of = (index, pick) => pick(0, ...spec.paths.flatMap(p => p.at.map(a => a[index])).filter(v => v !== null));
    this.low = [0, 1, 2].map(i => of(i, Math.min));
    this.high = [0, 1, 2].map(i => of(i, Math.max));
    this.pointed = null;
    this.canvas.addEventListener('pointerdown', down => {
      this.canvas.setPointerCapture(down.pointerId);
      this.drag = { ...this.eye, x: down.clientX, y: down.clientY };
    });
    this.canvas.addEventListener('pointermove', e => this.drag ? this.turn(e) : this.hover(e));
    for (const end of ['pointerup', 'pointercancel']) this.canvas.addEventListener(end, () => { this.drag = null; });
    this.canvas.addEventListener('pointerleave', () => { this.leave(); matesOf(this).forEach(m => m.leave()); });
    this.canvas.addEventListener('dblclick', () => { this.eye = { ...this.home }; this.build(); });
    new ResizeObserver(() => this.build()).observe(this.live);
    this.build();
  }

  turn(e) {
    this.eye.turn = this.drag.turn + (e.clientX - this.drag.x) / 150;
    this.eye.tilt = Math.max(-1.57, Math.min(1.57, this.drag.tilt + (e.clientY - this.drag.y) / 150));
    this.build();
  }

  turned([x, y, z]) {
    const { turn, tilt } = this.eye, c = Math.cos(turn), s = Math.sin(turn);
    return [c * z - s * x, Math.cos(tilt) * y - Math.sin(tilt) * (s * z + c * x)];
  }

  build() {
    const box = this.canvas.getBoundingClientRect(), scale = window.devicePixelRatio || 1;
    if (!box.width) return;
    this.canvas.width = Math.round(box.width * scale);
    this.canvas.height = Math.round(box.height * scale);
    const c = this.canvas.getContext('2d');
    c.setTransform(scale, 0, 0, scale, 0, 0);
    c.font = '11px system-ui, sans-serif';
    const radius = Math.max(0.55 * Math.hypot(...this.low.map((v, i) => this.high[i] - v)), 1e-6);
    const perMm = 0.5 * Math.min(box.width, 1.9 * box.height) / radius;
    const from = this.turned(this.low.map((v, i) => (v + this.high[i]) / 2));
    this.place = p => {
      if (p.includes(null)) return null;
      const [u, v] = this.turned(p);
      return [box.width / 2 + perMm * (u - from[0]), box.height / 2 - perMm * (v - from[1])];
    };
    const side = Math.max(10, ...[0, 1].map(i => Math.max(-this.low[i], this.high[i])));
    const axes = [['x', [side, 0, 0], side], ['y', [0, side, 0], side], ['z', [0, 0, this.high[2]], this.high[2]]];
    for (const [name, tip, mm] of axes) {
      strokeOn(c, [this.place([0, 0, 0]), this.place(tip)]);
      c.strokeStyle = inkOf('faint');
      c.stroke();
      c.fillStyle = inkOf('soft');
      c.fillText(`${name} ${Math.round(mm)} mm`, this.place(tip)[0] + 4, this.place(tip)[1] + 4);
    }
    for (const p of this.spec.paths) {
      if (p.off) continue;
      const points = p.at.map(this.place);
      c.strokeStyle = c.fillStyle = inkOf(p.colour);
      if (p.kind === 'points') {
        for (const q of points) if (q) { c.beginPath(); c.arc(q[0], q[1], points.length > 60 ? 1.5 : 4.5, 0, 7); c.fill(); }
        continue;
      }
      c.lineWidth = 2;
      c.setLineDash(p.kind === 'dashed' ? [6, 4] : []);
      strokeOn(c, points);
      c.stroke();
      c.setLineDash([]);
    }
    c.lineWidth = 1;
    (this.pointed || []).forEach((i, k) => {
      const q = i >= 0 ? this.place(this.spec.paths[k].at[i]) : null;
      if (!q) return;
      c.beginPath();
      c.arc(q[0], q[1], 5, 0, 7);
      c.fillStyle = inkOf(this.spec.paths[k].colour);
      c.fill();
      c.strokeStyle = inkOf('ground');
      c.stroke();
    });
  }

  hover(e) {
    const box = this.canvas.getBoundingClientRect(), x = e.clientX - box.left, y = e.clientY - box.top;
    let main = null, closest = 25;
    this.spec.paths.forEach((p, k) => p.at.forEach((a, i) => {
      const q = p.off ? null : this.place(a);
      if (q && Math.hypot(q[0] - x, q[1] - y) < closest) { closest = Math.hypot(q[0] - x, q[1] - y); main = { k, i }; }
    }));
    if (!main) { this.leave(); return; }
    const { key } = this.spec.paths[main.k];
    if (key) { this.receive(key[main.i]); matesOf(this).forEach(m => m.receive(key[main.i])); }
    else { this.point(this.spec.paths.map((_, k) => k === main.k ? main.i : -1)); }
  }

  receive(key) { this.point(this.spec.paths.map(p => p.key && !p.off ? nearest(p.key, key) : -1)); }

  point(indices) {
    this.pointed = indices;
    indices.forEach((i, k) => {
      const value = this.legend.values[k];
      if (value) value.textContent = i < 0 ? '' : `${this.spec.paths[k].at[i].map(said).join(', ')} mm`;
    });
    this.build();
  }

  leave() { if (this.pointed) { this.pointed = null; this.legend.clear(); this.build(); } }
}

// A figure is made when it comes near to what is seen; if it cannot be, its still picture stays.
function make(holder) {
  const spec = specs[holder.dataset.figure];
  try {
    drawn.push(spec.space ? new SpaceView(holder, spec) : new Chart(holder, spec));
  } catch (error) {
    holder.classList.remove('drawn');
    holder.querySelectorAll('.live').forEach(e => e.remove());
    console.error('figure ' + holder.dataset.figure + ': ' + error);
  }
}
const near = new IntersectionObserver(entries => {
  for (const e of entries) if (e.isIntersecting) { near.unobserve(e.target); make(e.target); }
}, { rootMargin: '600px' });
document.querySelectorAll('[data-figure]').forEach(e => near.observe(e));

// The colours are other ones then, and canvases do not follow a style sheet.
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => drawn.forEach(one => one.build()));

})();
