// The page: puts together what the other files do, and shows the state in words.

import { Alarms } from "./alarms.js";
import { SoftLimits, Upload, saveSettings } from "./files.js";
import { Drag } from "./follow.js";
import { Gains } from "./gains.js";
import { Capture } from "./capture.js";
import { chooseUnit, length } from "./length.js";
import { Link } from "./link.js";
import { names, said } from "./names.js";
import { News, outcome } from "./news.js";
import { Orders } from "./orders.js";
import { drawPlane } from "./plane.js";
import { Recordings } from "./recordings.js";
import { Ruler, valueAt } from "./ruler.js";
import { Points, Steps } from "./steps.js";
import { Plot, Ring } from "./traces.js";
import { FIRST, Stages } from "./xy.js";

const $ = (id) => document.getElementById(id);
const FEWEST = 16, MOST = 1200, SPAN = "10";
const STALE_MS = 1000; // without a word from the server, what is shown is old
const page = { state: {}, limits: null, say, put, uploaded: () => upload.chosen, ordered: -Infinity };
// Does something move, or may it, since what was ordered last is not shown yet?
page.moving = () => Boolean(page.state.motion) || performance.now() - page.ordered < STALE_MS;
// For whoever measures: frames that came, pictures that were drawn, the last emergency stop.
window.macromicro = { frames: 0, drawn: 0, emergencyMs: 0, state: () => page.state, ring: () => ring };

const plots = [
  new Plot($("plots"), "Position", [[0, "two", "reference", , 1], [1, "one", "position", , 1]], 0.5),
  new Plot($("plots"), "Micro-stage", [[2, "two", "reference", , 0], [3, "one", "by Hall sensor", , 0]], 0.02, "micro"),
  new Plot($("plots"), "Effort", [], 1),
  new Plot($("plots"), "Wire temperature, estimated", [[6, "two", "estimate", "degC", 1]], 5, "micro"),
];
const link = new Link({ welcome, state, news: tidings, gains: (g) => gains.show(g), frame, closed }, newView);
const dragged = (event) => {
  const scale = ruler.scaleAt(event); // as it was when the pointer went down
  return scale ? (later) => ["point", { value: valueAt(scale, later) * length.scale, unit: length.base }] : null;
};
const pointed = () => (later) => {
  return ["points", { ...stages.followed(later, page.state), unit: length.base }];
};
new Drag($("ruler"), $("drag-follows"), { link, page, begin: dragged, stage: () => link.welcome.stages[0] });
new Drag($("plane-xy"), $("drag-follows-xy"), { link, page, begin: pointed, stage: () => "all" });
const ruler = new Ruler($("ruler"), pick), news = new News($("events"));
let laws = 0, channels = FIRST, period = 1e-3, ring = null, view = 0, newest = null, pending = false, lost = false, replayed = true, heard = -Infinity;

const orders = new Orders(link, page), gains = new Gains(orders);
const captures = new Capture(link, page), warnings = new Alarms(), recordings = new Recordings(link, page);
const upload = new Upload(link, page), softLimits = new SoftLimits(orders, page);
page.marks = () => news.marks;
const stages = new Stages(orders, page);
const steps = new Steps(orders, page), points = new Points(orders, page);

// Which view of the plots is shown; begins a new ring for it.
function newView() {
  const span = Number($("span").value || sessionStorage.getItem("macromicro.span") || SPAN);
  const columns = Math.min(Math.max(Math.floor(plots[0].width), FEWEST), MOST);
  ring = new Ring(++view, span, columns, channels, period);
  return { view, span, columns };
}

function look() {
  // Before the server has greeted, there are no spans to choose from: nothing was chosen.
  if ($("span").value) sessionStorage.setItem("macromicro.span", $("span").value);
  if (link.ready) link.order("view", newView());
}

