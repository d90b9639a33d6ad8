// The compiler's workers. A lane does one command after the other; what nobody waits for any more is stopped.

const unbase64 = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

/** The bytes of a stream. */
async function through(bytes, stream) {
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
}

/** The bytes of what stands in the page, compressed. */
const unpacked = (id) => through(unbase64(document.getElementById(id).textContent), new DecompressionStream("gzip"));

/** The compiler, which stands at the page's end. */
async function loadCompiler() {
  if (document.readyState === "loading") await new Promise((go) => document.addEventListener("DOMContentLoaded", go, { once: true }));
  return WebAssembly.compile(await unpacked("compiler"));
}

/** One worker, made anew where what it works at is not wanted any more. */
class Lane {
  constructor(module, source) {
    Object.assign(this, { module, source, worker: null, number: 0, waiting: new Map() });
  }

  start() {
    const url = URL.createObjectURL(new Blob([this.source], { type: "text/javascript" }));
    const worker = new Worker(url);
    worker.onmessage = ({ data }) => {
      URL.revokeObjectURL(url);
      this.waiting.get(data.number)?.({ ...data, files: new Map(Object.entries(data.files)) });
      this.waiting.delete(data.number);
    };
    worker.postMessage({ module: this.module });
    this.worker = worker;
  }

  /** Runs a command; none, where it was stopped. */
  run(words, files, input) {
    if (!this.worker) this.start();
    const number = ++this.number;
    return new Promise((done) => {
      this.waiting.set(number, done);
      this.worker.postMessage({ number, words, files: Object.fromEntries(files), input });
    });
  }

  /** Stops what it works at and what waits. */
  stop() {
    if (this.waiting.size === 0) return;
    this.worker.terminate();
    this.worker = null;
    this.waiting.forEach((done) => done(null));
    this.waiting.clear();
  }
}

/** The answer of the language server to one request about a text, or none. */
async function askServer(lane, files, name, text, method, params) {
  // The compiler may not be there yet.
  if (!lane) return null;
  const uri = `file:///${encodeURIComponent(name)}`;
  const notification = (method, params) => ({ jsonrpc: "2.0", method, params });
  const request = (id, method, params) => ({ id, ...notification(method, params) });
  const messages = [
    request(1, "initialize", { capabilities: {} }),
    notification("initialized", {}),
    notification("textDocument/didOpen", { textDocument: { uri, languageId: "whip", version: 1, text } }),
    request(2, method, { textDocument: { uri }, ...params }),
    request(3, "shutdown"),
    notification("exit"),
  ];
  const framed = messages.map((message) => {
    const body = JSON.stringify(message);
    return `Content-Length: ${new TextEncoder().encode(body).length}\r\n\r\n${body}`;
  });
  const done = await lane.run(["lsp"], files, framed.join(""));
  const answers = done?.output.split(/Content-Length: \d+\r\n\r\n/).filter((part) => part !== "") ?? [];
  return answers.map((part) => JSON.parse(part)).find(({ id }) => id === 2)?.result ?? null;
}
