// Every drawing of the page comes alive, at the width there is for it; on paper at that of paper.

const PAPER = [680, 430]; // px of an A4 sheet between its margins, and what a map's height may take of it
const figures = [];
let printing = false;

addEventListener("DOMContentLoaded", () => {
  const kinds = { map: MapFigure, chart: ChartFigure };
  for (const figure of document.querySelectorAll("figure.drawn")) figures.push(new kinds[figure.dataset.kind](figure));
  const fit = () => {
    if (printing) return;
    for (const figure of figures) {
      const width = Math.floor(figure.stage.clientWidth);
      if (width > 0 && width !== figure.width) figure.layout(figure.width = width);
    }
  };
  new ResizeObserver(fit).observe(document.querySelector("main"));
  fit();
  addEventListener("beforeprint", () => {
    printing = true;
    for (const figure of figures) {
      [figure.width] = PAPER;
      figure.layout(...PAPER);
      figure.drawNow();
    }
  });
  addEventListener("afterprint", () => {
    printing = false;
    fit();
  });
});
