// The player: a module and what moves its ports, tick by tick. It runs in an audio thread, in a page or under node.
//
//   target (where a hand wants a port) --hand, mass, stops--> position --sensor--> word --module--> drive word --'
//
// Positions grow downwards, forces of the drive push up, as in `whippen run --hand`. What nothing drives follows its target.

/** Steps of the equation of motion in a tick. */
const STEPS = 4;
/** How fast what is not driven follows its target (1/s). */
const FOLLOW = 400;
/** The most ticks that a recording has. */
const RECORDED_MAX = 44100 * 120;

/** To the nearest integer, halves away from zero. */
const rounded = (value) => Math.sign(value) * Math.floor(Math.abs(value) + 0.5);

/** The word of a converter of so many bits: the code's bits, repeated below. */
function converted(part, bits) {
  const last = 2 ** bits - 1;
  const code = Math.min(last, Math.max(0, Math.floor(part * last + 0.5)));
  let [word, place] = [0, 16];
  while (place > bits) {
    place -= bits;
    word |= code << place;
  }
  return word | (code >> (bits - place));
}

class Player {
  /**
   * `bytes` of a module and its `map`, which an audio thread could not decode; `ports` of one key: { low, high, bits, step (or
   * null), updates (a tick), drive (index or null), fullScale, mechanics (or null), start }.
   */
  constructor({ bytes, map, ports, hand, window = null }) {
    const { memory, init, tick } = new WebAssembly.Instance(new WebAssembly.Module(bytes)).exports;
    Object.assign(this, { map, init, step: tick, ports, hand, rate: map.rate_hz[0] / map.rate_hz[1] });
    this.inputs = new Uint16Array(memory.buffer, map.inputs, map.keys * map.in.length);
    this.outputs = new Int16Array(memory.buffer, map.outputs, map.keys * map.out.length);
    this.lives = new Int32Array(memory.buffer, map.lives, map.live.length);
    this.clock = new Uint32Array(memory.buffer, map.clock, 6);
    this.events = new Int32Array(memory.buffer, map.events, 4096 * map.event_words);
    this.channels = map.meaning.channels.map((cell) => new Int32Array(memory.buffer, map.cell[cell].at, map.keys));
    const count = map.keys * ports.length;
    [this.target, this.before, this.x, this.v] = Array.from({ length: 4 }, () => new Float64Array(count));
    this.updates = ports.map(() => -1);
    this.follow = 1 - Math.exp(-FOLLOW / this.rate);
    this.moving = window && new Moving(memory, map, window);
    [this.recording, this.log] = [null, null];
    this.restart();
  }

  /** Everything as before the first tick, but live values. */
  restart() {
    this.ports.forEach((port, at) => {
      for (let key = 0; key < this.map.keys; key++) {
        const place = key * this.ports.length + at;
        this.target[place] = this.before[place] = this.x[place] = port.start;
        this.v[place] = 0;
      }
    });
    this.ticks = 0;
    this.updates.fill(-1);
    this.sense();
    this.outputs.fill(0);
    this.init();
    this.updates.fill(-1);
  }

  /** Where a hand wants a port of a key (SI). */
  lead(key, port, x) {
    this.target[key * this.ports.length + port] = x;
  }

  /** Sets a live value (SI), held to its range. */
  set(live, value) {
    const { low, high } = this.map.live[live];
    this.lives[live] = Math.min(high, Math.max(low, Math.round(value / this.map.meaning.lives[live].lsb)));
  }

  /** The force on a port of a key (SI), by the drive word of the last tick. */
  force(key, port) {
    const { drive, fullScale } = this.ports[port];
    return drive === null ? 0 : (this.outputs[key * this.map.out.length + drive] / 32768) * fullScale;
  }

  /** Begins to keep the words of a key. */
  record(key) {
    this.recording = { key, words: [] };
  }

  /** One tick. */
  tick() {
    for (let key = 0; key < this.map.keys; key++) {
      for (let at = 0; at < this.ports.length; at++) this.move(key, at, this.ports[at]);
    }
    this.sense();
    if (this.recording && this.recording.words.length < RECORDED_MAX * this.ports.length) {
      const from = this.recording.key * this.ports.length;
      this.recording.words.push(...this.inputs.subarray(from, from + this.ports.length));
    }
    this.log?.before();
    this.step();
    this.log?.after();
    this.ticks += 1;
  }

  /** Moves a port by a tick. */
  move(key, at, port) {
    const place = key * this.ports.length + at;
    const [target, dt] = [this.target[place], 1 / this.rate / STEPS];
    if (port.mechanics === null) {
      this.x[place] += (target - this.x[place]) * this.follow;
      return;
    }
    const { mass, damping, friction, stops } = port.mechanics;
    const { hand } = this;
    const speed = (target - this.before[place]) * this.rate;
    this.before[place] = target;
    const push = this.force(key, at);
    let [x, v] = [this.x[place], this.v[place]];
    for (let n = 0; n < STEPS; n++) {
      let force = hand.stiffness * (target - x) + hand.damping * (speed - v) - push - damping * v - (friction * v) / (Math.abs(v) + 1e-3);
      const beyond = stops === null ? 0 : x > stops.high ? x - stops.high : x < stops.low ? x - stops.low : 0;
      if (beyond !== 0) force -= stops.stiffness * beyond + stops.damping * v;
      v += (force / (mass + hand.mass)) * dt;
      x += v * dt;
    }
    [this.x[place], this.v[place]] = [x, v];
  }

  /** The words of all sensors; one that is read less often than there are ticks holds its word. */
  sense() {
    this.ports.forEach(({ low, high, bits, step, updates }, port) => {
      const update = Math.trunc(this.ticks * updates);
      if (update === this.updates[port]) return;
      this.updates[port] = update;
      for (let place = port; place < this.x.length; place += this.ports.length) {
        // Beyond its ends it reads its ends, rounded like all else.
        const at = Math.min(high, Math.max(low, this.x[place]));
        const told = step === null ? at : rounded(at / step) * step;
        this.inputs[place] = converted((told - low) / (high - low), bits);
      }
    });
  }

  /** The sample of a channel, 1 at full scale. */
  sample(channel) {
    let sum = 0;
    for (const one of this.channels[channel]) sum += one;
    return sum / this.map.meaning.full_scale;
  }

  /** What happened since the last call: { tick, key, name, args }. */
  happened() {
    const { event_words: words, event_head: head, meaning } = this.map;
    const all = [];
    for (let n = 0; n < this.clock[2]; n++) {
      const record = this.events.subarray(n * words, (n + 1) * words);
      const { name, args, lsbs } = meaning.events[record[3]];
      all.push({ tick: record[0], key: record[2], name, args: args.map((title, at) => [title, record[head + at] * lsbs[at]]) });
    }
    this.clock[2] = 0;
    return all;
  }
}

/** The table of a recording, as `whippen run --motion` reads it: the value in the middle of each word. */
function recordingTable(words, ports, titles, rate) {
  const value = (word, { low, high }) => low + (word / 65535) * (high - low);
  const rows = [["t_s", ...titles].join(",")];
  for (let n = 0; n * ports.length < words.length; n++) {
    rows.push([n / rate, ...ports.map((port, at) => value(words[n * ports.length + at], port))].join(","));
  }
  return rows.join("\n") + "\n";
}
