// The page: puts together what the other files do, and shows the state in words.

import { Gains } from "./gains.js";
import { Link } from "./link.js";
import { News, outcome } from "./news.js";
import { Orders } from "./orders.js";
import { drawPlane } from "./plane.js";
import { Ruler } from "./ruler.js";
import { Plot, Ring } from "./traces.js";

const $ = (id) => document.getElementById(id);
const CHANNELS = 8, FEWEST = 16, MOST = 1200;
const page = { state: {}, limits: null, say };
// For whoever measures: frames that came, pictures that were drawn, the last emergency stop.
window.macromicro = { frames: 0, drawn: 0, emergencyMs: 0, state: () => page.state };

const plots = [
  new Plot($("plots"), "Macro-stage", [[0, "two", "reference", "mm", 3], [1, "one", "position", "mm", 3]], 0.5),
  new Plot($("plots"), "Micro-stage", [[2, "two", "reference", "mm", 4], [3, "one", "by Hall sensor", "mm", 4]], 0.02),
  new Plot($("plots"), "Effort", [[4, "two", "motor", "V", 2], [5, "one", "CTRL", "V", 2]], 1),
  new Plot($("plots"), "Wire temperature, estimated", [[6, "two", "estimate", "degC", 1]], 5),
];
const ruler = new Ruler($("ruler")), news = new News($("events"));
let ring = null, view = 0, newest = null, pending = false, said = "", missedAt = -Infinity;

const link = new Link({ welcome, state, news: tidings, gains: (g) => gains.show(g), frame, closed }, wanted);
const orders = new Orders(link, page), gains = new Gains(orders);

// Which view of the plots is wanted; begins a new ring for it.
function wanted() {
  const span = Number($("span").value || sessionStorage.getItem("macromicro.span") || 10);
  const columns = Math.min(Math.max(Math.floor(plots[0].width), FEWEST), MOST);
  ring = new Ring(++view, span, columns, CHANNELS);
  return { view, span, columns };
}

function look() {
  sessionStorage.setItem("macromicro.span", $("span").value);
  if (link.ready) link.order("view", wanted());
}

function welcome(told) {
  page.limits = ruler.limits = told.limits;
  $("rig").textContent = told.rig === "twin" ? "(virtual bench)" : told.rig;
  $("login").hidden = told.admitted;
  if (told.problem && sessionStorage.getItem("macromicro.token")) say(`Log in: ${told.problem}.`, true);
  if (!$("span").options.length) {
    $("span").append(...told.spans.map((s) => new Option(`${s} s`, s)));
    $("span").value = sessionStorage.getItem("macromicro.span") ?? "10";
    $("programme").append(...told.programmes.map((name) => new Option(name, name)));
  }
  $("link").className = "badge good";
  $("link").textContent = "connected";
}

function closed(elsewhere, reason) {
  $("link").className = "badge bad";
  $("link").textContent = elsewhere ? "open in another tab" : "no connection";
  $("mode").textContent = "unknown";
  $("mode").className = "badge bad";
  orders.endJog(false);
  permit();
  alarms();
  if (reason) say(`Connection closed: ${reason}.`, true);
}

function tidings(items) {
  const before = news.end;
  news.take(items);
  if (news.end && news.end !== before) say(outcome(news.end), news.end.outcome !== "done");
}

function say(words, bad = false) {
  $("status").textContent = words;
  $("status").className = bad ? "bad" : "";
}

function frame(told) {
  window.macromicro.frames += 1;
  if (ring) ring.take(told);
  newest = told;
  if (!pending) { pending = true; requestAnimationFrame(draw); }
}

function draw() {
  pending = false;
  window.macromicro.drawn += 1;
  for (const plot of plots) plot.draw(ring, news.marks);
  const target = page.state.target_m;
  ruler.draw({ ...newest, target: target == null ? NaN : target * 1e3 });
}

function state(now) {
  const trusted = page.state.trusted;
  page.state = now;
  if (trusted !== now.trusted || !document.querySelector(".jog option")) orders.speeds();
  words(now);
  permit();
  alarms();
  pace(now);
  recording(now);
  drawPlane($("plane"), now.plane);
  if (ring) for (const plot of plots) plot.words(ring);
}

const mm = (value, digits) => (value == null ? "-" : `${(value * 1e3).toFixed(digits)} mm`);

