// Set points dragged over a picture, which the machine follows while the pointer is held.

import { capital } from "./orders.js";

const AGAIN_MS = 50; // a pointer that rests is told of as well: it holds the motion
const HOLD_S = 1; // without a word the stage rests at the last point, which has no velocity

export class Drag {
  // begin(event): a function of later events that gives the fields of a set point, or null where the
  // pointer is on nothing; stage(): what follows.
  constructor(canvas, box, { link, page, begin, stage }) {
    Object.assign(this, { canvas, box, link, page, begin, stage, held: null });
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => { if (this.held) this.held.event = event; });
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) canvas.addEventListener(kind, () => this.up());
    canvas.addEventListener("click", (event) => { if (box.checked) event.stopImmediatePropagation(); }, true);
    box.addEventListener("change", () => { canvas.style.touchAction = box.checked ? "none" : ""; });
    window.addEventListener("blur", () => this.up());
  }

  async down(event) {
    const place = this.box.checked && event.button === 0 && !this.held ? this.begin(event) : null;
    if (!place) return;
    event.preventDefault();
    this.canvas.setPointerCapture(event.pointerId);
    const held = { event, place, timer: 0 };
    this.held = held;
    const reply = await this.link.order("follow", { stage: this.stage(), hold: HOLD_S });
    if (!reply.ok) {
      if (this.held === held) this.held = null;
      this.page.say(`Follow: refused. ${reply.reason}. ${capital(reply.remedy)}`, true);
    } else if (this.held === held) {
      this.page.say(`Follow: motion ${reply.motion} has begun.`);
      held.timer = setInterval(() => this.put(), AGAIN_MS);
      this.put();
    } else this.link.order("end follow"); // the pointer was let go meanwhile
  }

  put() {
    const { event, place } = this.held;
    this.link.tell(...place(event));
  }

  up() {
    const held = this.held;
    if (!held) return;
    if (held.timer) this.put();
    this.held = null;
    clearInterval(held.timer);
    if (held.timer) this.link.order("end follow");
  }
}