function welcome(server) {
  ruler.limits = server.limits; // its scale stays when the soft limits are narrowed
  page.limits = { ...server.limits };
  page.axes = server.axes;
  if (length.suit(server.limits)) units();
  plots[0].least = Math.min(0.5, (server.limits.whole_high - server.limits.whole_low) / length.scale / 20);
  points.open(`${server.rig} ${server.model}`.trim(), server.stages.length === 1);
  const simulated = server.model ? "simulated" : "virtual bench";
  $("rig").textContent = `${server.model} ${server.rig === "twin" ? `(${simulated})` : server.rig}`.trim();
  $("login").hidden = server.admitted;
  names.open(server);
  captures.open(server.signals);
  calibrated(server.calibrations);
  suit(server);
  own(server);
  if (channels !== server.channels.length || period !== server.period) {
    channels = server.channels.length;
    period = server.period;
    look();
  }
  if (lost) say("Connected again.");
  lost = false;
  replayed = false;
  if (server.problem && sessionStorage.getItem("macromicro.token")) say(`Log in: ${server.problem}.`, true);
  if (server.wrong) sessionStorage.removeItem("macromicro.token"); // it is not tried again and again
  if (!$("span").options.length) {
    $("span").append(...server.spans.map((s) => new Option(`${s} s`, s)));
    const kept = sessionStorage.getItem("macromicro.span");
    $("span").value = server.spans.map(String).includes(kept) ? kept : SPAN;
    $("programme").append(...server.programmes.map((name) => new Option(name, name)));
  }
  $("link").className = "badge good";
  $("link").textContent = "connected";
}

// Age and temperature of each stage's calibration.
function calibrated(calibrations) {
  const one = ({ stage, made, temperature, cold, hot }) => {
    const days = Math.floor((Date.now() - Date.parse(made)) / 864e5);
    const age = days < 1 ? "today" : days === 1 ? "yesterday" : `${days} days ago`;
    const when = Number.isNaN(days) ? "at an unknown date" : `on ${made}, ${age}`;
    return `${stage ? `Axis ${stage} calibrated` : "Calibrated"} ${when}, at ${temperature.toFixed(1)} \u00b0C (${cold.toFixed(1)} to ${hot.toFixed(1)})`;
  };
  $("calibrations").hidden = !calibrations.length;
  $("calibrations").textContent = calibrations.map(one).join("; ");
}

// A plot for each column of the law; the last channels are theirs.
function own(server) {
  if (server.law.length === laws) return;
  laws = server.law.length;
  const first = server.channels.length - laws;
  server.law.forEach(({ name, unit, meaning }, k) => {
    const told = unit === "1" || unit === "-" ? "" : unit;
    plots.push(new Plot($("plots"), `Law: ${meaning}`, [[first + k, "one", name, told, 3]], 1e-6));
  });
}

// Shows what there is of a machine: the parts of its stages, one name for a move of the only one.
function suit(server) {
  const there = (stages) => stages.split(" ").every((stage) => server.stages.includes(stage));
  for (const part of document.querySelectorAll("[data-of]")) part.hidden = !there(part.dataset.of);
  if (names.own) for (const part of document.querySelectorAll("[data-thesis]")) part.hidden = true;
  page.alone = server.stages.length === 1;
  if (page.alone) {
    for (const option of document.querySelectorAll("[data-one]")) option.textContent = option.dataset.one;
  }
  stages.open(server.axes, server.plane, server.efforts);
  $("jog-macro").textContent = names.own ? names.title("macro") : "Macro";
  const [first] = server.axes;
  plots[0].show(first ? `Axis ${first.name}` : names.title("macro"));
  const volts = (stage, channel, colour) => {
    const [label, unit] = server.efforts[stage] ?? [];
    return label ? [[channel, colour, label, unit, 2]] : [];
  };
  plots[2].show(first ? `Effort of ${first.name}` : "Effort", [...volts(server.stages[0], 4, "two"), ...volts("micro", 5, "one")]);
  $("programme-form").hidden = !server.programmes.length;
  $("points-save").hidden = !server.programmes.length;
}

function closed(elsewhere, reason) {
  $("link").className = link.starting ? "badge warn" : "badge bad";
  $("link").textContent = elsewhere ? "open in another tab" : link.starting ? "starting" : "no connection";
  $("mode").textContent = "unknown";
  $("mode").className = "badge bad";
  set("trust", "");
  set("holder", "");
  orders.endJog(false);
  trusting();
  permit();
  alarms();
  if (elsewhere || link.starting) say(""); // the alarm says it
  else if (reason && !lost) say(`Connection closed: ${reason}.`, true);
  lost = !link.starting;
}

function tidings(items) {
  const before = news.end;
  news.take(items);
  if (!replayed) { replayed = true; return; } // what was before is no news
  if (!news.end || news.end === before) return;
  // The answer to this page's own emergency stop says more.
  if (news.end.outcome === "emergency" && performance.now() - orders.safeAt < 2000) return;
  say(outcome(news.end), news.end.outcome !== "done");
}

function say(words, bad = false) {
  $("status").textContent = said(words);
  $("status").className = bad ? "bad" : "";
}

