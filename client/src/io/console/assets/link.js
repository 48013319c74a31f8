// The socket to the master: messages in, the newest frame kept; what the person does out.

const RETRY_MS = 1000;

/** An observer's frame in the form of a master's, which has no hand. */
function handless({ observer }) {
  const none = { hip: null, f_m: null, hand_force: null, proxy: null, person: null, lateness_p99_us: null };
  const stopped_by = observer.stopped ? "either" : null;
  return { master: { ...observer, ...none, stopped_by, engaged: false }, slave: null };
}

export class Link extends EventTarget {
  constructor() {
    super();
    this.frame = null;
    this.about = {};
    this.role = "observer";
    this.open = false;
    this.#connect();
  }

  /** Sends a message; false where there is nobody to send to. */
  send(message) {
    if (!this.open) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  get operates() {
    return this.open && this.role === "operator";
  }

  #connect() {
    const socket = new WebSocket(`ws://${location.host}/ws${location.search}`);
    this.socket = socket;
    socket.onopen = () => {
      this.open = true;
      this.#notify("open");
    };
    socket.onclose = () => {
      const was = this.open;
      this.open = false;
      this.role = "observer";
      if (was) this.#notify("closed");
      else this.#notify("unreachable");
      setTimeout(() => this.#connect(), RETRY_MS);
    };
    socket.onmessage = ({ data }) => {
      const message = JSON.parse(data);
      if (message.role) {
        this.role = message.role;
        this.#notify("role");
      } else if (message.about) {
        this.about = message.about;
        this.#notify("about");
      } else if (message.master || message.observer) {
        this.frame = message.observer ? handless(message) : message;
        this.#notify("frame");
      }
    };
  }

  #notify(name) {
    this.dispatchEvent(new Event(name));
  }
}
