// Opens a page in Chromium and runs a script in it, in real time: `node drive.mjs chromium page.html script.js [picture.png]`.
import { spawn } from "node:child_process";
import { readFileSync, writeFileSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
const [, , browser, page, script, picture, size = "1200,900", dark = ""] = process.argv;
const profile = mkdtempSync(join(tmpdir(), "page-"));
const flags = ["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
  "--autoplay-policy=no-user-gesture-required", "--remote-debugging-pipe", `--window-size=${size}`, `--user-data-dir=${profile}`, ...(dark ? ["--force-dark-mode", "--blink-settings=preferredColorScheme=0"] : [])];
const chromium = spawn(browser, flags, { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
const [, , , out, back] = chromium.stdio;
let text = "", number = 0;
const waiting = new Map(), heard = [];
back.on("data", (chunk) => {
  text += chunk;
  for (let end; (end = text.indexOf("\0")) >= 0; text = text.slice(end + 1)) {
    const message = JSON.parse(text.slice(0, end));
    if (message.id) waiting.get(message.id)?.(message);
    else if (message.method === "Runtime.exceptionThrown") heard.push(message.params.exceptionDetails.exception?.description ?? message.params.exceptionDetails.text);
    else if (message.method === "Log.entryAdded" && message.params.entry.level === "error") heard.push(message.params.entry.text);
  }
});
const ask = (method, params = {}, sessionId) => new Promise((done) => {
  const id = ++number;
  waiting.set(id, done);
  out.write(JSON.stringify({ id, method, params, sessionId }) + "\0");
});
const { result: { targetId } } = await ask("Target.createTarget", { url: "about:blank" });
const { result: { sessionId } } = await ask("Target.attachToTarget", { targetId, flatten: true });
const tell = (method, params) => ask(method, params, sessionId);
await tell("Runtime.enable"); await tell("Log.enable"); await tell("Page.enable");
await tell("Page.navigate", { url: `file://${page}` });
await new Promise((go) => setTimeout(go, 700));
const code = `(async () => { const after = (ms) => new Promise((go) => setTimeout(go, ms)); ${readFileSync(script, "utf8")} })()`;
const { result } = await tell("Runtime.evaluate", { expression: code, awaitPromise: true, returnByValue: true, userGesture: true });
if (picture) {
  const { result: { data } } = await tell("Page.captureScreenshot", { format: "png" });
  writeFileSync(picture, Buffer.from(data, "base64"));
}
console.log(JSON.stringify({ value: result.result?.value, exception: result.exceptionDetails?.exception?.description, heard }));
chromium.kill();
await new Promise((go) => chromium.on("exit", go));
try {
  rmSync(profile, { recursive: true, force: true });
} catch {
  // A process of the browser still writes there; the folder is in that of temporary files.
}
