// Controller settings: edited here, shown as a list of changes, applied all or none.

import { parsed } from "./numbers.js";

const $ = (id) => document.getElementById(id);

const BEHIND = document.querySelectorAll("header, main, .skip");

export class Gains {
  constructor(orders) {
    this.orders = orders;
    this.rows = new Map();
    $("gains-form").addEventListener("submit", (event) => { event.preventDefault(); this.review(); });
    $("gains-form").addEventListener("reset", (event) => { event.preventDefault(); this.discard(); });
    $("apply").addEventListener("click", () => this.apply());
    $("cancel").addEventListener("click", () => this.close());
  }

  // The settings in force; what is being edited stays.
  show(settings) {
    if (this.rows.size !== settings.length) this.build(settings);
    for (const setting of settings) {
      const row = this.rows.get(setting.path);
      const edited = differs(row);
      row.setting = setting;
      if (!edited) row.field.value = String(setting.value);
      this.mark(row);
    }
  }

  build(settings) {
    this.rows.clear();
    $("gains-rows").replaceChildren(...settings.map((setting) => {
      const line = document.createElement("tr"), cell = (content) => {
        const td = document.createElement("td");
        td.append(content);
        line.append(td);
      };
      const field = setting.kind === "choice" ? document.createElement("select") : document.createElement("input");
      if (setting.kind === "choice") field.append(...setting.choices.map((name) => new Option(name, name)));
      else { field.inputMode = "decimal"; field.autocomplete = "off"; }
      field.value = String(setting.value);
      field.setAttribute("aria-label", setting.path);
      const row = { setting, field, line };
      field.addEventListener("input", () => this.mark(row));
      cell(setting.path);
      cell(field);
      cell(setting.unit);
      cell(accepted(setting));
      cell(setting.meaning);
      this.rows.set(setting.path, row);
      return line;
    }));
  }

  mark(row) { row.line.classList.toggle("changed", differs(row)); }

  changed() {
    return [...this.rows.values()].filter(differs);
  }

  discard() {
    for (const row of this.rows.values()) {
      row.field.value = String(row.setting.value);
      this.mark(row);
    }
    $("gains-problem").textContent = "";
  }

  review() {
    const rows = this.changed();
    const wrong = rows.map(problem).find((words) => words);
    $("gains-problem").textContent = wrong || (rows.length ? "" : "Nothing was changed.");
    if (wrong || !rows.length) return;
    this.changes = rows.map((row) => [row.setting.path, row.setting.value, given(row)]);
    $("diff-rows").replaceChildren(...this.changes.map(([path, old, value], k) => {
      const line = document.createElement("tr"), unit = rows[k].setting.unit;
      for (const words of [path, `${old} ${unit}`, `${value} ${unit}`]) {
        const td = document.createElement("td");
        td.textContent = words;
        line.append(td);
      }
      return line;
    }));
    // Not modal: the stops in the footer stay in reach. All else waits.
    for (const part of BEHIND) part.inert = true;
    $("diff").show();
    $("diff").focus(); // on no button: a key that is still down applies nothing
  }

  close() {
    if (!$("diff").open) return;
    const inside = $("diff").contains(document.activeElement);
    for (const part of BEHIND) part.inert = false;
    $("diff").close();
    if (inside) $("review").focus(); // from a stop in the footer it does not leap
  }

  async apply() {
    this.close();
    const reply = await this.orders.give("gains", { changes: this.changes }, "Settings");
    $("gains-problem").textContent = reply.ok ? "" : `${reply.reason}. ${reply.remedy}`;
  }
}

// What a row's field says; NaN where that is no number.
function given({ setting, field }) { return setting.kind === "choice" ? field.value : parsed(field.value); }

function differs(row) { return given(row) !== row.setting.value; }

function problem(row) {
  const setting = row.setting;
  if (setting.kind === "choice") return "";
  const value = given(row), name = setting.path;
  if (!Number.isFinite(value)) return `${name}: give a number.`;
  if (setting.kind === "whole" && !Number.isInteger(value)) return `${name}: give a whole number.`;
  const low = setting.low ?? -Infinity, high = setting.high ?? Infinity;
  const outside = value < low || value > high || (setting.positive && value <= 0);
  return outside ? `${name}: ${value} is not accepted: ${accepted(setting)}.` : "";
}

function accepted(setting) {
  if (setting.kind === "choice") return setting.choices.join(", ");
  const parts = [];
  if (setting.positive && !(setting.low > 0)) parts.push("above 0");
  else if (setting.low !== null) parts.push(`from ${setting.low}`);
  if (setting.high !== null) parts.push(`up to ${setting.high}`);
  return parts.join(" ") || "any number";
}
