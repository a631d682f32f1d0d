// Rows of a trend, the oldest dropped first: as much memory after ten hours as after ten minutes.

const KEPT = 6000; // five minutes of twenty rows a second

export class History {
  constructor(width) {
    this._columns = Array.from({ length: width + 1 }, () => []);
  }

  /** `row` is [time in ms, value, …]; null for a value that is not good. */
  add([ms, ...held]) {
    if (held.length + 1 !== this._columns.length) return; // of the choice before
    this._columns[0].push(ms / 1000);
    held.forEach((one, index) => this._columns[index + 1].push(one));
    if (this._columns[0].length > KEPT + 600) for (const column of this._columns) column.splice(0, 600);
  }

  copy() {
    const same = new History(this._columns.length - 1);
    same._columns = this._columns.map((column) => [...column]);
    return same;
  }

  /** The newest time, in s. */
  get last() {
    return this._columns[0].at(-1) ?? Date.now() / 1000;
  }

  /** Times in s, and a column for each value, as uPlot wants them. */
  columns() {
    return this._columns;
  }

  rows() {
    return this._columns[0].map((_, index) => this._columns.map((column) => column[index]));
  }
}
