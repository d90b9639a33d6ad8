// The part of time that all panels of a section show, and the instant the crosshair is at.

class View {
  constructor(start, end, least) {
    this.full = [start, end];
    this.least = least;
    [this.from, this.to] = this.full;
    this.cursor = null;
    this.fit = false;
    this.watchers = { range: [], cursor: [] };
  }

  /** Calls `watcher` now and whenever the range, or the cursor, has changed. */
  on(what, watcher) {
    this.watchers[what].push(watcher);
    watcher();
  }

  tell(what) {
    for (const watcher of this.watchers[what]) watcher();
  }

  /** Shows `from` to `to`, as far as there is anything. */
  show(from, to) {
    const [start, end] = this.full;
    const span = Math.min(Math.max(to - from, this.least), end - start);
    const middle = (from + to) / 2;
    const left = Math.min(Math.max(middle - span / 2, start), end - span);
    if (left === this.from && left + span === this.to) return;
    [this.from, this.to] = [left, left + span];
    this.tell("range");
  }

  zoom(factor, around = this.cursor ?? (this.from + this.to) / 2) {
    const at = Math.min(Math.max(around, this.from), this.to);
    this.show(at - (at - this.from) * factor, at + (this.to - at) * factor);
  }

  /** Moves by a part of what is shown. */
  pan(part) {
    const by = (this.to - this.from) * part;
    this.show(this.from + by, this.to + by);
  }

  reset() {
    this.show(...this.full);
  }

  point(t) {
    if (t === this.cursor) return;
    this.cursor = t;
    this.tell("cursor");
  }

  get whole() {
    return this.from === this.full[0] && this.to === this.full[1];
  }
}
