// Programmes that are uploaded, soft limits, and the settings in force as a file.

import { length } from "./length.js";
import { parsed } from "./numbers.js";
import { capital } from "./orders.js";
import { download } from "./steps.js";

const $ = (id) => document.getElementById(id);
const PIECE = 4000; // characters; a message holds four times as many bytes
const UPLOADED = "\u2191 ";

// A programme file, piece by piece; it is then the one that Run runs.
export class Upload {
  constructor(link, page) {
    this.link = link;
    this.page = page;
    $("upload").addEventListener("click", () => $("programme-file").click());
    $("programme-file").addEventListener("change", (event) => this.take(event.target.files[0]));
  }

  get chosen() { return $("programme").selectedOptions[0]?.dataset.uploaded === "yes"; }

  async take(file) {
    $("programme-file").value = "";
    if (!file) return;
    const { say } = this.page, text = await file.text();
    for (let offset = 0; offset === 0 || offset < text.length; offset += PIECE) {
      const piece = text.slice(offset, offset + PIECE), last = offset + PIECE >= text.length;
      const reply = await this.link.order("upload", { name: file.name, offset, text: piece, last });
      if (!reply.ok) { say(`${file.name}: refused. ${reply.reason}. ${capital(reply.remedy)}`, true); return; }
      say(last ? `${file.name}: ${reply.moves} moves. Press Run to start it.` : `${file.name}: ${Math.round(100 * offset / text.length)} % uploaded.`);
    }
    document.querySelector("#programme option[data-uploaded]")?.remove();
    const option = new Option(UPLOADED + file.name, file.name);
    option.dataset.uploaded = "yes";
    $("programme").append(option);
    $("programme").value = file.name;
  }
}

const FIELDS = [
  ["whole_low", "Lowest", 1], ["whole_high", "Highest", 1],
  ["macro_low", "Macro-stage, lowest", 0], ["macro_high", "Macro-stage, highest", 0],
  ["micro_low", "Micro-stage, lowest", 1e-3], ["micro_high", "Micro-stage, highest", 1e-3],
]; // name, words, metres in one stored unit; 0: counts

// Soft limits that bind every client. Lengths in the page's unit, the macro-stage's in counts.
export class SoftLimits {
  constructor(orders, page) {
    this.orders = orders;
    this.page = page;
    this.inputs = new Map();
    for (const [name, words] of FIELDS) {
      const label = document.createElement("label"), input = document.createElement("input");
      input.inputMode = "decimal";
      input.autocomplete = "off";
      input.id = `limit-${name}`;
      label.htmlFor = input.id;
      label.dataset.words = words;
      $("limits-fields").append(label);
      label.append(document.createElement("span"), document.createElement("br"), input);
      this.inputs.set(name, input);
    }
    $("limits-form").addEventListener("submit", (event) => { event.preventDefault(); this.set(); });
    $("limits-own").addEventListener("click", () => this.give(null));
  }

  show() {
    const q = this.page.limits;
    if (!q) return;
    const key = JSON.stringify([FIELDS.map(([name]) => q[name]), length.name]);
    if (key === this.key) return; // what is being typed stays
    this.key = key;
    for (const [name] of FIELDS) this.inputs.get(name).parentElement.hidden = !(name in q);
    for (const [name, , scale] of this.fields) {
      const input = this.inputs.get(name), { words } = input.parentElement.dataset;
      input.value = scale ? length.short(q[name] * scale) : String(q[name]);
      input.previousSibling.previousSibling.textContent =
        `${words} [${scale ? length.name : "counts"}]`;
    }
  }

  // Those that this machine has.
  get fields() { return FIELDS.filter(([name]) => name in this.page.limits); }

  set() {
    const values = {};
    for (const [name, words, scale] of this.fields) {
      const value = parsed(this.inputs.get(name).value);
      if (!Number.isFinite(value)) { this.problem(`${words}: give a number.`); return; }
      // A limit that was not touched is given as it is, not through its rounded text.
      const q = this.page.limits[name], same = this.inputs.get(name).value === (scale ? length.short(q * scale) : String(q));
      values[name] = same ? q : scale ? value * length.factor / scale : value;
    }
    this.give(values);
  }

  async give(values) {
    const reply = await this.orders.give("limits", { values }, "Soft limits");
    this.problem(reply.ok ? "" : `${capital(reply.reason)} ${capital(reply.remedy)}`);
  }

  problem(words) { $("limits-problem").textContent = words; }
}

// Settings in force, for `macromicro serve --config`.
export function saveSettings(link, page) {
  $("save-settings").addEventListener("click", async () => {
    const reply = await link.order("settings");
    if (!reply.ok) { page.say(`Settings: ${reply.reason}. ${capital(reply.remedy)}`, true); return; }
    download("settings.toml", reply.text, "application/toml");
    page.say("settings.toml: downloaded.");
  });
}
