// Copy a table as CSV or LaTeX. Both were written with the page; without scripts the buttons stay hidden.
addEventListener("DOMContentLoaded", () => {
  const byHand = text => { // where a browser keeps the clipboard from files, or from pages that are not secure
    const area = Object.assign(document.createElement("textarea"), { value: text });
    Object.assign(area.style, { position: "fixed", opacity: "0" });
    document.body.append(area);
    area.select();
    try { return document.execCommand("copy"); } catch { return false; } finally { area.remove(); }
  };
  const copy = async text => {
    try { await navigator.clipboard.writeText(text); return true; } catch { return byHand(text); }
  };
  for (const row of document.querySelectorAll(".copy")) {
    const said = row.querySelector("[role=status]");
    let timer = 0;
    row.hidden = false;
    row.addEventListener("click", async event => {
      const button = event.target.closest("button");
      if (!button) return;
      const done = await copy(button.dataset.text);
      button.focus();
      said.textContent = done ? "copied" : "this browser lets no page copy";
      clearTimeout(timer);
      timer = setTimeout(() => { said.textContent = ""; }, 3000);
    });
  }
});
