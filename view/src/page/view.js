'use strict';
// Draws what /events says: the newest state, a row of the charts each time, and the path, of which the page keeps its
// own copy. Every age goes on counting here between events, so that what is old looks old when nothing arrives at all.

const kStale_s = { needle: 0.5, axes: 0.5, command: 0.5, truth: 0.5, camera: 0.5, picture: 1.5, process: 3 };
const kCut_s = 2.5;               // no event, not even the server's pulse of a second
const kChi2_3_95 = 7.815;         // 95 % of a normal density in three dimensions, and in two
const kChi2_2_95 = 5.991;
const byId = id => document.getElementById(id);
const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const fixed = (value, digits) => value === null || value === undefined ? '–' : value.toFixed(digits);

// With ?still the page shows the state as it is when it is opened, and does not follow: to be kept or printed.
const still = location.search === '?still';

let state = null, heard = 0, insertion = -1, path = [], rows = [];
const unheard_s = () => still ? 0 : (performance.now() - heard) / 1000;
const age = of => of === undefined ? Infinity : of + unheard_s();

// ---- what is heard

function begin(history) {
  insertion = history.insertion;
  path = history.path_mm;
  rows = history.rows;
  charts.forEach(chart => chart.draw());
}

async function beginAnew() {
  insertion = -1;
  begin(await (await fetch('/history')).json());
}

function extend(next) {
  if (next.needle) {
    const p = next.needle.position_mm, last = path[path.length - 1];
    if (!last || Math.hypot(p[0] - last[0], p[1] - last[1], p[2] - last[2]) > 0.2) path.push(p);
  }
  if (!next.row) return;
  if (rows.length === 0) rows = next.row.map(() => []);
  if (rows[0].length && next.row[0] <= rows[0][rows[0].length - 1]) return;  // the history had it already
  next.row.forEach((value, i) => rows[i].push(value));
}

async function hear(event) {
  const next = JSON.parse(event.data);
  heard = performance.now();
  const resets = state && state.needle && next.needle && state.needle.resets !== next.needle.resets;
  state = next;
  if (insertion === -1 && !next.insertion) return;
  if (next.insertion !== insertion || resets) {
    insertion = next.insertion;
    await beginAnew();
  } else {
    extend(next);
  }
}

if (still) {
  fetch('/state').then(answer => answer.text()).then(data => hear({ data }));
} else {
  const events = new EventSource('/events');
  events.onmessage = hear;
  events.onopen = () => { heard = performance.now(); };
}

// ---- the path

function matrixOf(covariance) { return [0, 1, 2].map(i => covariance.slice(3 * i, 3 * i + 3)); }

// Points of the 95 % ellipse of a 2 x 2 covariance, as seen.
function ellipse(a, b, d, chi2) {
  const mean = (a + d) / 2, off = Math.sqrt(Math.max(0, ((a - d) / 2) ** 2 + b * b));
  const angle = 0.5 * Math.atan2(2 * b, a - d);
  const r1 = Math.sqrt(Math.max(0, chi2 * (mean + off))), r2 = Math.sqrt(Math.max(0, chi2 * (mean - off)));
  return Array.from({ length: 49 }, (_, i) => {
    const t = i * Math.PI / 24, u = r1 * Math.cos(t), v = r2 * Math.sin(t);
    return [u * Math.cos(angle) - v * Math.sin(angle), u * Math.sin(angle) + v * Math.cos(angle)];
  });
}

function canvasOf(id) {
  const canvas = byId(id), box = canvas.getBoundingClientRect(), scale = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(box.width * scale) || canvas.height !== Math.round(box.height * scale)) {
    canvas.width = Math.round(box.width * scale);
    canvas.height = Math.round(box.height * scale);
  }
  const context = canvas.getContext('2d');
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, box.width, box.height);
  context.font = '11px system-ui, sans-serif';
  return { context, width: box.width, height: box.height };
}

