// The network between the hosts: what leaves, what arrives, what is lost. Each dot is a datagram that was counted.

import { fit } from "./scene.js";

/** A dot needs at least this long across, s: faster paths are shown slower, and the picture notes it. */
const ACROSS_S = 0.7;
const DOTS_MAX = 600;
const calm = matchMedia("(prefers-reduced-motion: reduce)");

export class Network {
  constructor(canvas, colours) {
    Object.assign(this, { canvas, colours, dots: [], before: null });
  }

  forget() {
    this.dots = [];
    this.before = null;
  }

  /** Takes in the counts of a frame at `now`, s. */
  count(frame, causes, now) {
    const { master, slave } = frame;
    const counts = {
      up: master.up.expected,
      lostUp: Math.max(0, master.up.expected - master.up.received),
      down: master.down.expected,
      lostDown: Math.max(0, master.down.expected - (slave?.unsent ?? 0) - master.down.received),
      updates: slave?.updates ?? [],
      sequence: master.change?.sequence ?? 0,
    };
    const { before } = this;
    this.before = counts;
    if (!before || counts.up < before.up) return;
    const add = (count, dot) => {
      for (let n = 0; n < Math.min(count, 20) && this.dots.length < DOTS_MAX; n += 1) {
        this.dots.push({ born: now + n * 0.012, ...dot });
      }
    };
    const lostUp = Math.max(0, counts.lostUp - before.lostUp);
    add(counts.up - before.up - lostUp, { way: 0 });
    add(lostUp, { way: 0, lost: true });
    let updates = 0;
    counts.updates.forEach((count, cause) => {
      const more = count - (before.updates[cause] ?? 0);
      updates += more;
      add(more, { way: 1, cause });
    });
    if (!slave && counts.sequence > before.sequence) {
      add(1, { way: 1, cause: causes.indexOf(master.change.cause) });
      updates += 1;
    }
    const lostDown = Math.max(0, counts.lostDown - before.lostDown);
    add(Math.max(0, counts.down - before.down - updates), { way: 1 });
    add(lostDown, { way: 1, lost: true });
  }

  draw(frame, now) {
    const { context: c, w, h } = fit(this.canvas);
    const { colours } = this;
    const oneWay = (frame.master.rtt_ms ?? 100) / 2000;
    const across = Math.max(oneWay, ACROSS_S);
    const edge = Math.min(96, w * 0.2);
    const lanes = [h * 0.36, h * 0.64];
    c.textBaseline = "middle";
    c.lineWidth = 1;
    for (const y of lanes) {
      c.strokeStyle = colours["grid-strong"];
      c.beginPath();
      c.moveTo(edge, y);
      c.lineTo(w - edge, y);
      c.stroke();
    }
    this.dots = this.dots.filter((dot) => now - dot.born < across + 0.4);
    for (const dot of calm.matches ? [] : this.dots) this.#dot(c, dot, (now - dot.born) / across, edge, w, lanes);
    for (const [x, name, below, colour] of [[edge / 2, ...(frame.master.hip ? ["master", "your hand"] : ["observer", "you look on"]), colours.model], [w - edge / 2, "slave", "the box", colours.remote]]) {
      c.fillStyle = colours.sheet;
      c.strokeStyle = colour;
      c.lineWidth = 2;
      c.beginPath();
      c.roundRect(x - edge / 2 + 6, h * 0.22, edge - 12, h * 0.56, 10);
      c.fill();
      c.stroke();
      c.textAlign = "center";
      c.fillStyle = colour;
      c.fillText(name, x, h * 0.43);
      c.fillStyle = colours.dim;
      c.fillText(below, x, h * 0.6, edge - 18);
    }
    c.fillStyle = colours.dim;
    c.textAlign = "left";
    const wide = w > 620;
    if (wide) c.fillText(frame.master.hip ? "the hand's motion →" : "heartbeats →", edge + 10, h * 0.13);
    c.textAlign = "right";
    const slower = across / oneWay;
    const speed = slower > 1.05 ? `  ·  shown ${slower >= 10 ? slower.toFixed(0) : slower.toFixed(1)} × slower` : "";
    c.fillText(`${(oneWay * 1000).toFixed(0)} ms one way${speed}`, w - edge - 10, h * 0.13);
    c.textAlign = "left";
    c.fillText(wide ? "← updates, by cause; small: repeats, scenes, heartbeats" : "← updates, by cause", edge + 10, h * 0.88, w - 2 * edge - 20);
  }

  #dot(c, dot, share, edge, w, lanes) {
    if (share < 0 || share > 1) return;
    const along = dot.way ? 1 - share : share;
    const x = edge + along * (w - 2 * edge);
    let y = lanes[dot.way];
    const { colours } = this;
    const update = dot.cause >= 0;
    c.fillStyle = update ? colours[`cause-${dot.cause}`] : dot.way ? colours.remote : colours.model;
    c.globalAlpha = update ? 1 : 0.55;
    if (dot.lost) {
      if (share < 0.5) return this.#disc(c, x, y, 2);
      // it falls out of the way
      y += (share - 0.5) * 70 * (dot.way ? 1 : -1);
      c.fillStyle = colours.bad;
      c.globalAlpha = Math.max(0, 1 - (share - 0.5) * 3);
      this.#disc(c, edge + (dot.way ? 0.5 : 0.5) * (w - 2 * edge), y, 3.5);
    } else {
      this.#disc(c, x, y, update ? 6 : 2);
    }
    c.globalAlpha = 1;
  }

  #disc(c, x, y, radius) {
    c.beginPath();
    c.arc(x, y, radius, 0, 7);
    c.fill();
    c.globalAlpha = 1;
  }
}
