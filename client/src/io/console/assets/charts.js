// Strip charts by hand: the last ten seconds, newest at the right.

import { fit } from "./scene.js";

export const WINDOW_S = 10;

/** The time axis of a chart, with a line a second. */
function frame(canvas, colours, now, left) {
  const { context: c, w, h } = fit(canvas);
  const x = (t) => left + ((t - now + WINDOW_S) / WINDOW_S) * (w - left - 4);
  c.strokeStyle = colours.grid;
  c.lineWidth = 1;
  c.beginPath();
  for (let t = Math.ceil(now - WINDOW_S); t <= now; t += 1) {
    c.moveTo(x(t), 0);
    c.lineTo(x(t), h);
  }
  c.stroke();
  return { c, w, h, x };
}

/** A round number at or above. */
function ceiling(value) {
  const unit = 10 ** Math.floor(Math.log10(value));
  return [1, 1.5, 2, 3, 4, 5, 6, 8, 10].map((n) => n * unit).find((n) => n >= value) ?? value;
}

/** Lines of `history` by key, in N. Packets are fine upright lines in the colour of their cause. */
export function lines(canvas, colours, history, packets, now, series, least) {
  const { c, w, h, x } = frame(canvas, colours, now, 30);
  let most = least;
  for (const point of history) for (const { key } of series) most = Math.max(most, point[key] ?? 0);
  const top = ceiling(most * 1.02);
  const y = (value) => h - 3 - (value / top) * (h - 12);
  c.fillStyle = colours.dim;
  c.textAlign = "right";
  c.textBaseline = "middle";
  for (const value of [0, top / 2, top]) {
    c.strokeStyle = colours.grid;
    c.beginPath();
    c.moveTo(30, y(value));
    c.lineTo(w - 4, y(value));
    c.stroke();
    c.fillText(Number(value.toPrecision(2)), 24, Math.min(Math.max(y(value), 7), h - 6));
  }
  c.globalAlpha = 0.4;
  for (const { t, cause } of packets) {
    c.strokeStyle = colours[`cause-${cause}`];
    c.beginPath();
    c.moveTo(x(t), 4);
    c.lineTo(x(t), h - 3);
    c.stroke();
  }
  c.globalAlpha = 1;
  for (const { key, colour, fill } of series) {
    c.beginPath();
    let pen = false;
    let last = 0;
    for (const point of history) {
      if (point[key] === undefined) { pen = false; continue; }
      if (pen) c.lineTo(x(point.t), y(point[key]));
      else c.moveTo(x(point.t), y(point[key]));
      pen = true;
      last = x(point.t);
    }
    c.strokeStyle = colours[colour];
    c.lineWidth = 1.75;
    c.lineJoin = "round";
    c.stroke();
    if (fill && pen && history.length) {
      c.lineTo(last, y(0));
      c.lineTo(x(history[0].t), y(0));
      c.globalAlpha = 0.12;
      c.fillStyle = colours[colour];
      c.fill();
      c.globalAlpha = 1;
    }
  }
}

/** A row for each cause that this run knows, a mark for each packet. */
export function raster(canvas, colours, causes, counts, packets, now) {
  const left = 132;
  const { c, w, h, x } = frame(canvas, colours, now, left);
  const row = h / Math.max(causes.length, 1);
  c.textBaseline = "middle";
  causes.forEach((name, index) => {
    const middle = row * (index + 0.5);
    c.fillStyle = counts[index] ? colours[`cause-${index}`] : colours.dim;
    c.textAlign = "left";
    c.fillText(name, 0, middle, left - 40);
    c.textAlign = "right";
    c.fillStyle = counts[index] ? colours.ink : colours.dim;
    c.fillText(counts[index] ?? 0, left - 10, middle);
    c.strokeStyle = colours.grid;
    c.beginPath();
    c.moveTo(left, middle);
    c.lineTo(w - 4, middle);
    c.stroke();
  });
  for (const { t, cause } of packets) {
    const middle = row * (cause + 0.5);
    c.fillStyle = colours[`cause-${cause}`];
    c.fillRect(x(t) - 1.25, middle - row * 0.36, 2.5, row * 0.72);
  }
}
