// Runs commands with the module under node, as a worker of the studio does: `node command.mjs whippen.wasm wasi.js < cases.json`.
// A case is { words, files, input }, an outcome { code, output, errors, files }; files are texts in base64.
import { readFileSync } from "node:fs";
const [, , compiler, wasi] = process.argv;
const { runCommand } = new Function(`${readFileSync(wasi, "utf8")}; return { runCommand };`)();
const module = new WebAssembly.Module(readFileSync(compiler));
const base64 = (bytes) => Buffer.from(bytes).toString("base64");
const outcomes = JSON.parse(readFileSync(0, "utf8")).map(({ words, files, input }) => {
  const given = new Map(Object.entries(files).map(([name, text]) => [name, new Uint8Array(Buffer.from(text, "base64"))]));
  const { files: left, ...told } = runCommand(module, { words, files: given, input: new TextEncoder().encode(input) });
  return { ...told, files: Object.fromEntries([...left].map(([name, bytes]) => [name, base64(bytes)])) };
});
console.log(JSON.stringify(outcomes));
