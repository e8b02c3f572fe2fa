// What mouse, fingers and keys do to a map.

function listen(map) {
  const { stage } = map, pointers = new Map();
  let moved = 0;
  const at = (event) => {
    const box = map.svg.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  map.svg.addEventListener("pointerdown", (event) => {
    if (event.button > 0) return;
    pointers.set(event.pointerId, at(event));
    moved = pointers.size > 1 ? 99 : 0;
  });
  map.svg.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId), now = at(event);
    if (!before) {
      if (event.pointerType === "mouse" && !map.chosen?.pinned) {
        map.pointer = now;
        map.choose(map.at(...now), false);
        if (map.chosen) map.card.moveTo(...now);
      }
      return;
    }
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    moved += Math.hypot(dx, dy);
    if (pointers.size === 1 && moved > 4) {
      if (!map.svg.hasPointerCapture(event.pointerId)) map.svg.setPointerCapture(event.pointerId);
      stage.classList.add("held");
      map.move(dx, dy);
    } else if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const apart = (point) => Math.max(1, Math.hypot(point[0] - other[0], point[1] - other[1]));
      map.move(dx / 2, dy / 2);
      map.zoom(apart(now) / apart(before), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    }
    pointers.set(event.pointerId, now);
  });
  const end = (event) => {
    const had = pointers.delete(event.pointerId);
    if (!pointers.size) stage.classList.remove("held");
    if (!had || event.type !== "pointerup" || moved > 6 || pointers.size) return;
    map.pointer = null;
    map.choose(map.at(...at(event), event.pointerType === "mouse" ? 1 : 2), true);
  };
  for (const name of ["pointerup", "pointercancel"]) map.svg.addEventListener(name, end);
  map.svg.addEventListener("pointerleave", () => {
    map.pointer = null;
    if (!map.chosen?.pinned) map.choose(null, false);
  });
  map.svg.addEventListener("dblclick", (event) => map.zoom(event.shiftKey ? 0.5 : 2, ...at(event)));
  stage.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.metaKey && document.activeElement !== stage) return; // the reader scrolls the page
    event.preventDefault();
    const by = event.deltaY * (event.deltaMode === 1 ? 16 : 1) * (event.ctrlKey ? 3 : 1);
    map.zoom(Math.exp(-Math.max(-120, Math.min(120, by)) / 300), ...at(event));
  }, { passive: false });
  stage.addEventListener("touchmove", (event) => {
    if (event.touches.length > 1) event.preventDefault(); // two fingers are for the map, one scrolls the page
  }, { passive: false });
  stage.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target !== stage) return;
    const act = {
      ArrowLeft: () => map.move(60, 0), ArrowRight: () => map.move(-60, 0), ArrowUp: () => map.move(0, 60),
      ArrowDown: () => map.move(0, -60), "+": () => map.zoom(1.6), "=": () => map.zoom(1.6),
      "-": () => map.zoom(1 / 1.6), 0: () => map.fit(), Escape: () => map.choose(null, true),
    }[event.key];
    const layer = STEPS[event.key.toLowerCase()];
    if (act) act(); else if (layer) map.step(layer, event.shiftKey ? -1 : 1); else return;
    event.preventDefault();
  });
}
