// Buttons, moves, jogs and keys. Stops are always in reach and need nobody's leave.

import { length } from "./length.js";
import { parsed } from "./numbers.js";

const $ = (id) => document.getElementById(id);
const KEEP_MS = 100;

export class Orders {
  constructor(link, page) {
    this.link = link;
    this.page = page; // say(words, bad), state, limits, uploaded()
    this.jog = null;
    this.safeAt = -Infinity; // when an emergency stop of this page was answered
    for (const button of document.querySelectorAll("[data-do]")) {
      button.addEventListener("click", () => this.give(button.dataset.do, {}, button.textContent));
    }
    $("take").addEventListener("click", () => this.give("take", {}, "Take control"));
    $("release").addEventListener("click", () => this.give("release", {}, "Release control"));
    $("clear").addEventListener("click", () => this.give("clear", {}, "Clear the fault"));
    $("fan").addEventListener("click", () => this.give("fan", { on: !page.state.fan }, "Fan"));
    $("stop").addEventListener("click", () => this.stop());
    $("stop-programme").addEventListener("click", () => this.stop());
    $("emergency").addEventListener("click", (event) => this.emergency(event));
    $("move-form").addEventListener("submit", (event) => this.move(event));
    $("move-kind").addEventListener("change", () => this.units());
    $("programme-form").addEventListener("submit", (event) => {
      event.preventDefault();
      const name = $("programme").value;
      this.give("programme", page.uploaded() ? { uploaded: true } : { name }, "Programme");
    });
    for (const button of document.querySelectorAll(".jog-button")) this.hold(button);
    window.addEventListener("blur", () => this.endJog());
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.endJog(); });
    document.addEventListener("keydown", (event) => this.key(event), true);
    document.addEventListener("keyup", (event) => {
      if (event.code === "Space" && !writing(event.target)) event.preventDefault();
    }, true);
  }

  async give(what, fields, words) {
    this.page.ordered = performance.now();
    return this.answered(await this.link.order(what, fields), words);
  }

  answered(reply, words) {
    if (reply.ok) this.page.say(reply.motion ? `${words}: motion ${reply.motion} has begun.` : `${words}: done.`);
    else this.page.say(`${words}: refused. ${reply.reason}. ${capital(reply.remedy)}`, true);
    return reply;
  }

  async stop() {
    this.endJog();
    const reply = await this.link.urgent("stop");
    if (reply.ok) this.page.say("Stop: done.");
    else this.page.say(`STOP NOT CONFIRMED: ${reply.reason}. ${capital(reply.remedy)}`, true);
  }

  async emergency(event) {
    const began = event ? event.timeStamp : performance.now();
    this.endJog(false);
    $("cancel").click(); // what is being reviewed is not applied
    const reply = await this.link.urgent("emergency");
    const took = performance.now() - began;
    window.macromicro.emergencyMs = took;
    this.safeAt = performance.now();
    if (reply.ok) {
      this.page.say(`Emergency stop: outputs off ${(reply.safe_s * 1e3).toFixed(2)} ms after the server ` +
        `received it, confirmed here ${took.toFixed(1)} ms after the click or key.`);
    } else this.page.say(`EMERGENCY STOP NOT CONFIRMED: ${reply.reason}. ${capital(reply.remedy)}`, true);
  }

  key(event) {
    if (event.key === "Escape") {
      event.preventDefault();
      if (!event.repeat) this.emergency(event);
    } else if (event.code === "Space") {
      const text = writing(event.target); // there it is a letter as well
      if (!text) event.preventDefault();
      if (!event.repeat && (!text || this.page.moving())) this.stop();
    }
  }

  units() {
    const counts = $("move-kind").value === "move macro";
    $("move-unit").textContent = counts ? "counts" : length.name;
  }

  // Fills in a target [m] for both stages, as a click on the scales proposes it.
  propose(metres, digits) {
    $("move-kind").value = "move to";
    this.units();
    $("move-value").value = (metres / length.factor).toFixed(digits);
    $("move-problem").textContent = "";
  }

  // Checks here, so that a slip is reported at once; the server and the machine check again.
  move(event) {
    event.preventDefault();
    const kind = $("move-kind").value;
    const value = parsed($("move-value").value);
    const problem = Number.isFinite(value) ? this.beyond(kind, value) : "Give a number.";
    $("move-problem").textContent = problem;
    $("move-value").setAttribute("aria-invalid", problem ? "true" : "false");
    if (problem) { $("move-value").focus(); return; }
    this.give(kind, kind === "move macro" ? { value } : { value, unit: length.name }, "Move");
  }

  beyond(kind, value) {
    const q = this.page.limits, metres = value * length.factor;
    if (kind === "move macro") {
      if (!Number.isInteger(value)) return "Give a whole number of counts.";
      return value < q.macro_low || value > q.macro_high
        ? `${value} is outside ${q.macro_low} to ${q.macro_high} counts.` : "";
    }
    if (kind === "move micro") return outside(metres, q.micro_low * 1e-3, q.micro_high * 1e-3);
    if (kind === "move to") return outside(metres, q.whole_low, q.whole_high);
    const base = this.page.state.target_m ?? this.page.state.position_m ?? 0;
    const problem = outside(base + metres, q.whole_low, q.whole_high);
    return problem && `From ${length.short(base)} by ${length.short(metres)} ${length.name}: ${problem}`;
  }

  // Speeds to choose from: shares of what the machine allows just now.
  speeds() {
    const q = this.page.limits;
    for (const row of document.querySelectorAll(".jog")) {
      const select = row.querySelector("select");
      if (!select) continue; // both stages are stepped, not jogged
      const axis = this.page.axes?.find((each) => each.name === row.dataset.stage);
      const [fast, slow] = axis ? [axis.jog, axis.jog_slow] : [q.jog_macro, q.jog_slow];
      const most = row.dataset.stage === "micro" ? q.jog_micro : this.page.state.trusted ? fast : slow;
      const key = `${most} ${length.name}`;
      if (select.dataset.most === key) continue;
      select.dataset.most = key;
      const chosen = Math.max(select.selectedIndex, 0);
      select.replaceChildren(...[0.1, 0.3, 1].map((share) => {
        const words = `${Number((most * share / length.factor).toPrecision(2))} ${length.name}/s`;
        return new Option(words, most * share);
      }));
      select.selectedIndex = chosen;
    }
  }

  hold(button) {
    const row = button.closest(".jog"), sign = Number(button.dataset.sign);
    const begin = () => this.beginJog(button, row.dataset.stage, sign * Number(row.querySelector("select").value));
    button.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      button.setPointerCapture(event.pointerId);
      begin();
    });
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) {
      button.addEventListener(kind, () => this.endJog());
    }
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    button.addEventListener("keydown", (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault();
      if (!event.repeat) begin();
    });
    button.addEventListener("keyup", (event) => { if (event.key === "Enter") this.endJog(); });
  }

  async beginJog(button, stage, speed) {
    this.endJog();
    button.classList.add("held");
    const jog = { stage, button, timer: setInterval(() => this.link.tell("keep"), KEEP_MS) };
    this.jog = jog;
    const reply = await this.link.order("jog", { stage, speed });
    if (!reply.ok) {
      if (this.jog === jog) this.endJog(false);
      this.page.say(`Jog: refused. ${reply.reason}. ${capital(reply.remedy)}`, true);
    }
  }

  endJog(tell = true) {
    const jog = this.jog;
    if (!jog) return;
    this.jog = null;
    clearInterval(jog.timer);
    jog.button.classList.remove("held");
    if (tell) this.link.order("jog", { stage: jog.stage, speed: 0 });
  }
}

// Why a place [m] is refused, in the page's unit; "" within its limits.
export function outside(metres, low, high) {
  return metres < low || metres > high
    ? `${length.short(metres)} is outside ${length.short(low)} to ${length.short(high)} ${length.name}.` : "";
}

// Is it a field of words? A number has no spaces.
function writing(target) {
  return target instanceof HTMLInputElement && ["text", "password"].includes(target.type) && target.inputMode !== "decimal";
}

export function capital(words) {
  return words ? `${words[0].toUpperCase()}${words.slice(1)}.` : "";
}
