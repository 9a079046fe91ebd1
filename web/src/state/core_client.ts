// One worker with the core in it, as the page sees it.
import type { FromWorker, ToWorker } from "../worker/messages";

export class CoreClient {
  private readonly worker = new Worker(new URL("../worker/core_worker.ts", import.meta.url), {
    type: "module",
  });

  constructor(listener: (message: FromWorker) => void) {
    this.worker.onmessage = (event: MessageEvent<FromWorker>) => listener(event.data);
    this.worker.onerror = (event) => {
      listener({ type: "failed", message: event.message || "the core could not be started in this browser" });
    };
  }

  tell(message: ToWorker): void {
    this.worker.postMessage(message);
  }
  close(): void {
    this.worker.terminate();
  }
}
