// What a section's data holds, unpacked: columns of knots, machines as runs of states. The other side is chart.rs.

const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));

/** Rising numbers from their differences in LEB128. */
function rising(text) {
  const bytes = bytesOf(text);
  const numbers = [];
  let sum = 0, part = 0, scale = 1;
  for (const byte of bytes) {
    part += (byte & 0x7f) * scale;
    scale *= 128;
    if (byte < 0x80) {
      sum += part;
      numbers.push(sum);
      part = 0;
      scale = 1;
    }
  }
  return numbers;
}

/** 32-bit floats, lowest byte first. */
function floats(text) {
  const bytes = bytesOf(text);
  const view = new DataView(bytes.buffer);
  return Float64Array.from({ length: bytes.length / 4 }, (_, i) => view.getFloat32(4 * i, true));
}

/** The index of the last of rising numbers that is at most `x`; -1 if none is. */
function lastUpTo(numbers, x) {
  let low = 0, high = numbers.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (numbers[middle] <= x) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** One value over time: straight lines between knots, in the unit shown. */
class Column {
  constructor(packed, timeOf) {
    Object.assign(this, packed);
    this.t = Float64Array.from(rising(packed.t), timeOf);
    this.v = floats(packed.v).map((v) => v * packed.factor);
  }

  at(t) {
    const i = lastUpTo(this.t, t);
    if (i < 0 || t > this.t[this.t.length - 1]) return NaN;
    if (i + 1 >= this.t.length) return this.v[i];
    return this.v[i] + (this.v[i + 1] - this.v[i]) * (t - this.t[i]) / (this.t[i + 1] - this.t[i]);
  }

  /** The values at rising times. */
  sample(times) {
    const out = new Float64Array(times.length);
    let i = 0;
    for (let k = 0; k < times.length; k++) {
      while (i + 1 < this.t.length && this.t[i + 1] <= times[k]) i++;
      const next = Math.min(i + 1, this.t.length - 1);
      const run = this.t[next] - this.t[i];
      out[k] = run > 0 ? this.v[i] + (this.v[next] - this.v[i]) * (times[k] - this.t[i]) / run : this.v[i];
    }
    return out;
  }

  /** A value as it is read: as many digits as the column's span deserves. */
  text(v) {
    if (!Number.isFinite(v)) return "–";
    if (this.digits === undefined) {
      const most = this.v.reduce((most, v) => Math.max(most, Math.abs(v)), 0);
      this.digits = most > 0 ? Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(most)))) : 0;
    }
    return proper(v.toFixed(this.digits));
  }
}

/** A state machine over time. */
class Machine {
  constructor(packed, timeOf) {
    this.name = packed.name;
    this.states = packed.states;
    this.t = Float64Array.from(rising(packed.t), timeOf);
    this.s = bytesOf(packed.s);
  }

  at(t) {
    const i = lastUpTo(this.t, t);
    return i < 0 ? "–" : this.states[this.s[i]];
  }
}

/** A number with a proper minus sign, and no minus before zeros. */
const proper = (text) => (/[1-9]/.test(text) ? text.replace(/-/g, "−") : text.replace("-", ""));

/** Everything a chart draws. */
function unpack(packed) {
  const timeOf = (tick) => packed.start + tick / packed.rate_hz;
  return {
    ...packed,
    end: timeOf(packed.ticks),
    columns: packed.columns.map((column) => new Column(column, timeOf)),
    machines: packed.machines.map((machine) => new Machine(machine, timeOf)),
  };
}

/** Rising times that hold all knots of some columns, each once. */
function union(columns) {
  const all = Float64Array.from(columns.flatMap((column) => Array.from(column.t))).sort();
  return all.filter((t, i) => i === 0 || t !== all[i - 1]);
}
