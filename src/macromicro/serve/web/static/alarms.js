// What is wrong, with its remedy, in the fixed footer.

import { said } from "./names.js";

const $ = (id) => document.getElementById(id);

export class Alarms {
  constructor() { this.said = ""; this.missedAt = -Infinity; }

  // now: the state; link: the connection.
  show(now, link) {
    const list = link.welcome ? this.of(now) : [unconnected(link)];
    $("here").hidden = !link.elsewhere;
    $("clear").hidden = !now.fault || !now.running || !link.welcome;
    const text = JSON.stringify(list);
    if (text === this.said) return;
    this.said = text; // shown once, not ten times a second
    $("alarms").tabIndex = list.length ? 0 : -1; // it may have to be scrolled
    $("alarm-list").replaceChildren(...list.map(box));
  }

  of(now) {
    const list = [];
    if (now.fault) list.push([`Fault: ${now.fault.message}`, now.fault.remedy, false, now.fault.evidence]);
    else if (now.running === false) list.push(["The loop process does not run.", "Start the server again.", false]);
    if (now.running && now.age_s > 0.5) list.push(["No report from the loop for more than half a second.", "Make an emergency stop; see the server's terminal.", false]);
    if (now.recording?.error) list.push([`The recording ended early: ${now.recording.error}`, "Free disk space and record again.", true]);
    if (now.running && this.missing(now)) list.push(["The loop has missed more than 5 % of its periods within a second.", "Close other programs; macromicro doctor --seconds 10 measures it.", true]);
    if (now.running && !now.trusted) list.push([`The position is not known (${now.trust}).`, "Enable, then home.", true]);
    return list;
  }

  // Missed periods come in bursts: shown for ten seconds, so that the words do not flicker.
  missing(now) {
    if (now.pace.share > 0.05) this.missedAt = performance.now();
    return performance.now() - this.missedAt < 10000;
  }
}

function unconnected(link) {
  if (link.starting) return ["The machine is starting; nothing moves.", "Wait. The first time, its code is compiled: about 10 s, longer on a busy computer.", true];
  return link.elsewhere
    ? ["This page is active in another tab.", "\"Use it here\" takes it back. STOP and EMERGENCY work in this tab, too.", true]
    : ["The page has no connection to the server.", "The values shown are old. The page reconnects by itself; to stop the machine, use its own switch.", false];
}

function box([what, remedy, mild, evidence]) {
  const found = document.createElement("div");
  found.className = mild ? "alarm mild" : "alarm";
  for (const line of [what, evidence && `Evidence: ${evidence}.`, `Remedy: ${remedy}`]) {
    if (!line) continue;
    const p = document.createElement("p");
    p.textContent = said(line);
    found.append(p);
  }
  return found;
}
