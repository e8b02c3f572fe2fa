// Dark or light: the system's, until the reader chooses otherwise.
(() => {
  const root = document.documentElement, dark = matchMedia("(prefers-color-scheme: dark)"), KEY = "contourslam-theme";
  let chosen = null;
  try { chosen = localStorage.getItem(KEY); } catch { /* a browser that keeps nothing for files */ }
  const theme = () => chosen ?? (dark.matches ? "dark" : "light");
  const show = () => { if (chosen) root.dataset.theme = chosen; else delete root.dataset.theme; };
  show();
  addEventListener("DOMContentLoaded", () => {
    const button = Object.assign(document.createElement("button"), { type: "button", className: "theme" });
    const name = () => { button.textContent = theme() === "dark" ? "Light" : "Dark"; };
    button.title = "Show this page dark or light; prints are always light";
    button.addEventListener("click", () => {
      const other = theme() === "dark" ? "light" : "dark";
      chosen = other === (dark.matches ? "dark" : "light") ? null : other;
      try {
        if (chosen) localStorage.setItem(KEY, chosen); else localStorage.removeItem(KEY);
      } catch { /* then it lasts as long as the page */ }
      show();
      name();
    });
    dark.addEventListener("change", name);
    name();
    document.querySelector("header").prepend(button);
  });
})();
