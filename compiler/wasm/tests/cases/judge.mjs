// Runs modules and writes what their memory has after every step: `node judge.mjs cases out`.
//
//   cases  for each: bytes of the module, the module, how many parts, (address, bytes) of each,
//          address of the clock, address and bytes of an event, address of the inputs, of live
//          values, how many steps, steps
//   step   0 init | 1 tick, then bytes of inputs and inputs | 2 number and value of a live value |
//          3 events are taken
//   out    after each init and tick: parts, then the events that are kept
import { readFileSync, openSync, writeSync, closeSync } from "node:fs";

const [, , from, to] = process.argv;
const cases = readFileSync(from);
const out = openSync(to, "w");
let at = 0;
const word = () => cases.readUInt32LE((at += 4) - 4);
const bytes = (count) => cases.subarray((at += count) - count, at);

while (at < cases.length) {
  const module = new WebAssembly.Module(bytes(word()));
  const map = JSON.parse(new TextDecoder().decode(WebAssembly.Module.customSections(module, "whippen")[0]));
  const { memory, init, tick } = new WebAssembly.Instance(module).exports;
  const view = new DataView(memory.buffer);
  const parts = Array.from({ length: word() }, () => [word(), word()]);
  const [clock, events, eventBytes, inputs, lives] = [word(), word(), word(), word(), word()];
  if (map.clock !== clock || map.inputs !== inputs) throw new Error("the map is another one");
  const dump = () => {
    const kept = view.getUint32(clock + 8, true) * eventBytes;
    for (const [address, count] of [...parts, [events, kept]]) writeSync(out, new Uint8Array(memory.buffer, address, count));
  };
  for (let steps = word(); steps > 0; steps--) {
    const step = word();
    if (step === 2) {
      const live = word();
      view.setInt32(lives + 4 * live, word(), true);
    } else if (step === 3) {
      view.setUint32(clock + 8, 0, true);
    } else {
      new Uint8Array(memory.buffer).set(bytes(word()), inputs);
      step === 0 ? init() : tick();
      dump();
    }
  }
}
closeSync(out);
