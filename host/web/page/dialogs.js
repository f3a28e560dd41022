// The questions that the page asks, and how a refusal is shown.

import { Refused, codes } from "./daemon.js";

export const by = (id) => document.getElementById(id);

for (const button of document.querySelectorAll("[data-close]")) {
  button.addEventListener("click", () => button.closest("dialog").close("no"));
}

/// Fills `box` with what is wrong, where, and what to do about it.
export function describeError(box, error) {
  box.replaceChildren();
  const line = (kind, text) => {
    const paragraph = document.createElement("p");
    paragraph.className = kind;
    paragraph.textContent = text;
    if (text) box.append(paragraph);
  };
  if (error instanceof Refused && error.code === codes.inputFault) {
    line("place", [error.data.file, error.data.place].filter(Boolean).join(" · "));
    line("what", error.data.problem);
    line("remedy", error.data.remedy);
  } else {
    const [what, ...remedy] = error.message.split("\n");
    line("what", what);
    line("remedy", remedy.join(" ").trim());
  }
  box.hidden = false;
}

export function showProblem(title, error) {
  by("problem-title").textContent = title;
  describeError(by("problem-text"), error);
  if (!by("problem-dialog").open) by("problem-dialog").showModal();
}

/// Opens a dialog with one text field; `act(text)` is tried until it succeeds (true) or the person gives up (false).
function ask(dialog, field, problem, act) {
  problem.hidden = true;
  dialog.returnValue = "";
  dialog.showModal();
  field.select();
  return new Promise((done) => {
    const submitted = async (event) => {
      event.preventDefault();
      try {
        await act(field.value.trim());
        finish(true);
      } catch (error) {
        describeError(problem, error);
      }
    };
    const finish = (result) => {
      dialog.removeEventListener("submit", submitted);
      dialog.removeEventListener("close", closed);
      dialog.close();
      done(result);
    };
    const closed = () => finish(false);
    dialog.addEventListener("submit", submitted);
    dialog.addEventListener("close", closed);
  });
}

export const askName = (act) => ask(by("name-dialog"), by("name"), by("name-problem"), act);

export function askTakeover(sentence, act) {
  by("take-text").textContent = sentence;
  by("holder").value = "";
  return ask(by("take-dialog"), by("holder"), by("take-problem"), act);
}

/// The chosen experiment: {experiment, file, points} as run.start takes it.
export class ExperimentChoice {
  constructor() {
    this.file = "console.experiment.toml";
    this.points = {};
    by("files").addEventListener("change", () => this.read([...by("files").files]));
  }

  async read(files) {
    this.points = {};
    for (const file of files) {
      const text = await file.text();
      if (file.name.endsWith(".toml")) {
        this.file = file.name;
        by("experiment").value = text;
      } else {
        this.points[file.name] = text;
      }
    }
    by("files").value = "";  // so that the same file, changed, can be chosen again
    by("files-text").textContent = files.map((file) => file.name).join(", ");
    by("start-problem").hidden = true;
  }

  get order() { return { experiment: by("experiment").value, file: this.file, points: this.points }; }
}
