// A line between page and server that a test can cut, anywhere, as a network does.
import { type AddressInfo, connect, createServer, type Socket } from "node:net";

export interface CuttableLine {
  address: string;
  /** WebSockets that were asked for so far. */
  sockets: () => number;
  /** Breaks all connections, and lets none through until heal(). */
  cut: () => void;
  heal: () => void;
  /** Breaks each WebSocket after so many more bytes of what the page sends; new ones get through. */
  cutAfter: (bytes: number) => void;
  stop: () => Promise<void>;
}

export async function proxyTo(server: string): Promise<CuttableLine> {
  const { hostname, port } = new URL(server);
  const pairs = new Set<Pair>();
  let open = true;
  let asked = 0;
  const listener = createServer((page) => {
    if (!open) {
      page.destroy();
      return;
    }
    const pair = new Pair(page, connect(Number(port), hostname), () => void ++asked);
    pairs.add(pair);
    pair.onEnd = () => void pairs.delete(pair);
  });
  await new Promise<void>((listening) => listener.listen(0, "127.0.0.1", listening));
  const endAll = (): void => {
    for (const pair of [...pairs]) pair.end();
  };
  return {
    address: `http://127.0.0.1:${(listener.address() as AddressInfo).port}`,
    sockets: () => asked,
    cut() {
      open = false;
      endAll();
    },
    heal() {
      open = true;
    },
    cutAfter(bytes) {
      for (const pair of pairs) if (pair.is_socket) pair.allowed = bytes;
    },
    stop() {
      endAll();
      return new Promise((done) => listener.close(() => done()));
    },
  };
}

class Pair {
  is_socket = false;
  /** More bytes of the page go through; then the line breaks. */
  allowed = Number.POSITIVE_INFINITY;
  onEnd: () => void = () => {};

  constructor(
    private readonly page: Socket,
    private readonly server: Socket,
    onSocket: () => void,
  ) {
    page.on("data", (bytes: Buffer) => {
      if (!this.is_socket && bytes.subarray(0, 8).toString("latin1") === "GET /ws/") {
        this.is_socket = true;
        onSocket();
      }
      const through = bytes.subarray(0, this.allowed);
      this.allowed -= through.length;
      if (this.allowed > 0) server.write(through);
      else server.write(through, () => this.end());
    });
    server.on("data", (bytes: Buffer) => void page.write(bytes));
    for (const end of [page, server]) {
      end.on("error", () => this.end());
      end.on("close", () => this.end());
    }
  }

  end(): void {
    this.page.destroy();
    this.server.destroy();
    this.onEnd();
  }
}
