// What moves in a module's memory, in the audio thread: strings, masses, plucked strings. Bounded, whatever the program.

/** The most points of a string that are sent. */
const POINTS = 49;
/** How much a greatest displacement fades from picture to picture. */
const FADES = 0.9;

/** A signed number of 4 or 8 bytes. */
function wordOf(view, at, bytes) {
  return bytes === 8 ? view.getInt32(at + 4, true) * 2 ** 32 + view.getUint32(at, true) : view.getInt32(at, true);
}

class Moving {
  constructor(memory, map, { strings, masses, plucked }) {
    const place = ({ cell, lsb, zero }) => ({ at: map.cell[cell].at, bytes: map.cell[cell].bytes, lsb, zero });
    Object.assign(this, { view: new DataView(memory.buffer), stride: 4 * map.keys });
    this.strings = strings.map(({ cell, unit }) => ({ at: map.cell[cell].at, parts: map.cell[cell].len, unit, points: Math.min(POINTS, map.cell[cell].len + 1) }));
    this.masses = masses.map(place);
    this.bent = plucked.map(({ bent }) => place(bent));
    this.voices = plucked.map(({ voice }) => ({ ...place(voice), most: 0 }));
    this.shapes = this.strings.map(({ points }) => new Float32Array(points));
    this.most = new Float32Array(strings.length);
  }

  value({ at, bytes, lsb, zero }) {
    return wordOf(this.view, at, bytes) * lsb + zero;
  }

  /** Looks at all, after a block of ticks: the greatest displacements. */
  look() {
    this.strings.forEach((string, n) => {
      const shape = this.shapes[n];
      let [sum, next, most] = [0, 1, 0];
      shape[0] = 0;
      for (let part = 0; part < string.parts; part++) {
        sum += this.view.getInt32(string.at + part * this.stride, true);
        // The point that lies nearest to a place of the picture.
        while (next < string.points && Math.round((next * string.parts) / (string.points - 1)) === part + 1) shape[next++] = sum * string.unit;
        most = Math.max(most, Math.abs(sum));
      }
      this.most[n] = Math.max(this.most[n], most * string.unit);
    });
  }

  /** Looks at what leaves the loops, after a tick. */
  hear() {
    for (const voice of this.voices) voice.most = Math.max(voice.most, Math.abs(this.value(voice)));
  }

  /** What a picture needs, all copied. */
  picture() {
    const told = {
      shapes: this.shapes.map((shape) => shape.slice()), most: this.most.slice(),
      masses: Float32Array.from(this.masses, (mass) => this.value(mass)),
      bent: Float32Array.from(this.bent, (bent) => this.value(bent)),
      voices: Float32Array.from(this.voices, ({ most }) => most),
    };
    for (let n = 0; n < this.most.length; n++) this.most[n] *= FADES;
    for (const voice of this.voices) voice.most *= FADES;
    return told;
  }
}