function stroke(context, points, colour, width, dash = []) {
  if (points.length < 2) return;
  context.beginPath();
  points.forEach(([x, y], i) => i ? context.lineTo(x, y) : context.moveTo(x, y));
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.setLineDash(dash);
  context.stroke();
  context.setLineDash([]);
}

function dot(context, [x, y], colour, radius) {
  context.beginPath();
  context.arc(x, y, radius, 0, 7);
  context.fillStyle = colour;
  context.fill();
}

// A round step of which about `count` fit.
function stepOf(span, count) {
  const raw = span / count, unit = 10 ** Math.floor(Math.log10(raw));
  return [1, 2, 5, 10].map(f => f * unit).find(s => s >= raw);
}

// Labels of an axis whose ticks are `step` apart: as many decimals as tell neighbours apart, the same for all of them.
function labelsOf(values, step) {
  let decimals = 0;
  while (decimals < 12 && Math.abs(step * 10 ** decimals - Math.round(step * 10 ** decimals)) > 1e-6 * step * 10 ** decimals) ++decimals;
  return values.map(v => v === null ? '' : Number(v.toFixed(decimals)) === 0 ? (0).toFixed(decimals) : v.toFixed(decimals));
}

// Everything that the drawings must hold.
function reach() {
  const all = path.slice();
  if (state.needle) all.push(state.needle.position_mm);
  if (state.target) all.push(state.target.position_mm);
  if (state.truth_mm) all.push(state.truth_mm);
  all.push([0, 0, 0], [0, 0, 20]);
  const low = [0, 1, 2].map(i => Math.min(...all.map(p => p[i])));
  const high = [0, 1, 2].map(i => Math.max(...all.map(p => p[i])));
  return { low, high };
}

function drawPlane(id, axis) {
  const { context, width, height } = canvasOf(id), { low, high } = reach();
  const left = 36, bottom = 20, top = 8, right = 10;
  const tolerance = state.target ? state.target.tolerance_mm : 0;
  const half = Math.max(1, 1.15 * Math.max(high[axis] + tolerance, -low[axis] + tolerance));
  const deep = 1.05 * high[2], z0 = Math.min(0, low[2]);
  const x = z => left + (z - z0) / (deep - z0) * (width - left - right);
  const y = v => top + (half - v) / (2 * half) * (height - top - bottom);
  const faint = style('--faint'), line = style('--line');
  context.fillStyle = faint;
  context.textAlign = 'right';
  const lateral = stepOf(2 * half, 5), along = stepOf(deep - z0, 5);
  for (let v = Math.ceil(-half / lateral) * lateral; v <= half; v += lateral) {
    stroke(context, [[left, y(v)], [width - right, y(v)]], line, 1);
    context.fillText(labelsOf([v], lateral)[0], left - 4, y(v) + 4);
  }
  context.textAlign = 'center';
  for (let v = 0; v <= deep; v += along) {
    stroke(context, [[x(v), top], [x(v), height - bottom]], line, 1);
    context.fillText(labelsOf([v], along)[0], x(v), height - 6);
  }
  stroke(context, path.map(p => [x(p[2]), y(p[axis])]), style('--estimate'), 2);
  if (state.target) {
    const t = state.target.position_mm, ring = [];
    for (let i = 0; i <= 48; ++i)
      ring.push([x(t[2] + tolerance * Math.cos(i * Math.PI / 24)), y(t[axis] + tolerance * Math.sin(i * Math.PI / 24))]);
    stroke(context, ring, style('--target'), 2);
    dot(context, [x(t[2]), y(t[axis])], style('--target'), 2.5);
  }
  if (state.truth_mm) dot(context, [x(state.truth_mm[2]), y(state.truth_mm[axis])], style('--truth'), 3.5);
  if (state.needle) {
    const p = state.needle.position_mm, P = matrixOf(state.needle.covariance_mm2);
    const old = age(state.age_s.needle) > kStale_s.needle;
    stroke(context, ellipse(P[2][2], P[2][axis], P[axis][axis], kChi2_2_95)
      .map(([dz, dv]) => [x(p[2] + dz), y(p[axis] + dv)]), style(old ? '--stale' : '--estimate'), 1.5);
    dot(context, [x(p[2]), y(p[axis])], style(old ? '--stale' : '--estimate'), 3);
  }
}

