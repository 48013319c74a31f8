// Puts the page together: the link, what is drawn, what is operated, what is read aloud.

import { Link } from "./link.js";
import { Scene, measure } from "./scene.js";
import { Network } from "./network.js";
import { Pointer } from "./pointer.js";
import { Controls } from "./controls.js";
import { Feedback } from "./feedback.js";
import { Study } from "./study.js";
import { lines, raster, WINDOW_S } from "./charts.js";

const $ = (id) => document.getElementById(id);
const NAMES = ["paper", "sheet", "ink", "dim", "line", "grid", "grid-strong", "model", "model-fill", "remote", "remote-fill",
  "truth", "error", "bad", "cause-0", "cause-1", "cause-2", "cause-3", "cause-4", "cause-5", "cause-6"];
const CAUSES = { deadband: "deadband", timer: "timer", master_only_contact: "only here in touch", slave_only_contact: "only there in touch",
  contact_lost: "contact lost", every_sample: "every sample", elsewhere: "moved untouched" };
/** Numbers are written this often, ms: more nobody can read. */
const WRITE_MS = 150;
/** What is read aloud comes no more often, ms. */
const ALOUD_MS = 2500;
const FORCE_MAX_N = 8;
/** The hand's clock, ms. */
const TICK_MS = 16;

const colours = {};
const link = new Link();
const scene = new Scene($("scene"), $("lens"), colours);
const network = new Network($("network"), colours);
const pointer = new Pointer($("scene"), link, scene);
const controls = new Controls(link);
const feedback = new Feedback();
new Study(link);
let history = [];
let packets = [];
let log = [];
let before = null;

const norm = (vector) => (vector ? Math.hypot(...vector) : undefined);
const shown = (value, digits, unit) => (value === null || value === undefined ? "–" : `${value.toFixed(digits)} ${unit}`);
const signed = (value, digits) => {
  const text = Math.abs(value).toFixed(digits);
  return Number(text) === 0 ? "·" : `${value < 0 ? "−" : "+"}${text}`;
};

function readColours() {
  const style = getComputedStyle(document.documentElement);
  measure();
  for (const name of NAMES) colours[name] = style.getPropertyValue(`--${name}`).trim();
}

function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  localStorage.setItem("mmt-theme", theme);
  readColours();
}

function isDark() {
  const { theme } = document.documentElement.dataset;
  return theme ? theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
}

function forget() {
  [history, packets, log, before] = [[], [], [], null];
  scene.forget();
  network.forget();
  $("log").replaceChildren();
}

/** The frame becomes a point of the charts, and the packets that were sent since the one before. */
function remember(frame) {
  const { master, slave } = frame;
  const t = master.elapsed_s;
  if (before && t < before.t) forget();
  if (before?.t === t) return;
  const point = { t, fm: norm(master.f_m) };
  if (slave) {
    point.fs = norm(slave.f_s);
    point.error = Math.hypot(slave.f_s[0] - slave.f_shadow[0], slave.f_s[1] - slave.f_shadow[1]);
  } else if (master.scene) {
    point.fs = norm(master.scene.force);
  }
  history.push(point);
  const causes = link.about.causes ?? [];
  const change = master.change;
  if (slave) {
    slave.updates.forEach((count, cause) => {
      if (before?.updates && count > before.updates[cause]) packets.push({ t, cause });
    });
  } else if (change && change.sequence !== before?.sequence) {
    packets.push({ t, cause: causes.indexOf(change.cause) });
  }
  if (change && change.sequence !== before?.sequence) {
    log.unshift({ ...change, missed: before ? change.sequence - (before.sequence ?? 0) - 1 : 0 });
    log.length = Math.min(log.length, 6);
    writeLog(causes);
  }
  network.count(frame, causes, performance.now() / 1000);
  before = { t, updates: slave?.updates, sequence: change?.sequence };
  while (history[0]?.t < t - WINDOW_S) history.shift();
  while (packets[0]?.t < t - WINDOW_S) packets.shift();
}

function writeLog(causes) {
  const rows = log.map(({ sequence, cause, params, shift, turn }) => {
    const row = document.createElement("tr");
    const cells = [sequence, CAUSES[cause] ?? cause, signed(params[0], 3), signed(params[1], 2), signed(params[2], 2),
      (norm(shift) * 1000).toFixed(1), signed((turn * 180) / Math.PI, 1)];
    for (const text of cells) row.insertCell().textContent = text;
    const mark = document.createElement("i");
    mark.style.background = colours[`cause-${causes.indexOf(cause)}`];
    row.cells[1].prepend(mark);
    return row;
  });
  $("log").replaceChildren(...rows);
}

