// A worker of the explorer. The first message is the compiled program; orders come after it, and wait
// until it runs.

import init, { work } from "./explorer.js";

// A program that ends while it waits for something would end unheard.
self.addEventListener("unhandledrejection", (event) => {
  setTimeout(() => {
    throw event.reason;
  });
});

const early = [];
self.onmessage = (event) => {
  if (!(event.data instanceof WebAssembly.Module)) {
    early.push(event);
    return;
  }
  init({ module_or_path: event.data }).then((program) => {
    self.memory = () => program.memory.buffer.byteLength;
    work();
    // What came meanwhile is heard now, in its order.
    early.forEach((late) => self.onmessage(late));
  });
};
