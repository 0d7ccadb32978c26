// Controller settings: edited here, shown as a list of changes, applied all or none.

const $ = (id) => document.getElementById(id);

export class Gains {
  constructor(orders) {
    this.orders = orders;
    this.rows = new Map();
    $("gains-form").addEventListener("submit", (event) => { event.preventDefault(); this.review(); });
    $("gains-form").addEventListener("reset", (event) => { event.preventDefault(); this.discard(); });
    $("apply").addEventListener("click", () => this.apply());
    $("cancel").addEventListener("click", () => $("diff").close());
  }

  // The settings in force; what is being edited stays.
  show(settings) {
    if (this.rows.size !== settings.length) this.build(settings);
    for (const setting of settings) {
      const row = this.rows.get(setting.path);
      const edited = row.field.value !== String(row.setting.value);
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

  mark(row) { row.line.classList.toggle("changed", row.field.value !== String(row.setting.value)); }

  changed() {
    return [...this.rows.values()].filter((row) => row.field.value !== String(row.setting.value));
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
    this.changes = rows.map(({ setting, field }) => [
      setting.path, setting.value, setting.kind === "choice" ? field.value : Number(field.value),
    ]);
    $("diff-rows").replaceChildren(...this.changes.map(([path, old, value], k) => {
      const line = document.createElement("tr"), unit = rows[k].setting.unit;
      for (const words of [path, `${old} ${unit}`, `${value} ${unit}`]) {
        const td = document.createElement("td");
        td.textContent = words;
        line.append(td);
      }
      return line;
    }));
    $("diff").showModal();
  }

  async apply() {
    $("diff").close();
    const reply = await this.orders.give("gains", { changes: this.changes }, "Settings");
    $("gains-problem").textContent = reply.ok ? "" : `${reply.reason}. ${reply.remedy}`;
  }
}

function problem({ setting, field }) {
  if (setting.kind === "choice") return "";
  const value = Number(field.value), name = setting.path;
  if (field.value.trim() === "" || !Number.isFinite(value)) return `${name}: give a number.`;
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