function frame(rows) {
  window.macromicro.frames += 1;
  if (ring) ring.take(rows);
  newest = rows;
  if (!pending) { pending = true; requestAnimationFrame(draw); }
}

function draw() {
  pending = false;
  window.macromicro.drawn += 1;
  for (const plot of plots) plot.draw(ring, news.marks);
  stages.draw(ring, page.state, trusting() === "");
  if (stages.there) return;
  const target = page.state.target_m;
  if (newest) ruler.draw({ ...newest, target: target == null ? NaN : target / length.scale, live: trusting() === "", unit: length });
}

function state(now) {
  const trusted = page.state.trusted;
  page.state = now;
  heard = performance.now();
  Object.assign(page.limits, now.limits);
  if (trusted !== now.trusted || !document.querySelector(".jog option")) orders.speeds();
  words(now);
  trusting();
  lamps(now.lines || []);
  softLimits.show();
  permit();
  alarms();
  pace(now);
  recordings.show(now);
  drawPlane($("plane"), now.plane);
  if (ring) for (const plot of [...plots, ...stages.plots]) plot.words(ring);
}

// Switches and lines of the drive: what each says when it is off and on, and the badge when it is on.
const LINES = {
  limit_low: ["lower limit", "free", "tripped", "bad"],
  limit_high: ["upper limit", "free", "tripped", "bad"],
  home: ["home switch", "off", "on", "good"],
  drive_fault: ["drive", "well", "fault", "bad"],
  enabled: ["drive", "off", "on", "good"],
  enable: ["enable line", "off", "on", "good"],
};

function lamps(lines) {
  const place = $("lines"), said = JSON.stringify(lines);
  if (place.dataset.said === said) return;
  place.dataset.said = said;
  place.hidden = lines.length === 0;
  place.replaceChildren(...lines.flatMap(([name, on]) => {
    const axis = page.axes.map((each) => each.name).find((own) => name.startsWith(`${own}_`)) ?? "";
    const line = axis ? name.slice(axis.length + 1) : name;
    const [title, off, yes, badge] = LINES[line];
    const lamp = document.createElement("span");
    lamp.className = on ? `badge ${badge}` : "badge";
    lamp.textContent = `${axis ? `${axis} ` : ""}${title} ${on ? yes : off}`;
    return [lamp, " "];
  }));
}

function words(now) {
  const bad = ["fault", "off"].includes(now.mode);
  if (now.motion) page.ordered = -Infinity;
  set("mode", said(now.mode) + (now.motion ? `, motion ${now.motion}` : ""));
  $("mode").className = bad ? "badge bad" : now.mode === "disabled" ? "badge warn" : "badge good";
  if (stages.there) set("travels", stages.limits());
  set("position", stages.there ? stages.words(now) : length.words(now.position_m));
  set("target", length.words(now.target_m));
  set("to-go", now.target_m == null || now.position_m == null ? "-" : length.words(now.target_m - now.position_m));
  set("macro", now.macro_count == null ? "-" : `${length.words(now.macro_count * page.limits.pitch, 1)}, ${now.macro_count.toFixed(0)} counts`);
  set("micro", now.micro_mm == null ? "-" : `${length.words(now.micro_mm * 1e-3)} contraction`);
  const { whole_low, whole_high, macro_low, macro_high, micro_low, micro_high } = now.limits;
  const both = $("micro").hidden || $("macro").hidden ? "" : `; macro-stage ${macro_low} to ${macro_high} counts, micro-stage ` +
    `${length.short(micro_low * 1e-3)} to ${length.short(micro_high * 1e-3)} ${length.name}`;
  set("limits", `Soft limits: ${length.short(whole_low)} to ${length.short(whole_high)} ${length.name}${both}`);
  const mine = link.welcome && now.holder === link.welcome.client;
  set("holder", now.holder ? `${mine ? "This page holds" : `${now.holder} holds`} control` : "No client holds control");
  $("fan").setAttribute("aria-pressed", String(now.fan));
  const plane = now.plane;
  set("plane-words", `Now ${plane.u.toFixed(1)} degC.`);
}

// Why the position shown is not to be relied on, or "": it looks so. Old, or not known.
function trusting() {
  const now = page.state;
  const old = !link.ready || performance.now() - heard > STALE_MS || now.running === false || now.age_s > 0.5;
  const why = old ? "stale" : now.trusted ? "" : "untrusted";
  $("reading").className = `reading ${why}`;
  set("uncertainty", old ? "OLD: not the present position" : !now.trusted ? "not known: home first"
    : `within ${stages.there ? stages.within(now) : length.words(now.uncertainty_m)} either way`);
  set("trust", !link.welcome ? "" : old ? "position old" : now.trusted ? "position trusted" : "position not trusted");
  $("trust").className = why === "" ? "badge good" : old ? "badge bad" : "badge warn";
  return why;
}