const home = { turn: -0.6, tilt: 0.45 };
let eye = { ...home };

function drawSpace() {
  const { context, width, height } = canvasOf('space'), { low, high } = reach();
  // z of {A}, the way in, runs to the right; the eye goes around the middle.
  const middle = low.map((v, i) => (v + high[i]) / 2);
  const radius = 0.55 * Math.hypot(...low.map((v, i) => high[i] - v)) || 1;
  const scale = 0.5 * Math.min(width, 1.9 * height) / radius;
  const c = Math.cos(eye.turn), s = Math.sin(eye.turn), ct = Math.cos(eye.tilt), st = Math.sin(eye.tilt);
  const turned = p => {
    const [a, b, d] = [p[2], p[0], p[1]];  // right, towards the eye, up
    return [c * a - s * b, ct * d - st * (s * a + c * b)];
  };
  const from = turned(middle);
  const at = p => {
    const [u, v] = turned(p);
    return [width / 2 + scale * (u - from[0]), height / 2 - scale * (v - from[1])];
  };
  const line = style('--line'), faint = style('--faint');
  // The entry plane and the line along which a needle that does not bend would go.
  const side = Math.max(10, 1.1 * Math.max(...[0, 1].map(i => Math.max(high[i], -low[i]))));
  stroke(context, [[-side, -side, 0], [side, -side, 0], [side, side, 0], [-side, side, 0], [-side, -side, 0]].map(at), line, 1);
  stroke(context, [at([0, 0, 0]), at([0, 0, high[2]])], line, 1, [4, 4]);
  context.fillStyle = faint;
  context.textAlign = 'left';
  for (const [name, tip] of [['x', [side, 0, 0]], ['y', [0, side, 0]]]) {
    stroke(context, [at([0, 0, 0]), at(tip)], faint, 1);
    context.fillText(`${name} ${side.toFixed(0)} mm`, at(tip)[0] + 4, at(tip)[1]);
  }
  context.fillText(`z ${high[2].toFixed(0)} mm`, at([0, 0, high[2]])[0] + 4, at([0, 0, high[2]])[1] + 12);
  stroke(context, path.map(at), style('--estimate'), 2.5);
  if (state.target) {
    const [x, y] = at(state.target.position_mm);
    context.beginPath();
    context.arc(x, y, Math.max(3, scale * state.target.tolerance_mm), 0, 7);
    context.strokeStyle = style('--target');
    context.lineWidth = 2;
    context.stroke();
  }
  if (state.truth_mm) dot(context, at(state.truth_mm), style('--truth'), 3.5);
  if (state.needle) {
    const n = state.needle, old = age(state.age_s.needle) > kStale_s.needle;
    const colour = style(old ? '--stale' : '--estimate');
    // The shadow of the ellipsoid on the picture's plane: the covariance of what is drawn.
    const P = matrixOf(n.covariance_mm2), rows = [turned([1, 0, 0]), turned([0, 1, 0]), turned([0, 0, 1])];
    const seen = (i, j) => { let sum = 0; for (let a = 0; a < 3; ++a) for (let b = 0; b < 3; ++b) sum += rows[a][i] * P[a][b] * rows[b][j]; return sum; };
    const [x, y] = at(n.position_mm);
    stroke(context, ellipse(seen(0, 0), seen(0, 1), seen(1, 1), kChi2_3_95).map(([u, v]) => [x + scale * u, y - scale * v]), colour, 1.5);
    dot(context, [x, y], colour, 3);
    stroke(context, [[x, y], at(n.position_mm.map((v, i) => v + 8 * n.heading[i]))], colour, 2);
  }
}

