// Plays a page's player under node, saves what it records, and tells what was driven: `node record.mjs page.html seconds`.
import { readFileSync, writeFileSync } from "node:fs";
const [, , page, seconds] = process.argv;
const html = readFileSync(page, "utf8");
const text = (id) => html.split(`id="${id}">`)[1].split("</script>")[0];
const data = JSON.parse(text("data"));
const bytes = Buffer.from(text("module"), "base64");
const section = WebAssembly.Module.customSections(new WebAssembly.Module(bytes), "whippen")[0];
const map = JSON.parse(new TextDecoder().decode(section));
const { Player, recordingTable } = new Function(`${text("player")}; return { Player, recordingTable };`)();
const hand = Object.fromEntries(data.hand.map(([name, value]) => [name, value]));
const player = new Player({ bytes, map, ports: data.ports, hand });
const key = map.keys - 1;
player.record(key);
const driven = [];
for (let n = 0; n < seconds * player.rate; n++) {
  data.ports.forEach((_, port) => {
    const { low, high } = data.reach[port];
    const { start } = data.ports[port];
    const sway = Math.max(0, Math.sin((n / player.rate) * (7 + 2 * port)));
    player.lead(key, port, start + sway * (high - start));
  });
  player.tick();
  driven.push(data.ports.flatMap((port, at) => (port.drive === null ? [] : [String(player.force(key, at))])));
}
writeFileSync("recorded.csv", recordingTable(player.recording.words, data.ports, data.titles, player.rate));
console.log(JSON.stringify(driven));
