// The connection to the daemon: JSON-RPC 2.0 over a WebSocket, opened again whenever it is lost.

const keptToken = "diastole-token";

/// The token of the address, which is taken out of sight at once; kept until the tab closes, for a reload.
export function takeToken() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (given) {
    sessionStorage.setItem(keptToken, given);
    history.replaceState(null, "", location.pathname);
  }
  return given ?? sessionStorage.getItem(keptToken) ?? "";
}

/// An error answer; `data` is {file, place, problem, remedy} of a faulty input, or who holds the control.
export class Refused extends Error {
  constructor({ code, message, data }) {
    super(message);
    this.code = code;
    this.data = data;
  }
}
export const codes = { inputFault: -32001, controlHeld: -32003, notAllowed: -32005 };

export class Daemon {
  /// `heard()` after every answer, `changed(open, problem)` when the connection opens or is lost. `waiting`: the requests
  /// that have no answer yet, with their `asked_ms`, the oldest first.
  constructor(token, { heard, changed }) {
    this.token = token;
    this.heard = heard;
    this.changed = changed;
    this.waiting = new Map();
    this.lastId = 0;
    this.role = "watch";
  }

  async connect() {
    let problem = "The daemon does not answer.";
    try {
      const answer = await fetch("role", { headers: { Authorization: "Bearer " + this.token }, signal: AbortSignal.timeout(5000) });
      if (answer.ok) {
        this.role = (await answer.json()).role;
        return this.open();
      }
      problem = await answer.text();
      if (answer.status === 401) return this.lost(problem, false); // another daemon has begun: its address is new
    } catch { /* it is not there: said below */ }
    this.lost(problem);
  }

  open() {
    const scheme = location.protocol === "https:" ? "wss://" : "ws://";
    this.socket = new WebSocket(scheme + location.host + "/rpc", ["diastole", "token." + this.token]);
    this.socket.onopen = () => this.changed(true, "");
    this.socket.onmessage = (event) => this.take(JSON.parse(event.data));
    this.socket.onclose = () => this.lost("The daemon closed the connection, or the network is broken.");
  }

  /// Of a connection that is open and brings nothing: another is tried.
  giveUp(problem) {
    this.socket.onclose = null;
    this.socket.close();
    this.lost(problem);
  }

  lost(problem, again = true) {
    for (const { reject } of this.waiting.values()) reject(new Error(problem));
    this.waiting.clear();
    this.changed(false, problem);
    if (again) setTimeout(() => this.connect(), 1000);
  }

  take(message) {
    const asked = this.waiting.get(message.id);
    if (!asked) return;
    this.waiting.delete(message.id);
    this.heard();
    if (message.error) asked.reject(new Refused(message.error));
    else asked.resolve(message.result);
  }

  /// When the oldest request was made that has no answer yet; Infinity if there is none.
  get unansweredSince_ms() {
    const [oldest] = this.waiting.values();
    return oldest?.asked_ms ?? Infinity;
  }

  get isOpen() { return this.socket?.readyState === WebSocket.OPEN; }

  call(method, params = {}) {
    if (!this.isOpen) return Promise.reject(new Error("There is no connection to the daemon."));
    const id = ++this.lastId;
    this.socket.send(JSON.stringify({ jsonrpc: "2.0", id, method, params }));
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject, asked_ms: performance.now() }));
  }
}