function share({ expected, received }) {
  return expected ? (Math.max(0, expected - received) / expected) * 100 : null;
}

function write({ master, slave }) {
  const now = history.at(-1) ?? {};
  $("time").value = shown(master.elapsed_s, 1, "s");
  $("age").value = master.scene_age_s === null ? "not seen yet" : `seen ${(master.scene_age_s * 1000).toFixed(0)} ms ago`;
  $("now-fm").value = shown(now.fm, 2, "N");
  $("now-fs").value = shown(now.fs, 2, "N");
  $("now-error").value = shown(now.error, 2, "N");
  const span = Math.min(WINDOW_S, master.elapsed_s) || 1;
  $("rate").value = shown(packets.length / span, 1, "/s");
  $("hand").textContent = shown(norm(master.hand_force), 2, "N");
  $("rtt").textContent = shown(master.rtt_ms, 0, "ms");
  $("lost-up").textContent = shown(share(master.up), 1, "%");
  // what the slave itself did not send was not lost on the way
  const down = { ...master.down, expected: master.down.expected - (slave?.unsent ?? 0) };
  $("lost-down").textContent = shown(share(down), 1, "%");
  $("late").textContent = shown(master.lateness_p99_us, 0, "µs");
  const off = slave?.footprint ? norm([0, 1].map((axis) => master.model.position[axis] - slave.truth.position[axis])) * 1000 : null;
  $("off").textContent = shown(off, 1, "mm");
  [...$("params").tBodies[0].rows].forEach((row, index) => {
    row.cells[1].textContent = shown(master.params[index], 2, "");
    row.cells[2].textContent = slave ? shown(slave.estimate[index], 2, "") : "–";
    row.cells[3].textContent = link.about.truth ? shown(link.about.truth[index], 2, "") : "–";
  });
  const stretched = master.proxy ? Math.hypot(master.hip[0] - master.proxy[0], master.hip[1] - master.proxy[1]) * 1000 : null;
  $("lens-label").textContent = stretched === null ? "no touch" : `spring ${stretched.toFixed(1)} mm`;
}

/** The states, on the screen and for a screen reader. */
function writeState(frame) {
  const { about } = link;
  const running = link.open && about.state === "running";
  const state = !link.open ? "not connected" : about.study && !running ? "waiting" : !running ? "ended" : !frame ? "connecting" : frame.master.footprint ? `link ${frame.master.link}` : "connecting";
  $("link").textContent = state;
  $("lamp").className = `lamp ${{ "link fresh": "good", "link late": "warn", connecting: "", waiting: "" }[state] ?? "bad"}`;
  const role = link.open ? { operator: "the operator", observer: "an observer", free: "an observer" }[link.role] : "–";
  $("role").value = role;
  $("take").hidden = link.role !== "free";
  const person = frame?.master.person;
  const scripted = person?.driver === "scripted";
  for (const [id, on] of [["driver", scripted], ["pause", person?.paused]]) {
    $(id).setAttribute("aria-pressed", Boolean(on));
    $(id).disabled = !link.operates || !person || !running || (id === "driver" && Boolean(about.study));
  }
  $("stop").disabled = !running || about.observes;
  $("end").disabled = !running || !link.operates || Boolean(about.study);
  $("scene").classList.toggle("watching", !link.operates || !running || !person);
  const hint = !running ? "" : about.observes ? "You look on; whoever operates is elsewhere." : !person ? "A script pushes; you watch." : !link.operates ? "Another page has the hand; you watch."
    : frame.master.stopped_by ? "" : person.paused ? "The hand rests. Press P to go on." : pointer.held ? "" : scripted ? "A script pushes. Drag anywhere to take the hand." : "Drag anywhere to push. The hand feels what the model feels.";
  $("hint").textContent = hint;
  document.body.classList.toggle("no-truth", !frame?.slave);
  const touch = frame?.master.in_contact ? "touches the box" : "is free";
  const what = about.observes ? "the tool" : "the hand";
  return `${state}; you are ${role}; ${running ? `${what} ${touch}` : about.why ?? ""}.`;
}

