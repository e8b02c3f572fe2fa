// The moment of the run that all figures show: the one under the mouse, else the one that was clicked on.

const moment = {
  hovered: null, pinned: null, changed: new EventTarget(),
  get time() { return this.hovered ?? this.pinned; },
  hover(time) { this.set(time, this.pinned); },
  pin(time) { this.set(null, time); },
  set(hovered, pinned) {
    if (hovered === this.hovered && pinned === this.pinned) return;
    [this.hovered, this.pinned] = [hovered, pinned];
    this.changed.dispatchEvent(new Event("change"));
  },
};

/** A time since the start. */
function clock(seconds) {
  const tenths = Math.round(seconds * 10);
  return `${Math.floor(tenths / 600)}:${String(Math.floor(tenths / 10) % 60).padStart(2, "0")}.${tenths % 10} min`;
}
