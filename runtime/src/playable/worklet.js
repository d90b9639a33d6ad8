// The player in the audio thread: one tick is one sample. What a page draws is sent about 60 times a second, and never more than
// two pictures before the page says that it has drawn one: a page that is hidden or slow costs the audio thread nothing.

/** Samples from one picture to the next. */
const PICTURE = 768;
/** Pictures that a page may owe. */
const OWED_MAX = 2;
/** The most places and events that a picture tells; later places replace the path, earlier events are only counted. */
const PATH_MAX = 4096;
const EVENTS_TOLD = 256;
/** Partials of a strike that the program does not let hear itself: how loud, and how long (s). */
const PARTIALS = [[1, 1.6], [0.5, 1.1], [0.25, 0.8], [0.12, 0.5], [0.06, 0.35]];

/** Tones for strikes: sums of damped sines. */
class Tones {
  constructor(rate, keys, firstNote) {
    Object.assign(this, { rate, firstNote, voices: Array.from({ length: keys }, () => null) });
  }

  strike(key, loudness) {
    const pitch = 440 * 2 ** ((this.firstNote + key - 69) / 12);
    const partial = ([size, seconds], at) => {
      const angle = (2 * Math.PI * pitch * (at + 1)) / this.rate;
      const decay = Math.exp(-1 / (seconds * this.rate));
      return { re: 0, im: size * loudness, cos: decay * Math.cos(angle), sin: decay * Math.sin(angle) };
    };
    this.voices[key] = PARTIALS.filter((_, at) => pitch * (at + 1) < this.rate / 2).map(partial);
  }

  damp(key) {
    for (const partial of this.voices[key] ?? []) {
      const shorter = Math.exp(-1 / (0.05 * this.rate));
      [partial.cos, partial.sin] = [partial.cos * shorter, partial.sin * shorter];
    }
  }

  sample() {
    let sum = 0;
    this.voices.forEach((voice, key) => {
      if (!voice) return;
      let energy = 0;
      for (const partial of voice) {
        const { re, im, cos, sin } = partial;
        [partial.re, partial.im] = [re * cos - im * sin, re * sin + im * cos];
        sum += partial.re;
        energy += partial.re ** 2 + partial.im ** 2;
      }
      if (energy < 1e-10) this.voices[key] = null;
    });
    return sum;
  }
}

class Processor extends AudioWorkletProcessor {
  constructor({ processorOptions }) {
    super();
    const { firstNote, mark } = processorOptions;
    this.player = new Player(processorOptions);
    this.tones = this.player.channels.length === 0 ? new Tones(this.player.rate, this.player.map.keys, firstNote) : null;
    Object.assign(this, { mark, shown: 0, dropped: 0, next: null, sinceShown: 0, last: [], owed: 0, counts: { events: 0, strikes: 0 } });
    this.path = new Float32Array(PATH_MAX * 2 * this.player.ports.length);
    this.filled = 0;
    this.port.onmessage = ({ data }) => this.told(data);
  }

  told({ kind, ...data }) {
    const { player } = this;
    if (kind === "lead") player.lead(data.key, data.port, data.x);
    else if (kind === "set") player.set(data.live, data.value);
    else if (kind === "hand") player.hand = data.hand;
    else if (kind === "show") this.shown = data.key;
    else if (kind === "seen") this.owed = Math.max(0, this.owed - 1);
    else if (kind === "restart") player.restart();
    else if (kind === "record") {
      // From a fresh start, so that a run over what is saved is the same, word for word.
      player.restart();
      player.record(data.key);
    }
    else if (kind === "log") {
      player.restart();
      player.log = new Log(player);
    }
    else if (kind === "logged") {
      this.port.postMessage({ kind, ...player.log?.finish() });
      player.log = null;
    }
    else if (kind === "recorded") {
      this.port.postMessage({ kind, words: Uint16Array.from(player.recording?.words ?? []), key: player.recording?.key });
      player.recording = null;
    }
  }

  process(_, [[left, right]]) {
    // The audio clock itself tells what was left out.
    if (this.next !== null && currentFrame > this.next) this.dropped += currentFrame - this.next;
    this.next = currentFrame + left.length;
    const { player } = this;
    for (let n = 0; n < left.length; n++) {
      player.tick();
      left[n] = this.tones ? 0.2 * this.tones.sample() : player.sample(0);
      if (right) right[n] = player.channels.length > 1 ? player.sample(1) : left[n];
      player.moving?.hear();
      if (n % 16 === 0) this.trace();
    }
    player.moving?.look();
    for (const event of player.happened()) {
      if (event.name === this.mark) this.tones?.strike(event.key, Math.min(1, (event.args[0]?.[1] ?? 1) / 4));
      if (event.name === "release") this.tones?.damp(event.key);
      this.counts.events += 1;
      if (event.name === this.mark) this.counts.strikes += 1;
      this.last.push(event);
      if (this.last.length > EVENTS_TOLD) this.last.shift();
    }
    this.sinceShown += left.length;
    if (this.sinceShown >= PICTURE && this.owed < OWED_MAX) this.show();
    return true;
  }

  /** Notes where the ports are that are shown, and their forces. */
  trace() {
    const { player, path } = this;
    if (this.filled === path.length) this.filled = 0;
    for (let port = 0; port < player.ports.length; port++) {
      path[this.filled++] = this.position(port);
      path[this.filled++] = player.force(this.shown, port);
    }
  }

  position(port) {
    return this.player.x[this.shown * this.player.ports.length + port];
  }

  show() {
    const { player, last, dropped, counts } = this;
    const moving = player.moving?.picture() ?? null;
    this.port.postMessage({ kind: "shown", ticks: player.ticks, places: player.x.slice(), path: this.path.slice(0, this.filled), events: last, counts: { ...counts }, moving, dropped });
    this.owed += 1;
    Object.assign(this, { filled: 0, last: [], sinceShown: 0 });
  }
}

registerProcessor("player", Processor);
