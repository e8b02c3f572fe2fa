// What all charts share: a canvas made ready, times and tidy scales.

/** Prepare a canvas; gives its context and size, or null where it is not to be seen. */
export function begin(canvas) {
  const ratio = Math.min(devicePixelRatio || 1, 2), width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return null;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const ctx = canvas.getContext("2d");
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  ctx.clearRect(0, 0, width, height);
  ctx.font = "10px system-ui";
  ctx.lineJoin = "round";
  return { ctx, width, height };
}

export const minutes = (seconds) => {
  const s = Math.max(0, Math.floor(seconds)), h = Math.floor(s / 3600);
  const mm = Math.floor(s / 60) % 60, ss = String(s % 60).padStart(2, "0");
  return h ? `${h}:${String(mm).padStart(2, "0")}:${ss}` : `${mm}:${ss}`;
};

/** A tidy greatest value: 1, 2 or 5 times a power of ten. */
export function tidy(value) {
  const ten = 10 ** Math.floor(Math.log10(Math.max(value, 1e-9)));
  return [1, 2, 5, 10].find((m) => m * ten >= value) * ten;
}
