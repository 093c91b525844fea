'use strict';
// Where the name of a reference goes: on its line, where it lies over nothing that is drawn, as in the still pictures
// (label_place.hpp, figure_svg.cpp). Pixels of the canvas.
const labelPlace = (() => {

function edgesOf(s, px) {
  const edges = [], low = s.x.map((x, i) => px(x, s.y[i])), high = s.high && s.x.map((x, i) => px(x, s.high[i]));
  const add = (a, b) => { if (a && b) edges.push([a, b]); };
  low.forEach((p, i) => {
    if (s.kind === 'points' || high) add(p, high ? high[i] : p);
    if (s.kind === 'points' || s.kind === 'bars' || !i || !p || !low[i - 1]) return;
    const corner = s.kind === 'step' ? [p[0], low[i - 1][1]] : p;
    add(low[i - 1], corner);
    add(corner, p);
    if (high) add(high[i - 1], high[i]);
  });
  return edges;
}

function crosses(box, [a, b]) {
  let enters = 0, leaves = 1;
  for (const [towards, room] of [[a[0] - b[0], a[0] - box.left], [b[0] - a[0], box.right - a[0]],
                                 [a[1] - b[1], a[1] - box.top], [b[1] - a[1], box.bottom - a[1]]]) {
    if (towards === 0 && room < 0) return false;
    if (towards < 0) enters = Math.max(enters, room / towards);
    if (towards > 0) leaves = Math.min(leaves, room / towards);
  }
  return enters <= leaves;
}

function placesOn({ left, top, width, height }, level, at, wide, scale) {
  const right = left + width, bottom = top + height, high = 13 * scale, all = [];
  const end = level ? width - wide - 4 * scale : height - high;
  for (let along = 0; along === 0 || along <= end; along += level ? 20 * scale : high)
    for (const first of [true, false]) {
      const x = level ? right - 4 * scale - wide - along : first ? at + 5 * scale : at - 5 * scale - wide;
      const y = !level ? top + 2 * scale + along : first ? at - 2 * scale - high : at + 2 * scale;
      all.push({ left: x, top: y, right: x + wide, bottom: y + high });
    }
  const inside = all.filter(b => b.left >= left && b.right <= right && b.top >= top && b.bottom <= bottom);
  return inside.length ? inside : all.slice(0, 1);
}

function leastCrossed(boxes, edges, scale) {
  let best = null, fewest = Infinity;
  for (const box of boxes) {
    const around = { ...box, left: box.left - 4 * scale, right: box.right + 4 * scale };  // a curve has some width
    const crossing = edges.filter(e => crosses(around, e)).length;
    if (crossing < fewest) { best = box; fewest = crossing; }
    if (!fewest) break;
  }
  return best;
}

return { edgesOf, crosses, placesOn, leastCrossed };
})();
