// The websocket, opened anew whenever it ends.

import { decode } from "./wire.js";

const FIRST_PAUSE = 300, LONGEST_PAUSE = 4000; // ms

export class Link {
  constructor({ message, opened, closed }) {
    this.handlers = { message, opened, closed };
    this.pause = FIRST_PAUSE;
    this.open();
  }

  open() {
    const url = new URL("ws", document.baseURI);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    const socket = this.socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.pause = FIRST_PAUSE;
      this.handlers.opened();
    };
    socket.onmessage = (event) => this.handlers.message(decode(event.data));
    socket.onclose = () => {
      this.handlers.closed();
      setTimeout(() => this.open(), this.pause);
      this.pause = Math.min(2 * this.pause, LONGEST_PAUSE);
    };
  }

  send(what, value, more) {
    if (this.socket.readyState === WebSocket.OPEN) {
      this.socket.send(JSON.stringify({ do: what, value, ...more }));
    }
  }
}
