// The controls: they send words and show what the master reports.

const $ = (id) => document.getElementById(id);
const UNITS = { delay: "ms", jitter: "ms", loss: "%", delta: "%", period: "ms", mass: "kg", friction: "" };
/** A slider that is dragged sends no more often, ms. */
const PACE_MS = 150;

/** The settings that sliders can show in the words of a link; none where it has more. */
function sliders(words) {
  const simple = /^(?:delay ([\d.]+)(ms|us|s)(?: ([\d.]+)(ms|us|s))?)?(?:\s*loss ([\d.]+)%)?$/;
  const found = words === "none" ? [] : simple.exec(words);
  if (!found) return null;
  const ms = (value, unit) => Number(value ?? 0) * ({ s: 1000, us: 0.001 }[unit] ?? 1);
  return { delay: ms(found[1], found[2]), jitter: ms(found[3], found[4]), loss: Number(found[5] ?? 0) };
}

export class Controls {
  constructor(link) {
    this.link = link;
    this.shownSettings = "";
    this.busy = -Infinity;
    for (const id of Object.keys(UNITS)) $(id).addEventListener("input", () => this.#output(id));
    for (const id of ["delay", "jitter", "loss"]) $(id).addEventListener("input", () => this.#paced());
    $("preset").addEventListener("change", ({ target }) => target.value && this.#network(`preset ${target.value}`));
    $("network-form").addEventListener("submit", (event) => event.preventDefault());
    $("scheme").addEventListener("change", () => this.#scheme());
    $("session-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.restart();
    });
    link.addEventListener("about", () => this.#about());
    link.addEventListener("role", () => this.#allow());
    for (const id of Object.keys(UNITS)) this.#output(id);
    this.#scheme();
    this.#allow();
  }

  /** A new session as the form has it. */
  restart() {
    const wish = { mode: $("mode").value, architecture: $("architecture").value, scheme: this.#words() };
    if (!$("mass").disabled) wish.mass_kg = Number($("mass").value);
    if (!$("friction").disabled) wish.friction = Number($("friction").value);
    this.link.send({ restart: wish });
  }

  #words() {
    const [delta, period] = [`${$("delta").value}%`, `${$("period").value}ms`];
    const scheme = $("scheme").value;
    return { useful: `useful ${delta} ${period}`, hybrid: `hybrid ${delta} ${period}`, deadband: `deadband ${delta}`, timer: `timer ${period}` }[scheme] ?? scheme;
  }

  #output(id) {
    const { value } = $(id);
    document.querySelector(`output[for="${id}"]`).value = `${value} ${UNITS[id]}`;
    $(id).setAttribute("aria-valuetext", `${value} ${UNITS[id]}`);
  }

  #scheme() {
    const scheme = $("scheme").value;
    this.uses = { delta: ["useful", "hybrid", "deadband"].includes(scheme), period: ["useful", "hybrid", "timer"].includes(scheme) };
    this.#allow();
  }

  #paced() {
    this.busy = performance.now();
    clearTimeout(this.later);
    this.later = setTimeout(() => {
      const [delay, jitter, loss] = ["delay", "jitter", "loss"].map((id) => Number($(id).value));
      const delayed = delay || jitter ? `delay ${delay}ms${jitter ? ` ${Math.min(jitter, delay)}ms` : ""}` : "";
      this.#network(`${delayed}${loss ? ` loss ${loss}%` : ""}`.trim() || "none");
    }, PACE_MS);
  }

  #network(words) {
    const { network = {} } = this.link.about;
    const wish = {};
    for (const way of ["up", "down"]) if (way in network) wish[way] = words;
    this.link.send({ network: wish });
  }

  #about() {
    const { presets = [], network = {}, settings } = this.link.about;
    const select = $("preset");
    if (select.options.length === 1) {
      for (const { name, words } of presets) select.add(Object.assign(new Option(name, name), { title: words }));
    }
    $("words-up").value = network.up ?? "–";
    $("words-down").value = network.down ?? "the slave's own";
    const now = sliders(network.up ?? "");
    if (now && performance.now() - this.busy > 800) {
      for (const id of Object.keys(now)) {
        $(id).value = now[id];
        this.#output(id);
      }
    }
    const preset = presets.find(({ words }) => words === network.up && words === (network.down ?? network.up));
    select.value = preset?.name ?? "";
    $("session-form").hidden = !settings;
    if (settings && JSON.stringify(settings) !== this.shownSettings) this.#settings(settings);
    this.#allow();
  }

  #settings(settings) {
    this.shownSettings = JSON.stringify(settings);
    $("mode").value = settings.mode;
    $("architecture").value = settings.architecture;
    for (const [id, value] of [["mass", settings.mass_kg], ["friction", settings.friction]]) {
      $(id).closest(".row").hidden = value === null;
      if (value !== null) $(id).value = value;
      this.#output(id);
    }
    const [name, ...rest] = settings.scheme.split(" ");
    const known = [...$("scheme").options].some((option) => option.value === name);
    if (known && this.link.about.session > 1) $("scheme").value = name;
    for (const word of rest) {
      const id = word.endsWith("%") ? "delta" : "period";
      $(id).value = parseFloat(word);
      this.#output(id);
    }
    this.#scheme();
  }

  #allow() {
    const may = this.link.operates;
    for (const element of document.querySelectorAll(".controls input, .controls select, .controls button")) {
      element.disabled = !may || this.uses?.[element.id] === false;
    }
  }
}
