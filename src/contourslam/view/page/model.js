// What the page knows: all that the server has said so far.

const ROW = 7, LANE = 7; // numbers a knot has, and has for each lane

/** An array of numbers that grows. */
class Growing {
  constructor(kind) {
    this.kind = kind;
    this.data = new kind(4096);
    this.length = 0;
  }

  push(values) {
    const need = this.length + values.length;
    if (need > this.data.length) {
      const larger = new this.kind(Math.max(need, 2 * this.data.length));
      larger.set(this.data.subarray(0, this.length));
      this.data = larger;
    }
    this.data.set(values, this.length);
    this.length = need;
  }
}

export class Model {
  constructor() {
    this.about = null;
    this.events = [];
    this.forget();
  }

  /** Begin anew: another connection, or the server has given up every second knot. */
  forget() {
    this.knots = 0;
    this.rows = new Growing(Float32Array);
    this.poses = new Growing(Float32Array);
    this.ink = new Growing(Int16Array);
    this.inkStarts = new Growing(Int32Array);
    this.inkStarts.push([0]);
    this.maps = [];
    this.mapVersion = 0; // maps taken so far; each carries its number
    this.frame = null;
    this.status = null;
    this.story = null;
    this.newEvents = [];
  }

  take(message) {
    switch (message.kind) {
      case "hello":
        this.forget();
        this.about = message.about;
        this.unit = message.unit;
        this.lanes = message.about.lanes.length;
        break;
      case "knots": this.takeKnots(message); break;
      case "map":
        this.mapVersion += 1;
        this.maps[message.lane] = readMap(message, this.mapVersion);
        break;
      case "frame": this.frame = readFrame(message); break;
      case "status":
        this.status = message;
        this.newEvents.push(...message.events);
        this.events.push(...message.events);
        if (this.events.length > 500) this.events.splice(0, this.events.length - 500);
        break;
      case "story": this.story = message; break;
    }
  }

  takeKnots(message) {
    if (message.first !== this.knots) return;
    this.knots += message.count;
    this.rows.push(message.arrays.rows);
    this.poses.push(message.arrays.poses);
    const starts = new Int32Array(message.count);
    let at = this.ink.length / 2;
    message.arrays.sizes.forEach((size, i) => { starts[i] = at += size; });
    this.ink.push(message.arrays.ink);
    this.inkStarts.push(starts);
  }

  /** How many knots lie behind what is looked at. */
  get shown() {
    return Math.min(this.knots, this.frame ? this.frame.knots : 0);
  }

  /** Pose of a knot as it is known by the map that is shown, else as it was at the time; into `out`. */
  pose(lane, knot, out) {
    const map = this.maps[lane];
    if (map && knot < map.knots) {
      const at = 3 * knot, path = map.path;
      out[0] = path[at]; out[1] = path[at + 1]; out[2] = path[at + 2];
    } else {
      const at = LANE * (knot * this.lanes + lane), poses = this.poses.data;
      out[0] = poses[at]; out[1] = poses[at + 1]; out[2] = poses[at + 2];
    }
    return out;
  }

  /** One number of each knot up to now: "time", "sigma", "nis", "dof", "quality", "error". */
  series(what, lane) {
    const n = this.shown, out = new Float32Array(n);
    const rows = this.rows.data, poses = this.poses.data;
    const column = { sigma: 3, nis: 4, quality: 5, dof: 6 }[what];
    for (let i = 0; i < n; i++) {
      const at = LANE * (i * this.lanes + lane), row = ROW * i;
      if (what === "time") out[i] = rows[row];
      else if (what === "error") out[i] = Math.hypot(poses[at] - rows[row + 4], poses[at + 1] - rows[row + 5]);
      else out[i] = poses[at + column];
    }
    return out;
  }

  /** Raw odometry (1) or true pose (4) of the knots, by the column at which it begins. */
  track(column) {
    const n = this.shown, out = new Float32Array(2 * n), rows = this.rows.data;
    for (let i = 0; i < n; i++) {
      out[2 * i] = rows[ROW * i + column];
      out[2 * i + 1] = rows[ROW * i + column + 1];
    }
    return out;
  }
}

function readMap({ arrays: a }, version) {
  const byId = new Map();
  a.corner_ids.forEach((id, i) => byId.set(id, i));
  const majors = Float32Array.from(a.corner_ids, (_, i) => { // standard deviation of each corner where it is largest
    const [xx, xy, yy] = a.covariances.subarray(3 * i, 3 * i + 3);
    return Math.sqrt(Math.max((xx + yy) / 2 + Math.hypot((xx - yy) / 2, xy), 0));
  });
  return { ...a, version, byId, majors, knots: a.path.length / 3 };
}

function readFrame(message) {
  const { arrays } = message;
  message.lanes.forEach((lane, i) => {
    for (const name of ["curve", "curve_starts", "response", "candidates", "corners", "seen_ids", "seen"]) {
      lane[name] = arrays[`${name}_${i}`];
    }
  });
  return { ...message, points: arrays.points, starts: arrays.starts };
}
