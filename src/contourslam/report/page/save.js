// A figure as a file of its own: as it is laid out and looked at now, always in the colours of light paper.

function saveButton(figure, svg) {
  const button = Object.assign(document.createElement("button"), { type: "button", textContent: "Save as SVG" });
  button.className = "save";
  button.addEventListener("click", () => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([asFile(svg)], { type: "image/svg+xml" }));
    link.download = `${document.title.replace(/[^\p{L}\p{N}._-]+/gu, "_")}-${figure.dataset.name}.svg`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  });
  return button;
}

/** What scripts added and what is hidden is left out; what the page's style did is written down. */
function asFile(svg) {
  const copy = svg.cloneNode(true);
  for (const part of copy.querySelectorAll("[data-live], [display='none']")) part.remove();
  for (const path of copy.querySelectorAll("[data-inside] path")) path.setAttribute("vector-effect", "non-scaling-stroke");
  copy.removeAttribute("class");
  return `<?xml version="1.0" encoding="UTF-8"?>\n${new XMLSerializer().serializeToString(copy)}\n`;
}
