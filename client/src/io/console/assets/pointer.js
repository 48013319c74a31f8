// The pointer, or the arrow keys, as a hand: every reading goes out with its own stamp. Computes no force.

/** Speed of the arrow keys, m/s; with Shift a third of it. */
const KEY_M_PER_S = 0.15;
/** A pressed pointer at rest is sent again after this, with a stamp that no later event can have, ms. */
const STILL_MS = 20;
/** After this a hand that the master does not hold has been let go, ms. */
const GONE_MS = 600;
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

export class Pointer {
  constructor(canvas, link, scene) {
    Object.assign(this, { canvas, link, scene, id: null, keys: new Set(), at: [0, 0], stamp: 0, ticked: 0, last: performance.now() });
    // raw updates come as the device reports, moves once a frame with what was between
    const moves = "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove";
    canvas.addEventListener("pointerdown", (event) => this.#down(event));
    canvas.addEventListener(moves, (event) => this.#move(event));
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) {
      canvas.addEventListener(name, (event) => event.pointerId === this.id && this.release());
    }
    canvas.addEventListener("keydown", (event) => this.#key(event, true));
    canvas.addEventListener("keyup", (event) => this.#key(event, false));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    for (const name of ["blur", "pagehide"]) window.addEventListener(name, () => this.release());
    document.addEventListener("visibilitychange", () => document.hidden && this.release());
  }

  get held() {
    return this.id !== null;
  }

  release() {
    if (!this.held) return;
    this.id = null;
    this.keys.clear();
    this.link.send("release");
    this.canvas.classList.remove("held");
  }

  /** Often: keys move, a pointer at rest is sent, and the clocks are compared. */
  tick(now) {
    const seconds = (now - this.last) / 1000;
    this.last = now;
    // the master lets a hand go from which it receives nothing
    if (this.held && now - this.pressed > GONE_MS && this.link.frame?.master.engaged === false) this.release();
    if (this.id === "keys") this.#glide(now, seconds);
    else if (this.held && now - STILL_MS > this.stamp) this.#send([[now - STILL_MS, ...this.at]]);
    else if (!this.held && now - this.ticked > 500 && this.link.operates) {
      this.ticked = now;
      this.link.send({ clock: now });
    }
  }

  #press(id, stamp, at) {
    if (!this.link.operates) return;
    this.id = id;
    this.at = at;
    this.stamp = stamp;
    this.pressed = performance.now();
    this.link.send({ press: [stamp, ...at] });
    this.canvas.classList.add("held");
  }

  #send(readings) {
    const newer = readings.filter(([stamp]) => stamp > this.stamp);
    if (!newer.length || !this.held) return;
    const [stamp, ...at] = newer.at(-1);
    Object.assign(this, { stamp, at });
    this.link.send({ move: newer });
  }

  #down(event) {
    if (this.held || event.button > 0 || !event.isPrimary) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.#press(event.pointerId, event.timeStamp, this.scene.world(event.clientX, event.clientY));
  }

  #move(event) {
    if (event.pointerId !== this.id) return;
    const between = event.getCoalescedEvents?.() ?? [];
    const events = between.length ? between : [event];
    this.#send(events.map((one) => [one.timeStamp, ...this.scene.world(one.clientX, one.clientY)]));
  }

  #key(event, down) {
    if (!(event.key in KEYS) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.slow = event.shiftKey;
    if (down) this.keys.add(event.key);
    else this.keys.delete(event.key);
    if (this.keys.size && !this.held) this.#press("keys", performance.now(), [0, 0]);
    if (!this.keys.size && this.id === "keys") this.release();
  }

  #glide(now, seconds) {
    const way = KEY_M_PER_S * (this.slow ? 1 / 3 : 1) * Math.min(seconds, 0.05);
    let [x, y] = this.at;
    for (const key of this.keys) {
      x += KEYS[key][0] * way;
      y += KEYS[key][1] * way;
    }
    this.#send([[now, x, y]]);
  }
}