const space = byId('space');
space.addEventListener('pointerdown', down => {
  space.setPointerCapture(down.pointerId);
  const start = { ...eye };
  const move = e => {
    eye.turn = start.turn + (e.clientX - down.clientX) / 150;
    eye.tilt = Math.max(-1.57, Math.min(1.57, start.tilt + (e.clientY - down.clientY) / 150));
  };
  space.addEventListener('pointermove', move);
  space.addEventListener('pointerup', () => space.removeEventListener('pointermove', move), { once: true });
});
space.addEventListener('dblclick', () => { eye = { ...home }; });

// ---- the charts

class Chart {
  // series: [label, column of the rows, colour, dashed]
  constructor(title, unit, series, scale = {}) {
    this.series = series;
    this.holder = document.createElement('div');
    this.holder.className = 'chart';
    byId('charts').append(this.holder);
    const axis = { values: (_, ticks, index, space, step) => labelsOf(ticks, step), stroke: style('--faint'), grid: { stroke: style('--line'), width: 1 }, ticks: { stroke: style('--line') }, font: '11px system-ui' };
    this.plot = new uPlot({
      title: unit ? `${title} (${unit})` : title, width: 400, height: 130, cursor: { sync: { key: 'time' } },
      scales: { x: { time: false }, y: scale },
      axes: [axis, { ...axis, size: (_, labels) => Math.max(60, 18 + 7 * Math.max(0, ...(labels || []).map(l => l.length))) }],
      series: [{ label: 's', value: (_, v) => fixed(v, 2) }].concat(series.map(([label, , colour, dashed]) =>
        ({ label, stroke: style(colour), width: 1.5, dash: dashed ? [5, 4] : [], spanGaps: true,
           value: (_, v) => v === null || v === undefined ? '–' : String(+v.toPrecision(4)) }))),
    }, [[]].concat(series.map(() => [])), this.holder);
  }
  draw() {
    if (!rows.length) return;
    const width = this.holder.clientWidth - 6;
    if (width > 0 && width !== this.plot.width) this.plot.setSize({ width, height: 130 });
    this.plot.setData([rows[0]].concat(this.series.map(([, column]) => rows[1 + column])));
  }
}

const charts = [];
function makeCharts() {
  charts.push(
    new Chart('insertion rate', 'mm/s', [['commanded', 0, '--target', true], ['axis', 1, '--estimate']]),
    new Chart('rotation rate', 'rad/s', [['commanded', 2, '--target', true], ['axis', 3, '--estimate']]),
    new Chart('distance to the target', 'mm', [['distance', 7, '--estimate']]),
    new Chart('test ratio, above 1 is rejected', '', [['first camera', 8, '--estimate'], ['second camera', 9, '--target']],
              { range: (_, low, high) => [0, Math.max(1.2, high)] }),
    new Chart('k', '1/mm', [['k', 4, '--estimate']]),
    new Chart('slip', 'lambda1 1/rad, lambda2', [['lambda1', 5, '--estimate'], ['lambda2', 6, '--target']]));
}

// ---- figures and tables

function fact(name, value, note, old) {
  const box = document.createElement('div'), b = document.createElement('b'), span = document.createElement('span');
  box.className = 'fact' + (old ? ' stale' : '');
  b.textContent = value;
  span.textContent = name + (note ? ' · ' + note : '');
  box.append(b, span);
  return box;
}

