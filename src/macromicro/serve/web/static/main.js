// The page: puts together what the other files do, and shows the state in words.

import { Alarms } from "./alarms.js";
import { Gains } from "./gains.js";
import { Link } from "./link.js";
import { News, outcome } from "./news.js";
import { Orders } from "./orders.js";
import { drawPlane } from "./plane.js";
import { Recordings } from "./recordings.js";
import { Ruler } from "./ruler.js";
import { Plot, Ring } from "./traces.js";

const $ = (id) => document.getElementById(id);
const CHANNELS = 8, FEWEST = 16, MOST = 1200;
const page = { state: {}, limits: null, say, put };
// For whoever measures: frames that came, pictures that were drawn, the last emergency stop.
window.macromicro = { frames: 0, drawn: 0, emergencyMs: 0, state: () => page.state };

const plots = [
  new Plot($("plots"), "Macro-stage", [[0, "two", "reference", "mm", 3], [1, "one", "position", "mm", 3]], 0.5),
  new Plot($("plots"), "Micro-stage", [[2, "two", "reference", "mm", 4], [3, "one", "by Hall sensor", "mm", 4]], 0.02),
  new Plot($("plots"), "Effort", [[4, "two", "motor", "V", 2], [5, "one", "CTRL", "V", 2]], 1),
  new Plot($("plots"), "Wire temperature, estimated", [[6, "two", "estimate", "degC", 1]], 5),
];
const ruler = new Ruler($("ruler")), news = new News($("events"));
let ring = null, view = 0, newest = null, pending = false, lost = false, replayed = true;

const link = new Link({ welcome, state, news: tidings, gains: (g) => gains.show(g), frame, closed }, wanted);
const orders = new Orders(link, page), gains = new Gains(orders);
const warnings = new Alarms(), recordings = new Recordings(link, page);

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
  ruler.limits = told.limits; // its scale stays when the soft limits are narrowed
  page.limits = { ...told.limits };
  $("rig").textContent = told.rig === "twin" ? "(virtual bench)" : told.rig;
  $("login").hidden = told.admitted;
  if (lost) say("Connected again.");
  lost = false;
  replayed = false;
  if (told.problem && sessionStorage.getItem("macromicro.token")) say(`Log in: ${told.problem}.`, true);
  if (told.wrong) sessionStorage.removeItem("macromicro.token"); // it is not tried again and again
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
  set("trust", "");
  set("holder", "");
  orders.endJog(false);
  permit();
  alarms();
  if (elsewhere) say(""); // the alarm says it
  else if (reason && !lost) say(`Connection closed: ${reason}.`, true);
  lost = true;
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
  Object.assign(page.limits, now.limits);
  if (trusted !== now.trusted || !document.querySelector(".jog option")) orders.speeds();
  words(now);
  permit();
  alarms();
  pace(now);
  recordings.show(now);
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
  set("limits", `${Number((now.limits.whole_low * 1e3).toFixed(6))} to ${Number((now.limits.whole_high * 1e3).toFixed(6))} mm; macro-stage ` +
    `${now.limits.macro_low} to ${now.limits.macro_high} counts, micro-stage ${now.limits.micro_low} to ${now.limits.micro_high} mm`);
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
  $("take").disabled = mine || !welcome || !welcome.admitted;
  $("release").disabled = !mine;
  $("recording-orders").disabled = !welcome || !welcome.admitted;
  $("review").disabled = !mine;
  $("apply").disabled = !mine;
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
orders.units();
link.open();