// A click on the scales: a target, to `step`, in the machine's larger unit.
function pick(value, step) {
  const digits = Math.max(0, Math.round(Math.log10(length.factor / (step * length.scale))));
  ruler.proposed = value;
  orders.propose(value * length.scale, digits);
  if ($("click-moves").checked) $("move-form").requestSubmit();
  else say(`Target ${length.words(value * length.scale)} filled in. Press Move to go there.`);
}

// What the chosen unit changes.
function units() {
  steps.units();
  orders.units();
  points.show();
  news.show();
  if (!page.limits) return;
  orders.speeds();
  softLimits.show();
  if (page.state.mode) { words(page.state); trusting(); }
}

// Who may order what, and what makes sense now: shown by the buttons. Stops can always be pressed.
function permit() {
  const welcome = link.welcome, holder = page.state.holder;
  const mine = Boolean(welcome) && holder === welcome.client;
  $("orders").disabled = !mine;
  $("clear").disabled = !mine;
  $("take").disabled = mine || !welcome || !welcome.admitted;
  $("release").disabled = !mine;
  $("recording-orders").disabled = !mine;
  $("review").disabled = !mine;
  $("apply").disabled = !mine;
  for (const id of ["limits-set", "limits-own"]) $(id).disabled = !mine;
  $("save-settings").disabled = !welcome || !welcome.admitted;
  const possible = new Set(page.state.possible ?? []);
  const off = (button, order) => {
    const none = mine && !possible.has(order);
    button.toggleAttribute("data-off", none);
    if (none) button.setAttribute("aria-description", "not in this mode");
    else button.removeAttribute("aria-description");
  };
  for (const button of document.querySelectorAll("[data-do]")) off(button, button.dataset.do);
  for (const button of document.querySelectorAll("[data-possible]")) off(button, button.dataset.possible);
  off($("move"), $("move-kind").value);
  off($("run"), "programme");
  for (const button of document.querySelectorAll("#point-list button[data-possible]")) button.disabled = !mine;
}

function alarms() { warnings.show(page.state, link); }

function pace(now) {
  const us = (s) => (s == null ? "-" : `${(s * 1e6).toFixed(0)} us`);
  const rows = [
    ["Periods", now.pace.periods], ["Missed", `${now.pace.missed} (${(now.pace.share * 100).toFixed(1)} % lately)`],
    ["Latest start", us(now.pace.latest_s)], ["Longest work", us(now.pace.longest_s)],
    ["Last emergency stop", now.emergency_s == null ? "none" : `safe in ${(now.emergency_s * 1e3).toFixed(2)} ms`],
    ["Page to server and back", Number.isFinite(link.roundTrip) ? `${link.roundTrip.toFixed(1)} ms` : "-"],
    ["Clients", now.clients.length],
  ];
  const list = $("pace");
  if (!list.children.length) {
    for (const [name] of rows) {
      const dt = document.createElement("dt");
      dt.textContent = name;
      list.append(dt, document.createElement("dd"));
    }
  }
  rows.forEach(([, value], k) => { put(list.children[2 * k + 1], String(value)); });
}

function set(id, words) { put($(id), words); }
function put(element, words) { if (element.textContent !== words) element.textContent = words; }

$("record").addEventListener("click", () => {
  const active = page.state.recording?.active;
  orders.give(active ? "end recording" : "record", {}, active ? "End of recording" : "Recording");
});
$("login-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  const token = $("token").value;
  const reply = await link.order("login", { token });
  if (!reply.ok) { say(`Log in: ${reply.reason}.`, true); return; }
  sessionStorage.setItem("macromicro.token", token);
  $("token").value = "";
  link.welcome.admitted = true;
  $("login").hidden = true;
  permit();
  say("Logged in.");
});
$("span").addEventListener("change", look);
$("here").addEventListener("click", () => link.connect());
let resized = 0;
new ResizeObserver(() => { clearTimeout(resized); resized = setTimeout(look, 300); }).observe($("plots"));
chooseUnit(units);
units();
saveSettings(link, page);
// A page that hears nothing more must look so even while its connection stands.
setInterval(() => { if (page.state.mode) trusting(); }, 500);
link.open();
