// A blind comparison: consent, two parts, a question on each. It knows nothing of how the parts differ.

const $ = (id) => document.getElementById(id);

function element(name, more, ...inner) {
  const made = Object.assign(document.createElement(name), more);
  made.append(...inner);
  return made;
}

export class Study {
  constructor(link) {
    this.link = link;
    this.shown = "";
    for (const name of ["about", "role", "open", "closed"]) link.addEventListener(name, () => this.#show());
  }

  #show() {
    const { study } = this.link.about;
    document.body.classList.toggle("blind", Boolean(study));
    document.body.classList.toggle("asked", Boolean(study) && study.stage !== "part");
    $("study").hidden = !study || study.stage === "part";
    if (!study) return;
    const shown = JSON.stringify([study, this.link.operates]);
    if (shown === this.shown) return;
    this.shown = shown;
    const parts = { consent: () => this.#consent(study), ready: () => this.#ready(study), question: () => this.#question(study), done: () => this.#done(study) };
    $("study").replaceChildren(...(parts[study.stage]?.() ?? []));
    $("study").querySelector("h2")?.focus();
    if (study.stage === "part") $("scene").focus();
  }

  #heading(text) {
    return element("h2", { textContent: text, tabIndex: -1 });
  }

  #button(text, wish, kind = "primary") {
    return element("button", { textContent: text, className: kind, type: "button", disabled: !this.link.operates, onclick: () => this.link.send({ study: wish }) });
  }

  #consent({ consent, unfinished }) {
    const buttons = element("p", { className: "steps" }, this.#button("I agree and take part", "agree"));
    if (unfinished) buttons.append(this.#button(`Go on as ${unfinished}`, "resume", ""));
    return [this.#heading("Before you begin"), element("div", { className: "text", textContent: consent }), buttons];
  }

  #ready({ part, duration_s: duration, code }) {
    const text = `You will push a box for ${Math.round(duration)} seconds. Drag anywhere in the picture, or hold the arrow keys; `
      + "the dot is your hand. Stop, or Esc, takes the force away at any time.";
    return [this.#heading(`Part ${part} of 2`), element("p", { className: "text", textContent: text }),
      element("p", { className: "steps" }, this.#button("Begin", "begin")), element("p", { className: "dim", textContent: `Your code is ${code}.` })];
  }

  #question({ question, answers, part }) {
    const form = element("form", {});
    const scale = element("div", { className: "scale" });
    for (let answer = 1; answer <= answers; answer += 1) {
      const input = element("input", { type: "radio", name: "answer", value: answer, required: true, disabled: !this.link.operates });
      scale.append(element("label", {}, input, element("span", { textContent: answer })));
    }
    const ends = element("p", { className: "ends dim" }, element("span", { textContent: "not at all" }), element("span", { textContent: "completely" }));
    const legend = element("legend", { textContent: question });
    const send = element("button", { textContent: "Answer", className: "primary", disabled: true });
    form.append(element("fieldset", {}, legend, scale, ends), element("p", { className: "steps" }, send));
    form.addEventListener("change", () => (send.disabled = !this.link.operates));
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      send.disabled = true;
      this.link.send({ study: { answer: Number(new FormData(form).get("answer")) } });
    });
    return [this.#heading(`Part ${part} of 2 is over`), form];
  }

  #done({ code }) {
    return [this.#heading("Thank you"), element("p", { className: "text", textContent: "Both answers are kept. Whoever leads the study may ask you for your code:" }),
      element("p", { className: "code", textContent: code }), element("p", { className: "steps" }, this.#button("Next participant", "next", ""))];
  }
}
