// The explorer's program: fetched and compiled once, for the page and for its workers.

const ADDRESS = new URL("./explorer_bg.wasm", import.meta.url);

/** The compiled program. */
export async function compiled() {
  const answer = await fetch(ADDRESS);
  if (!answer.ok) {
    throw new Error(`the program is not there (${answer.status})`);
  }
  // Not all servers say what it is, and then it is not compiled while it comes.
  const type = (answer.headers.get("content-type") ?? "").split(";")[0].trim();
  return type === "application/wasm"
    ? WebAssembly.compileStreaming(answer)
    : WebAssembly.compile(await answer.arrayBuffer());
}