function banner() {
  const { about } = link;
  const lost = !link.open ? "No connection to mmt: it has ended, or this page's address has another token. Trying again …" : null;
  const ended = about.state === "ended" && !about.study ? `The session ended: ${about.why}.` : null;
  const stopped = { master: "Emergency stop: no force on the hand, and the tool stands.", slave: "The slave's emergency stop is set: it is cleared there.",
    either: "An emergency stop is set: the tool stands." };
  const master = link.frame?.master;
  const held = { hold: "The tool stands: no samples reach it.", disengaged: "The tool is disengaged." }[master?.tool_state]
    ?? (master?.tool_energy_holds ? "The tool is held: it gave more energy than the hand." : null);
  const text = lost ?? ended ?? stopped[master?.stopped_by] ?? held ?? about.note;
  if (text === banner.text && link.operates === banner.operates) return;
  [banner.text, banner.operates] = [text, link.operates];
  $("banner").hidden = !text;
  $("banner").textContent = text ?? "";
  const offer = (words, act) => {
    const button = document.createElement("button");
    button.className = "primary";
    button.textContent = words;
    button.onclick = act;
    $("banner").append(button);
  };
  if (link.operates && ended && about.settings) offer("Start again", () => controls.restart());
  if (link.operates && text === stopped.master) offer("Clear the stop", () => link.send("clear"));
}

const toggle = {
  driver: () => link.send({ drive: link.frame?.master.person?.driver === "scripted" ? "pointer" : "scripted" }),
  pause: () => link.send({ pause: !link.frame?.master.person?.paused }),
  theme: () => setTheme(isDark() ? "light" : "dark"),
  stop: () => {
    pointer.release();
    link.send("stop");
  },
  end: () => link.send("end"),
  take: () => link.send("take"),
  sound: async () => $("sound").setAttribute("aria-pressed", await feedback.toggle()),
};
for (const [id, act] of Object.entries(toggle)) $(id).addEventListener("click", act);
const KEYS = { s: "driver", p: "pause", m: "sound", t: "theme", Escape: "stop" };
document.addEventListener("keydown", (event) => {
  if (event.repeat || event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("select")) return;
  const id = KEYS[event.key];
  if (id && !$(id).disabled && !(id === "driver" && link.about.study)) toggle[id]();
});

link.addEventListener("frame", () => {
  remember(link.frame);
  banner();
});
let session = null;
link.addEventListener("about", () => {
  if (session !== null && link.about.session !== session) forget();
  session = link.about.session;
  $("command").textContent = link.about.study ? "study" : link.about.command ?? "console";
  $("setting").textContent = link.about.setting ?? "";
  document.body.classList.toggle("observing", Boolean(link.about.observes));
  $("model-key").textContent = link.about.observes ? "as the newest update has it" : "local model, felt now";
  banner();
});
for (const name of ["open", "closed", "role", "unreachable"]) link.addEventListener(name, banner);

const saved = localStorage.getItem("mmt-theme");
if (saved) document.documentElement.dataset.theme = saved;
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", readColours);
readColours();

addEventListener("resize", measure);

let odd = false;
let drawn = performance.now();
let written = 0;
let aloud = { at: 0, text: "" };
function paint(now) {
  const seconds = (now - drawn) / 1000;
  drawn = now;
  const { frame } = link;
  if (frame?.master) {
    scene.draw(frame, seconds, pointer.held);
    feedback.feel(norm(frame.master.hand_force) ?? 0, FORCE_MAX_N, now);
  }
  odd = !odd;
  // every second frame will do for what is read
  if (frame?.master && odd) {
    const t = frame.master.elapsed_s;
    network.draw(frame, now / 1000);
    lines($("forces"), colours, history, [], t, [{ key: "fs", colour: "remote" }, { key: "fm", colour: "model" }], 2);
    lines($("error"), colours, history, packets, t, [{ key: "error", colour: "error", fill: true }], 0.5);
    const causes = (link.about.causes ?? []).map((name) => CAUSES[name] ?? name);
    raster($("packets"), colours, causes, frame.slave?.updates ?? causes.map((_, index) => packets.filter(({ cause }) => cause === index).length), packets, t);
  }
  if (now - written > WRITE_MS) {
    written = now;
    if (frame?.master) write(frame);
    const text = writeState(frame);
    if (text !== aloud.text && now - aloud.at > ALOUD_MS) {
      aloud = { at: now, text };
      $("summary").textContent = text;
    }
  }
  requestAnimationFrame(paint);
}
requestAnimationFrame(paint);
// not with the pictures: they may be late. The stamps of events are of this clock.
setInterval(() => pointer.tick(performance.now()), TICK_MS);
