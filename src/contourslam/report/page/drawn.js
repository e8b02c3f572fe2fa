// Every drawing of the page comes alive, at the width there is for it; on paper at that of paper.

addEventListener("DOMContentLoaded", () => {
  const PAPER = 680; // px of an A4 sheet between its margins
  const kinds = { map: MapFigure, chart: ChartFigure };
  const figures = [...document.querySelectorAll("figure.drawn")].map((figure) => new kinds[figure.dataset.kind](figure));
  const fit = () => {
    for (const figure of figures) {
      const width = Math.floor(figure.stage.clientWidth);
      if (width > 0 && width !== figure.width) figure.layout(figure.width = width);
    }
  };
  new ResizeObserver(fit).observe(document.querySelector("main"));
  fit();
  addEventListener("beforeprint", () => {
    moment.set(null, null);
    for (const figure of figures) {
      figure.choose?.(null, true);
      figure.layout(figure.width = PAPER);
      figure.drawNow();
    }
  });
  addEventListener("afterprint", fit);
});
