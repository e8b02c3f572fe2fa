// Switches for the layers of a map; they name the colours too, in the legend's place.

class Layers {
  constructor(panel, bar, changed) {
    this.group = panel.group;
    const entries = [...panel.parts.legend?.querySelectorAll("[data-of]") ?? []];
    for (const entry of entries) {
      const layer = entry.dataset.of, [mark, text] = entry.children;
      const button = Object.assign(document.createElement("button"), { type: "button", className: "layer" });
      button.dataset.layer = layer;
      const swatch = shape(button, "svg", { width: 16, height: 10, "aria-hidden": "true" });
      shape(swatch, "path", { d: "M0 5h16", stroke: mark.getAttribute("stroke"), "stroke-width": 4 });
      button.append(text.textContent);
      button.setAttribute("aria-pressed", String(this.shown(layer)));
      button.addEventListener("click", () => {
        const shown = !this.shown(layer);
        const scale = panel.parts.scale?.dataset.scale === layer ? [panel.parts.scale] : [];
        for (const part of [entry, this.part(layer), ...scale])
          if (shown) part.removeAttribute("display"); else part.setAttribute("display", "none");
        button.setAttribute("aria-pressed", String(shown));
        changed();
      });
      bar.append(button);
    }
  }

  part(layer) { return this.group.querySelector(`[data-inside] > [data-layer="${layer}"]`); }

  shown(layer) {
    const part = this.part(layer);
    return part !== null && part.getAttribute("display") !== "none";
  }
}
