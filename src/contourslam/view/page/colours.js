// Colours of the theme, read from the style sheet, and those that many things of one kind take turns at.

let cache = {};

export function forgetColours() { cache = {}; }

/** A colour of the style sheet by its name, without the dashes. */
export function colour(name) {
  return cache[name] ??= getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

export const laneColour = (lane) => colour(`lane${lane % 4}`);

/** A colour for the n-th contour: neighbours differ clearly. */
export function contourColour(n) {
  const dark = document.documentElement.dataset.theme === "dark";
  return `hsl(${(n * 137.508 + 190) % 360} ${dark ? 75 : 68}% ${dark ? 66 : 42}%)`;
}

const STAGES = ["#4c9be8", "#f2a541", "#63b96c", "#b283e0", "#e5707e", "#35b4ab", "#c9a227", "#8898aa", "#d982c3", "#7b8f3a"];
export const stageColour = (n) => STAGES[n % STAGES.length];
