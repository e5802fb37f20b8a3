// The line to the server: one WebSocket that comes back by itself.
const LONGEST_WAIT = 10_000, BEAT = 12_000, DEAF = 8_000, MOST_KEPT = 20;

export class Connection {
  // `heard(message)` gets what the server says, `changed(state)` is told "open", "lost" or the reason of a last end.
  constructor(token, heard, changed) {
    this.token = token;
    this.heard = heard;
    this.changed = changed;
    this.tab = crypto.getRandomValues(new Uint32Array(3)).join("-");
    this.tries = 0;
    this.kept = [];
    this.pings = new Map();
    this.isOver = false;
    addEventListener("online", () => this.hurry());
    document.addEventListener("visibilitychange", () => { if (!document.hidden) this.hurry(); });
    this.connect();
  }

  get isOpen() { return this.socket?.readyState === WebSocket.OPEN; }

  connect() {
    const url = new URL("socket", document.baseURI);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    url.search = url.hash = "";
    const socket = new WebSocket(url);
    this.socket = socket;
    socket.onopen = () => {
      this.hello();
      for (const message of this.kept.splice(0)) this.send(message);
      this.beat = setInterval(() => this.ping().catch(() => socket.close()), BEAT);
    };
    socket.onmessage = (event) => this.take(JSON.parse(event.data));
    socket.onclose = (event) => this.closed(event.code);
  }

  hello() {
    const touch = navigator.maxTouchPoints > 0;
    this.send({ type: "hello", token: this.token, tab: this.tab, width: innerWidth, height: innerHeight, touch });
  }

  take(message) {
    if (message.type === "pong") {
      this.pings.get(message.at)?.(performance.now() - message.at);
      this.pings.delete(message.at);
      return;
    }
    if (message.type === "screen") {
      this.tries = 0;
      this.changed("open");
    }
    this.heard(message);
  }

  closed(code) {
    clearInterval(this.beat);
    this.pings.clear();
    if (this.isOver) return;
    if (code === 4401 || code === 4409) {
      this.isOver = true;
      this.changed(code === 4401 ? "unknown" : "replaced");
      return;
    }
    this.changed("lost");
    // Twice as long each time, and not all pages at once.
    const wait = Math.min(LONGEST_WAIT, 400 * 2 ** this.tries) * (0.5 + Math.random());
    this.tries += 1;
    this.timer = setTimeout(() => this.connect(), code === 4429 ? wait + 3000 : wait);
  }

  // The network or the tab is back: try at once.
  hurry() {
    if (this.isOver || this.socket.readyState !== WebSocket.CLOSED) return;
    clearTimeout(this.timer);
    this.connect();
  }

  send(message) {
    if (!this.isOpen) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  // What happened to the page is told later where it cannot be told now.
  note(kind, detail = "") {
    const message = { type: "event", kind, at: performance.now(), detail: String(detail).slice(0, 900) };
    if (!this.send(message) && this.kept.length < MOST_KEPT && !this.isOver) this.kept.push(message);
  }

  // Milliseconds to the server and back.
  ping() {
    return new Promise((resolve, reject) => {
      const at = performance.now();
      if (!this.send({ type: "ping", at })) return reject(new Error("not connected"));
      const timer = setTimeout(() => reject(new Error("no answer")), DEAF);
      this.pings.set(at, (trip) => { clearTimeout(timer); resolve(trip); });
    });
  }

  end() {
    this.isOver = true;
    clearInterval(this.beat);
    this.socket.close();
  }
}