function words(now) {
  const bad = ["fault", "off"].includes(now.mode);
  set("mode", now.mode + (now.motion ? `, motion ${now.motion}` : ""));
  $("mode").className = bad ? "badge bad" : now.mode === "disabled" ? "badge warn" : "badge good";
  set("trust", now.trusted ? "position trusted" : "position not trusted");
  $("trust").className = now.trusted ? "badge good" : "badge warn";
  set("position", mm(now.position_m, 4));
  set("uncertainty", now.uncertainty_m == null ? "not known: home first"
    : `within ${(now.uncertainty_m * 1e6).toFixed(1)} um either way`);
  set("target", mm(now.target_m, 4));
  set("macro", now.macro_count == null ? "-" : `${now.macro_count.toFixed(0)} counts, ${mm(now.macro_count * page.limits.pitch, 3)}`);
  set("micro", now.micro_mm == null ? "-" : `${now.micro_mm.toFixed(4)} mm contraction`);
  const mine = link.welcome && now.holder === link.welcome.client;
  set("holder", now.holder ? `${mine ? "This page holds" : `${now.holder} holds`} control` : "Nobody holds control");
  $("fan").setAttribute("aria-pressed", String(now.fan));
  const plane = now.plane;
  set("plane-words", `Now ${plane.u.toFixed(1)} degC` +
    (plane.contraction == null ? "." : `; the kiln's table expects ${plane.contraction.toFixed(3)} mm, the Hall sensor says ${now.micro_mm?.toFixed(3) ?? "-"} mm.`));
}

// Who may order what: told by what can be pressed. Stops always can.
function permit() {
  const welcome = link.welcome, holder = page.state.holder;
  const mine = Boolean(welcome) && holder === welcome.client;
  $("orders").disabled = !mine;
  $("clear").disabled = !mine;
  $("take").hidden = mine;
  $("release").hidden = !mine;
  $("take").disabled = !welcome || !welcome.admitted;
  $("recording-orders").disabled = !welcome || !welcome.admitted;
  $("review").disabled = !mine;
}

function alarms() {
  const now = page.state, list = [];
  if (!link.welcome) list.push(["The page has no connection to the server.", "What it shows is old. It tries again by itself; to stop the machine, use its own switch.", false]);
  else {
    if (now.fault) list.push([`Fault: ${now.fault.message}`, now.fault.remedy, false, now.fault.evidence]);
    else if (now.running === false) list.push(["The loop process does not run.", "Start the server again.", false]);
    if (now.running && now.age_s > 0.5) list.push(["The loop has told nothing for more than half a second.", "Make an emergency stop; see the server's terminal.", false]);
    if (now.recording?.error) list.push([`The recording ended early: ${now.recording.error}`, "Make room on the disk and record again.", true]);
    if (now.running && missing(now)) list.push(["The loop has missed more than 5 % of its periods in a second lately.", "Close what else is computing; see macromicro latency.", true]);
    if (now.running && !now.trusted) list.push([`The position is not known (${now.trust}).`, "Enable, then home.", true]);
  }
  const text = JSON.stringify(list);
  $("clear").hidden = !now.fault || !link.welcome;
  if (text === said) return;
  said = text; // told once, not ten times a second
  $("alarm-list").replaceChildren(...list.map(([what, remedy, mild, evidence]) => {
    const box = document.createElement("div");
    box.className = mild ? "alarm mild" : "alarm";
    for (const line of [what, evidence && `Evidence: ${evidence}.`, `Remedy: ${remedy}`]) {
      if (!line) continue;
      const p = document.createElement("p");
      p.textContent = line;
      box.append(p);
    }
    return box;
  }));
}

// Missed periods come in bursts: told for ten seconds, so that the words do not flicker.
function missing(now) {
  if (now.pace.share > 0.05) missedAt = performance.now();
  return performance.now() - missedAt < 10000;
}

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

function recording(now) {
  const { active, rows, lost, path } = now.recording;
  $("record").setAttribute("aria-pressed", String(active));
  put($("record"), active ? "End the recording" : "Record");
  set("recording", active ? `Recording into ${path}: ${rows} rows${lost ? `, ${lost} lost` : ""}` : "Nothing is being recorded.");
  const key = now.recordings.map((r) => `${r.name}${r.active}${r.active ? "" : r.bytes}`).join();
  if ($("recordings").dataset.key === key) return;
  $("recordings").dataset.key = key;
  $("recordings").replaceChildren(...now.recordings.filter((r) => !r.active).map((r) => {
    const item = document.createElement("li"), button = document.createElement("button");
    button.textContent = `Download ${r.name} (${(r.bytes / 1e6).toFixed(2)} MB)`;
    button.addEventListener("click", () => save(r.name));
    item.append(button);
    return item;
  }));
}

async function save(name) {
  try {
    const file = await link.download(name, (share) => say(`${name}: ${(share * 100).toFixed(0)} %`));
    const anchor = document.createElement("a");
    anchor.href = URL.createObjectURL(file);
    anchor.download = name;
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(anchor.href), 60000);
  } catch (error) {
    say(`${name}: ${error.message}`, true);
  }
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
let resized = 0;
new ResizeObserver(() => { clearTimeout(resized); resized = setTimeout(look, 300); }).observe($("plots"));
orders.units();
link.open();
