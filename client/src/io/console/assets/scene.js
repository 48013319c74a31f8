// The scene from above, and a lens on the touch. Draws what the master sends; moves nothing.

/** What the smaller side of the canvas shows, m. */
const SHOWN_M = 0.86;
/** How long an arrow of 1 N is, m. */
const ARROW_M_PER_N = 0.022;
/** What the lens takes of a corner of the scene, px. */
const LENS_ROOM = 190;
/** The lens shows this much, m. */
const LENS_M = 0.009;
const TRAIL_S = 3;
const REACH_M = 1.5;

const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** What a stroke of 1 is, in CSS pixels: it grows with the page's letters. */
let one = 1;
let font = "11.5px sans-serif";

/** Reads what depends on the page's style. */
export function measure() {
  one = parseFloat(getComputedStyle(document.documentElement).fontSize) / 15;
  font = `11.5px ${getComputedStyle(document.body).fontFamily}`;
}

/** Fits a canvas to its place; returns its context and its size in units. */
export function fit(canvas) {
  const { clientWidth, clientHeight } = canvas;
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [Math.round(clientWidth * ratio), Math.round(clientHeight * ratio)];
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const context = canvas.getContext("2d");
  const [w, h] = [clientWidth / one, clientHeight / one];
  context.setTransform(ratio * one, 0, 0, ratio * one, 0, 0);
  context.clearRect(0, 0, w, h);
  context.font = font;
  return { context, w, h };
}

const length = ([x, y]) => Math.hypot(x, y);

export class Scene {
  constructor(canvas, lens, colours) {
    Object.assign(this, { canvas, lens, colours, camera: [0, 0], scale: 500, trail: [], farTrail: [] });
  }

  /** A point of the page in the world, m. */
  world(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    const [cx, cy] = this.camera;
    const scale = this.scale * one;
    return [
      cx + (clientX - box.left - box.width / 2) / scale,
      cy - (clientY - box.top - box.height / 2) / scale,
    ];
  }

  forget() {
    this.trail = [];
    this.farTrail = [];
  }

  /** Draws a frame; `held`: the pointer is pressed, and the floor keeps still below it. */
  draw(frame, seconds, held) {
    const { context: c, w, h } = fit(this.canvas);
    this.scale = Math.min(w, h * 1.15) / SHOWN_M;
    const { master, slave } = frame;
    // who has no hand looks at the remote side
    const followed = master.hip ? master.model : master.scene?.object ?? master.model;
    this.#follow(followed.position, seconds, held, w, h);
    this.#remember(master);
    const at = ([x, y]) => [w / 2 + (x - this.camera[0]) * this.scale, h / 2 - (y - this.camera[1]) * this.scale];
    this.#floor(c, w, h, at);
    const far = slave?.footprint ?? master.footprint;
    const remote = master.scene;
    if (slave?.footprint) this.#box(c, at, slave.truth, far, { stroke: this.colours.truth, dash: [5, 5] });
    if (remote && far) this.#box(c, at, remote.object, far, { stroke: this.colours.remote, fill: this.colours["remote-fill"] });
    if (master.footprint) this.#box(c, at, master.model, master.footprint, { stroke: this.colours.model, fill: this.colours["model-fill"], thick: 2 });
    this.#trails(c, at, master.elapsed_s);
    if (remote) {
      this.#ring(c, at(remote.tool), 6, this.colours.remote);
      this.#arrow(c, at(remote.tool), remote.force, this.colours.remote, 7);
    }
    this.#scaleBar(c, w, h);
    if (master.hip) this.#drawHand(c, at, master, w, h);
  }

