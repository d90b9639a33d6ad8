// What a study keeps of a session: every change of a sensor word or a live value with its tick, and a digest a second of all
// drive words and samples, so that `whippen study --replay` can tell whether the same comes out again.
//
//   gesture = all words and live values at the start, then for each change: varint(ticks since the last one * values + which), value
//
// Sensor words have 2 bytes, live values 4, lowest first. The other side is `study/replay.rs`.

/** The most bytes of a gesture: half an hour of an arm with four axes. */
const GESTURE_MAX = 2 ** 25;

class Log {
  constructor(player) {
    const { inputs, lives } = player;
    Object.assign(this, { player, bytes: new Uint8Array(2 ** 16), length: 0, ticks: 0, last: 0, hash: 0x811c9dc5, digests: [] });
    this.words = inputs.slice();
    this.values = lives.slice();
    for (const word of this.words) this.put(word, 2);
    for (const value of this.values) this.put(value, 4);
    this.second = Math.round(player.rate);
  }

  put(value, count) {
    if (this.length + 8 > this.bytes.length) {
      const longer = new Uint8Array(2 * this.bytes.length);
      longer.set(this.bytes);
      this.bytes = longer;
    }
    for (let n = 0; n < count; n++) this.bytes[this.length++] = (value >> (8 * n)) & 255;
  }

  change(which, value, count) {
    let number = (this.ticks - this.last) * (this.words.length + this.values.length) + which;
    this.last = this.ticks;
    for (; number > 127; number = Math.floor(number / 128)) this.put((number % 128) | 128, 1);
    this.put(number, 1);
    this.put(value, count);
  }

  /** Before a tick: what has changed. */
  before() {
    if (this.length > GESTURE_MAX) return;
    const { inputs, lives } = this.player;
    for (let n = 0; n < inputs.length; n++) {
      if (inputs[n] !== this.words[n]) this.change(n, (this.words[n] = inputs[n]), 2);
    }
    for (let n = 0; n < lives.length; n++) {
      if (lives[n] !== this.values[n]) this.change(inputs.length + n, (this.values[n] = lives[n]), 4);
    }
  }

  mix(word, count) {
    for (let n = 0; n < count; n++) this.hash = Math.imul(this.hash ^ ((word >> (8 * n)) & 255), 0x01000193);
  }

  /** After a tick: what came out. */
  after() {
    if (this.length > GESTURE_MAX) return;
    const { outputs, channels } = this.player;
    for (let n = 0; n < outputs.length; n++) this.mix(outputs[n], 2);
    for (const channel of channels) this.mix(channel[0], 4);
    this.ticks += 1;
    if (this.ticks % this.second === 0) this.digest();
  }

  digest() {
    this.digests.push((this.hash >>> 0).toString(16).padStart(8, "0"));
    this.hash = 0x811c9dc5;
  }

  /** All that was kept. */
  finish() {
    if (this.ticks % this.second !== 0) this.digest();
    return { ticks: this.ticks, gesture: this.bytes.slice(0, this.length), digests: this.digests };
  }
}