function drawFacts() {
  const all = [];
  const needleOld = age(state.age_s.needle) > kStale_s.needle, axesOld = age(state.age_s.axes) > kStale_s.axes;
  if (state.needle) {
    const n = state.needle, p = n.position_mm;
    if (state.target) {
      const t = state.target.position_mm;
      all.push(fact('to the target', fixed(Math.hypot(...p.map((v, i) => v - t[i])), 2) + ' mm', state.target.tolerance_mm > 0 ? `tolerance ${fixed(state.target.tolerance_mm, 2)} mm` : '', needleOld));
    }
    all.push(fact('tip x, y, z', p.map(v => fixed(v, 1)).join(', '), 'mm', needleOld));
    const curvature = n.curvature_per_mm;
    all.push(fact('k', `${fixed(1e3 * curvature, 2)} ± ${fixed(1e3 * n.curvature_sd_per_mm, 2)}`,
      '1e-3/mm' + (curvature ? `, radius ${fixed(1 / curvature, 0)} mm` : ''), needleOld));
    all.push(fact('lambda1', `${fixed(n.lambda1_per_rad, 2)} ± ${fixed(n.lambda1_sd_per_rad, 2)}`, '1/rad', needleOld));
    all.push(fact('lambda2', `${fixed(n.lambda2, 3)} ± ${fixed(n.lambda2_sd, 3)}`, '', needleOld));
    const well = n.health === 'healthy';
    all.push(fact('estimate', well ? 'healthy' : n.healthy ? 'unsure' : 'unhealthy', well ? `${n.resets} resets` : n.health, needleOld));
  }
  if (state.axes) {
    const a = state.axes;
    all.push(fact('insertion', `${fixed(a.insertion_mm, 1)} mm`, a.status[0], axesOld));
    all.push(fact('rotation', `${fixed(a.rotation_rad / (2 * Math.PI), 2)} turns`, a.status[1], axesOld));
  }
  byId('facts').replaceChildren(...all);
}

function row(cells, old) {
  const tr = document.createElement('tr');
  if (old) tr.className = 'stale';
  for (const [text, kind] of cells) {
    const td = document.createElement('td');
    td.textContent = text;
    if (kind) td.className = kind;
    tr.append(td);
  }
  return tr;
}

// ---- what the cameras see

const pictures = new Map();  // by camera: its figure and the picture in it

// Age in seconds of the picture that is shown, or of the announced one until the first has arrived.
function pictureAge(shown, announced) {
  if (shown.tip === undefined) return age(announced.age_s);
  return shown.age_s + (still ? 0 : (performance.now() - shown.drawn) / 1000);
}

function captionPicture(shown, announced) {
  const old_s = pictureAge(shown, announced);
  shown.figure.className = old_s > kStale_s.picture ? 'old' : '';
  // The tip belongs to the picture: there is nothing to report of a picture that has not arrived.
  const text = shown.tip === undefined ? 'waiting for the picture' : `${shown.tip} · ${fixed(old_s, 1)} s old`;
  shown.caption.textContent = `camera ${announced.camera} · ${text}`;
}

function drawPictures() {
  for (const [camera, shown] of pictures)
    if (!state.pictures.some(p => p.camera === camera)) { shown.figure.remove(); pictures.delete(camera); }
  for (const p of state.pictures) {
    let shown = pictures.get(p.camera);
    if (!shown) {
      const figure = document.createElement('figure'), canvas = document.createElement('canvas'), caption = document.createElement('figcaption');
      canvas.setAttribute('aria-label', `Picture of camera ${p.camera}`);
      figure.append(canvas, caption);
      byId('pictures').append(figure);
      pictures.set(p.camera, shown = { figure, canvas, caption, count: 0, asking: false });
    }
    captionPicture(shown, p);
    if (shown.count !== p.count && !shown.asking) showPicture(shown, p);
  }
}