  #drawHand(c, at, master, w, h) {
    const hip = at(master.hip);
    if (master.proxy) this.#spring(c, hip, at(master.proxy), this.colours.model, 4);
    this.#arrow(c, master.proxy ? at(master.proxy) : hip, master.f_m, this.colours.model, -7);
    this.#hand(c, hip, master);
    this.#away(c, hip, w, h);
    this.#lens(master);
    this.#giveWay(hip, w, h);
  }

  /** The lens stands at the lower right, at the upper right while the hand is there. */
  #giveWay([x, y], w, h) {
    const up = this.lens.parentElement.classList;
    const room = up.contains("up") ? LENS_ROOM + 40 : LENS_ROOM;
    up.toggle("up", x > w - room && y > h - room);
  }

  #follow(target, seconds, held, w, h) {
    if (held) return;
    const room = [w, h].map((side) => Math.max(0, side / this.scale / 2 - 0.36));
    const share = calm.matches ? 1 : 1 - Math.exp(-seconds * 3);
    this.camera = this.camera.map((now, axis) => {
      const low = target[axis] - room[axis] * 0.35;
      const high = target[axis] + room[axis] * 0.35;
      return now + (Math.min(Math.max(now, low), high) - now) * share;
    });
  }

  #remember(master) {
    const t = master.elapsed_s;
    for (const [trail, point] of [[this.trail, master.hip], [this.farTrail, master.scene?.tool]]) {
      if (point && trail.at(-1)?.t !== t) trail.push({ t, point });
      while (trail.length && trail[0].t < t - TRAIL_S) trail.shift();
    }
  }

  #floor(c, w, h, at) {
    const half = [w, h].map((side) => side / this.scale / 2);
    for (const [step, colour] of [[0.1, this.colours.grid], [0.5, this.colours["grid-strong"]]]) {
      c.beginPath();
      for (const axis of [0, 1]) {
        const first = Math.ceil((this.camera[axis] - half[axis]) / step);
        for (let n = first; n * step < this.camera[axis] + half[axis]; n += 1) {
          const [x, y] = at(axis ? [0, n * step] : [n * step, 0]);
          if (axis) { c.moveTo(0, y); c.lineTo(w, y); } else { c.moveTo(x, 0); c.lineTo(x, h); }
        }
      }
      c.strokeStyle = colour;
      c.lineWidth = 1;
      c.stroke();
    }
    const [left, top] = at([-REACH_M, REACH_M]);
    const side = 2 * REACH_M * this.scale;
    c.strokeStyle = this.colours.dim;
    c.setLineDash([2, 6]);
    c.strokeRect(left, top, side, side);
    c.setLineDash([]);
  }

  #box(c, at, pose, sides, { stroke, fill, dash = [], thick = 1.5 }) {
    const [sin, cos] = [Math.sin(pose.angle), Math.cos(pose.angle)];
    const corners = [[sides.east, sides.north], [-sides.west, sides.north], [-sides.west, -sides.south], [sides.east, -sides.south]];
    c.beginPath();
    for (const [x, y] of corners) {
      c.lineTo(...at([pose.position[0] + cos * x - sin * y, pose.position[1] + sin * x + cos * y]));
    }
    c.closePath();
    if (fill) { c.fillStyle = fill; c.fill(); }
    c.lineJoin = "round";
    c.setLineDash(dash);
    c.strokeStyle = stroke;
    c.lineWidth = thick;
    c.stroke();
    c.setLineDash([]);
    if (thick < 2) return;
    // its reference point, and which way it faces
    const [x, y] = at(pose.position);
    c.beginPath();
    c.moveTo(x, y);
    c.lineTo(x + 14 * cos, y - 14 * sin);
    c.stroke();
    c.beginPath();
    c.arc(x, y, 3, 0, 7);
    c.fillStyle = stroke;
    c.fill();
  }

  #trails(c, at, now) {
    if (calm.matches) return;
    for (const [trail, colour] of [[this.farTrail, this.colours.remote], [this.trail, this.colours.model]]) {
      c.strokeStyle = colour;
      c.lineWidth = 2;
      for (let n = 1; n < trail.length; n += 1) {
        c.globalAlpha = 0.4 * (1 - (now - trail[n].t) / TRAIL_S);
        c.beginPath();
        c.moveTo(...at(trail[n - 1].point));
        c.lineTo(...at(trail[n].point));
        c.stroke();
      }
    }
    c.globalAlpha = 1;
  }

  #ring(c, [x, y], radius, colour) {
    c.beginPath();
    c.arc(x, y, radius, 0, 7);
    c.strokeStyle = colour;
    c.lineWidth = 2;
    c.stroke();
  }

  #hand(c, [x, y], master) {
    c.beginPath();
    c.arc(x, y, 7, 0, 7);
    c.fillStyle = master.engaged ? this.colours.model : this.colours.sheet;
    c.fill();
    c.strokeStyle = this.colours.model;
    c.lineWidth = 2;
    c.stroke();
    c.beginPath();
    c.arc(x, y, 13, 0, 7);
    c.globalAlpha = master.in_contact ? 0.8 : 0.25;
    c.stroke();
    c.globalAlpha = 1;
  }

  /** A hand out of the picture is pointed to from the edge. */
  #away(c, [x, y], w, h) {
    const edge = [Math.min(Math.max(x, 16), w - 16), Math.min(Math.max(y, 16), h - 16)];
    if (x >= 0 && y >= 0 && x <= w && y <= h) return;
    c.save();
    c.translate(...edge);
    c.rotate(Math.atan2(y - edge[1], x - edge[0]));
    c.beginPath();
    c.moveTo(10, 0); c.lineTo(-6, -7); c.lineTo(-6, 7);
    c.closePath();
    c.fillStyle = this.colours.model;
    c.fill();
    c.restore();
  }

  /** The force on the object: its tip is where it acts, beside the other one's. */
  #arrow(c, [x, y], force, colour, aside) {
    const newtons = length(force);
    if (newtons < 0.05) return;
    const [ux, uy] = [force[0] / newtons, -force[1] / newtons];
    const reach = newtons * ARROW_M_PER_N * this.scale;
    const [tipX, tipY] = [x - uy * aside, y + ux * aside];
    const head = Math.min(9, reach * 0.6);
    c.strokeStyle = colour;
    c.fillStyle = colour;
    c.lineWidth = 3;
    c.lineCap = "round";
    c.beginPath();
    c.moveTo(tipX - ux * reach, tipY - uy * reach);
    c.lineTo(tipX - ux * head, tipY - uy * head);
    c.stroke();
    c.beginPath();
    c.moveTo(tipX, tipY);
    c.lineTo(tipX - ux * head - uy * head * 0.55, tipY - uy * head + ux * head * 0.55);
    c.lineTo(tipX - ux * head + uy * head * 0.55, tipY - uy * head - ux * head * 0.55);
    c.fill();
    const side = aside > 0 ? 1 : -1;
    c.textAlign = "center";
    c.fillText(`${newtons.toFixed(1)} N`, tipX - ux * (reach + 16) - uy * side * 10, tipY - uy * (reach + 10) + ux * side * 10 + 4);
  }

  #spring(c, [ax, ay], [bx, by], colour, amplitude) {
    const long = Math.hypot(bx - ax, by - ay);
    if (long < 2) return;
    const [ux, uy] = [(bx - ax) / long, (by - ay) / long];
    const coils = 12;
    c.beginPath();
    c.moveTo(ax, ay);
    for (let n = 1; n < coils; n += 1) {
      const along = (long * n) / coils;
      const aside = n % 2 ? amplitude : -amplitude;
      c.lineTo(ax + ux * along - uy * aside, ay + uy * along + ux * aside);
    }
    c.lineTo(bx, by);
    c.strokeStyle = colour;
    c.lineWidth = 1.5;
    c.stroke();
  }

  #scaleBar(c, w, h) {
    const long = 0.1 * this.scale;
    c.strokeStyle = this.colours.dim;
    c.fillStyle = this.colours.dim;
    c.lineWidth = 1.5;
    c.beginPath();
    c.moveTo(14, h - 22); c.lineTo(14, h - 16); c.lineTo(14 + long, h - 16); c.lineTo(14 + long, h - 22);
    c.stroke();
    c.textAlign = "left";
    c.fillText("10 cm", 14, h - 27);
  }

  /** HIP and proxy with the spring between them, large. */
  #lens(master) {
    const { context: c, w, h } = fit(this.lens);
    const scale = w / LENS_M;
    const foot = master.proxy ?? master.hip;
    const centre = foot.map((value, axis) => (value + master.hip[axis]) / 2);
    const at = ([x, y]) => [w / 2 + (x - centre[0]) * scale, h / 2 - (y - centre[1]) * scale];
    if (master.footprint) this.#box(c, at, master.model, master.footprint, { stroke: this.colours.model, fill: this.colours["model-fill"], thick: 2 });
    const hip = at(master.hip);
    if (master.proxy) {
      this.#spring(c, hip, at(master.proxy), this.colours.ink, 6);
      this.#ring(c, at(master.proxy), 4.5, this.colours.ink);
    }
    c.beginPath();
    c.arc(...hip, 5, 0, 7);
    c.fillStyle = this.colours.model;
    c.fill();
  }
}
