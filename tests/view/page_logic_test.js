// SPDX-License-Identifier: MIT
'use strict';
// Runs the script of the live page on a stand-in for the browser and checks what it writes: captions and axis labels.
// Usage: node page_logic_test.js view/src/page/view.js
const assert = require('assert'), fs = require('fs'), vm = require('vm');

const charts = [];
function element() {
  return { style: {}, dataset: {}, children: [], className: '', textContent: '', width: 0, height: 0, clientWidth: 400,
    classList: { toggle() {}, contains: () => false, remove() {} },
    append(...all) { this.children.push(...all); }, remove() {}, setAttribute() {}, addEventListener() {},
    getContext: () => new Proxy({}, { get: () => () => {}, set: () => true }) };
}
const byId = new Map();
let clock_ms = 1000;
const fetched = [];  // requests that have not been answered
const page = vm.createContext({
  console, Math, Map, JSON, Number, String, Array, Infinity,
  location: { search: '' }, performance: { now: () => clock_ms }, requestAnimationFrame() {}, window: {},
  getComputedStyle: () => ({ getPropertyValue: () => '#000' }),
  EventSource: class {},
  document: { createElement: element, documentElement: {}, body: element(), querySelector: element,
    getElementById(id) { if (!byId.has(id)) byId.set(id, element()); return byId.get(id); } },
  uPlot: class { constructor(options) { charts.push(options); } },
  fetch: address => new Promise(resolve => fetched.push({ address, resolve })),
  createImageBitmap: async () => ({ width: 160, height: 120 }),
});
vm.runInContext(fs.readFileSync(process.argv[2], 'utf8'), page);
const run = code => vm.runInContext(code, page);
const settled = () => new Promise(resolve => setImmediate(resolve));
const caption = () => run('pictures.get(0).caption.textContent');
const show = (count, tip_px, age_s = 0.1) => {
  page.announced = { pictures: [{ camera: 0, count, age_s, ...(tip_px ? { tip_px } : {}) }] };
  run('state = announced; heard = performance.now(); drawPictures()');
};

const tests = {
  async CaptionReportsNoTipOfAPictureThatHasNotArrived() {
    show(1, [100, 40]);
    assert.strictEqual(caption(), 'camera 0 · waiting for the picture');
    fetched.pop().resolve({ ok: true, blob: async () => ({}) });
    await settled();
    assert.match(caption(), /^camera 0 · tip at 100, 40 px · 0\.1 s old$/);
  },
  async CaptionReportsThePictureThatIsShownUntilTheNextArrives() {
    clock_ms += 2000;
    show(2, undefined);
    assert.match(caption(), /tip at 100, 40 px · 2\.1 s old$/, 'picture 1 is still shown');
    assert.strictEqual(run('pictures.get(0).figure.className'), 'old');
    fetched.pop().resolve({ ok: true, blob: async () => ({}) });
    await settled();
    assert.match(caption(), /^camera 0 · tip not found · 0\.1 s old$/);
  },
  async AxisLabelsTellNeighbouringTicksApart() {
    run('makeCharts()');
    assert.strictEqual(charts.length, 6);
    for (const chart of charts)
      for (const axis of chart.axes)
        for (let power = -6; power <= 3; ++power)
          for (const digit of [1, 2, 2.5, 5]) {
            const step = digit * 10 ** power, ticks = Array.from({ length: 6 }, (_, i) => (i - 2) * step);
            const labels = axis.values(null, ticks, 1, 50, step);
            assert.strictEqual(new Set(labels).size, ticks.length, `step ${step}: ${labels}`);
            labels.forEach((label, i) => assert(Math.abs(Number(label) - ticks[i]) < 1e-6 * step, `${label} at ${ticks[i]}`));
          }
    assert.deepStrictEqual([...charts[4].axes[1].values(null, [0.0045, 0.005, 0.0055], 1, 50, 0.0005)],
      ['0.0045', '0.0050', '0.0055']);
  },
};

(async () => {
  for (const [name, test] of Object.entries(tests)) {
    await test();
    console.log(`ok: ${name}`);
  }
})().catch(error => { console.error(error); process.exit(1); });
