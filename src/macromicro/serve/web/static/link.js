// The connection to the server: orders with replies, frames of telemetry, coming back by itself.

const HEADER = 80;
const TAKEN_OVER = 4000, STARTING = 4001;
const URGENT_MS = 3000; // then a stop without an answer is reported
const NOT_HERE = { ok: false, reason: "no connection", remedy: "use the machine's own switch" };

export class Link {
  // handlers: welcome, state, news, gains, frame, closed; view: what to ask for.
  constructor(handlers, view) {
    this.handlers = handlers;
    this.view = view;
    this.waiting = new Map();
    this.pieces = new Map();
    this.number = 0;
    this.wait = 500;
    this.beaten = 0;
    this.roundTrip = NaN;
    this.welcome = null;
    this.socket = null;
    this.elsewhere = false; // another tab has this page's session
    this.starting = false; // the server waits for its machine
    this.timer = 0;
    this.hoping = []; // those who wait for a connection
  }

  // session: the one to come back to, null for a new one.
  open(session = sessionStorage.getItem("macromicro.session")) {
    clearTimeout(this.timer);
    this.elsewhere = false;
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => this.put({
      do: "hello", session, token: sessionStorage.getItem("macromicro.token"), ...this.view(),
    });
    socket.onmessage = (event) => {
      if (typeof event.data === "string") this.text(JSON.parse(event.data));
      else this.binary(event.data);
    };
    socket.onclose = (event) => this.closed(event);
  }

  // Now, not when it is tried again by itself; true once the server has answered.
  connect(session) {
    if (this.ready) return Promise.resolve(true);
    return new Promise((resolve) => {
      this.hoping.push(resolve);
      if (!this.socket || this.socket.readyState === WebSocket.CLOSED) this.open(session);
    });
  }

  // A stop: goes out even where the page is not connected, if that can be had. Always answered.
  urgent(what) {
    const sent = async () => {
      // A tab whose page is open elsewhere leaves that one alone: it comes as a new viewer.
      if (!await this.connect(this.elsewhere ? null : undefined)) return NOT_HERE;
      const reply = await this.order(what);
      return reply.lost ? { ...reply, remedy: NOT_HERE.remedy } : reply;
    };
    const late = new Promise((resolve) => {
      setTimeout(() => resolve({ ...NOT_HERE, reason: this.ready ? "no answer" : NOT_HERE.reason }), URGENT_MS);
    });
    return Promise.race([sent(), late]);
  }

  get ready() { return this.welcome !== null && this.socket?.readyState === WebSocket.OPEN; }

  put(message) { this.socket.send(JSON.stringify(message)); }

  // Sends an order; the reply, always: {ok, reason, remedy, motion, ...}.
  order(what, fields = {}) {
    if (!this.ready) {
      return Promise.resolve({ ok: false, reason: "no connection", remedy: "wait for it" });
    }
    const id = ++this.number;
    return new Promise((resolve) => {
      this.waiting.set(id, resolve);
      this.put({ ...fields, do: what, id });
    });
  }

  // Sends a message that has no reply.
  tell(what, fields = {}) { if (this.ready) this.put({ ...fields, do: what }); }

  text(message) {
    if ("state" in message) {
      this.beat();
      this.handlers.state(message.state);
    } else if ("reply" in message) {
      const resolve = this.waiting.get(message.reply);
      this.waiting.delete(message.reply);
      if (resolve) resolve(message);
    } else if ("news" in message) this.handlers.news(message.news);
    else if ("gains" in message) this.handlers.gains(message.gains);
    else if ("welcome" in message) {
      this.welcome = message.welcome;
      this.wait = 500;
      sessionStorage.setItem("macromicro.session", message.welcome.session);
      this.handlers.welcome(message.welcome);
      this.hope(true);
    }
  }

  // A sign of life, as an answer to what the server shows: a page that hangs gives none.
  beat() {
    const now = performance.now();
    const pause = Math.min(1000, this.welcome.limits.client_timeout * 250);
    if (now - this.beaten < pause) return;
    this.beaten = now;
    this.order("beat").then((reply) => { if (reply.ok) this.roundTrip = performance.now() - now; });
  }

  binary(buffer) {
    const head = new DataView(buffer);
    if (head.getUint32(0, true) === 2) {
      this.pieces.set(head.getUint32(4, true), {
        size: head.getFloat64(16, true), data: new Uint8Array(buffer, 24),
      });
      return;
    }
    const at = (k) => head.getFloat64(16 + 8 * k, true);
    this.handlers.frame({
      view: head.getUint32(4, true), bins: head.getUint32(8, true),
      channels: head.getUint32(12, true), first: at(0), width: at(1), time: at(2), row: at(3),
      position: at(4), macro: at(5), micro: at(6), uncertainty: at(7),
      values: new Float32Array(buffer, HEADER),
    });
  }

  // The data that came with a reply.
  taken(reply) {
    const piece = this.pieces.get(reply);
    this.pieces.delete(reply);
    return piece.data;
  }

  // A whole file, piece by piece, as an array of them.
  async download(name, progress) {
    const parts = [];
    for (let offset = 0, size = 1; offset < size;) {
      const reply = await this.order("download", { name, offset });
      if (!reply.ok) throw new Error(reply.reason);
      size = this.pieces.get(reply.reply).size;
      const data = this.taken(reply.reply);
      if (!data.length) break;
      parts.push(new Blob([data]));
      offset += data.length;
      progress(offset / size);
    }
    return new Blob(parts, { type: "application/x-hdf5" });
  }

  hope(came) {
    for (const resolve of this.hoping.splice(0)) resolve(came);
  }

  closed(event) {
    this.welcome = null;
    this.elsewhere = event.code === TAKEN_OVER;
    this.starting = event.code === STARTING;
    for (const resolve of this.waiting.values()) {
      resolve({ ok: false, lost: true, reason: "the connection was lost", remedy: "see the state" });
    }
    this.waiting.clear();
    this.pieces.clear();
    this.handlers.closed(this.elsewhere, event.reason);
    this.hope(false);
    if (this.elsewhere) return;
    this.timer = setTimeout(() => this.open(), this.wait);
    if (!this.starting) this.wait = Math.min(this.wait * 2, 4000);
  }
}