async function showPicture(shown, p) {
  shown.asking = true;
  const [asked_s, asked] = [age(p.age_s), performance.now()];
  try {
    const answer = await fetch(`/picture/${p.camera}/${p.count}`);
    if (!answer.ok) { shown.count = p.count; return; }  // there is a newer one by now
    const picture = await createImageBitmap(await answer.blob());
    const { canvas } = shown, context = canvas.getContext('2d');
    [canvas.width, canvas.height] = [picture.width, picture.height];
    context.drawImage(picture, 0, 0);
    shown.count = p.count;
    shown.drawn = performance.now();
    shown.age_s = asked_s + (still ? 0 : (shown.drawn - asked) / 1000);
    shown.tip = p.tip_px ? `tip at ${p.tip_px.map(v => fixed(v, 0)).join(', ')} px` : 'tip not found';
    captionPicture(shown, p);
    shown.figure.dataset.shown = `${picture.width} x ${picture.height}`;
    if (!p.tip_px) return;
    const [x, y] = p.tip_px.map(v => v + 0.5);  // a pixel's middle is at a half on a canvas
    context.strokeStyle = style('--target');
    context.lineWidth = 2;
    context.beginPath();
    context.arc(x, y, 9, 0, 7);
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(x + 9 * dx, y + 9 * dy);
      context.lineTo(x + 15 * dx, y + 15 * dy);
    }
    context.stroke();
  } catch (error) {
    console.warn(`picture of camera ${p.camera}: ${error}`);  // the next one may do
  } finally {
    shown.asking = false;
  }
}

function drawTables() {
  document.querySelector('#cameras tbody').replaceChildren(...state.tips.map(t => {
    const old = age(t.age_s) > kStale_s.camera;
    return row([[t.camera], [t.status === 0 ? 'ok' : `not usable (${t.status})`, t.status === 0 ? 'good' : 'bad'],
      ...t.position_mm.map(v => [fixed(v, 2)]), [fixed(t.test_ratio, 2), t.test_ratio > 1 ? 'bad' : ''], [t.count],
      [fixed(age(t.age_s), 1)]], old);
  }));
  document.querySelector('#processes tbody').replaceChildren(...state.processes.map(p => {
    const old = age(p.age_s) > kStale_s.process;
    return row([[p.name], [p.state, p.stopped ? 'bad' : 'good'], [p.reason], [fixed(p.run_max_ms, 1)],
      [fixed(p.late_max_ms, 1)], [p.overruns, p.overruns ? 'bad' : ''], [p.received], [p.rejected, p.rejected ? 'bad' : ''],
      [fixed(age(p.age_s), 1)]], old);
  }));
}

function badge(id, text, kind) {
  byId(id).textContent = text;
  byId(id).className = 'badge ' + kind;
}

function drawHead() {
  const cut = unheard_s() > kCut_s;
  document.body.classList.toggle('cut', cut);
  badge('link', cut ? `cut off for ${unheard_s().toFixed(0)} s` : still ? 'still' : 'connected', cut ? 'bad' : 'quiet');
  if (!state) return;
  badge('mode', state.played_back ? 'played back: ' + new Date(state.utime / 1000).toISOString().slice(0, 19) + 'Z' : 'live', 'quiet');
  const says = name => state.processes.find(p => p.name === name);
  const stopped = state.processes.find(p => p.stopped);
  const who = stopped || says('bevel-controller') || state.processes[0];
  if (!who) return;
  const old = age(who.age_s) > kStale_s.process;
  badge('state', old ? `${who.name} silent` : who.state, old || stopped ? 'bad' : who.moves ? 'good' : '');
  byId('reason').textContent = who.reason ? `${who.name}: ${who.reason}` : '';
}

let frames = 0;
function draw() {
  requestAnimationFrame(draw);
  if (++frames % 3) return;  // twenty a second
  drawHead();
  if (!state || !state.insertion) return;
  if (document.body.classList.contains('waiting')) {
    document.body.classList.remove('waiting');
    makeCharts();
    charts.forEach(chart => chart.draw());
  }
  drawSpace();
  drawPlane('plane-x', 0);
  drawPlane('plane-y', 1);
  drawFacts();
  drawTables();
  drawPictures();
  if (frames % 12 === 0) charts.forEach(chart => chart.draw());
}
draw();
