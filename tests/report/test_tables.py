import csv
import io
import re
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.report.page.markup import Cell, Row, Section, page, table
from contourslam.report.page.tables import latex, to_csv, to_latex

HEADERS = ("Detector", "mean", "turn", "share", "method", "scans")
ROWS = (
    Row('Teh-Chin, "old"', [Cell("0.0161 m", "± 0.0012"), Cell("−0.44°"), Cell("12 %"), Cell("a & b"), Cell("2,157")]),
    Row("Wu", [Cell("12.5 m", better=True), Cell("0.5°"), Cell("–"), Cell("search"), Cell("90")], aside=True),
)


def read(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text)))


def shown(rows=ROWS) -> str:
    section = Section("one", "One", table("A <table>", HEADERS, rows))
    return page("Tables", lead="Of tables.", sections=[section], footer="")


def test_csv_holds_numbers_a_program_can_read_and_names_their_units_once() -> None:
    head, first, second = read(to_csv(HEADERS, ROWS))
    assert head == ["Detector", "mean (m)", "mean (m), sd", "turn (°)", "share (%)", "method", "scans"]
    assert first == ['Teh-Chin, "old"', "0.0161", "0.0012", "-0.44", "12", "a & b", "2157"]
    assert second == ["Wu", "12.5", "", "0.5", "", "search", "90"]
    assert to_csv(HEADERS, ROWS).endswith("\r\n")  # RFC 4180


def test_units_that_differ_stay_with_their_numbers() -> None:
    text = to_csv(("", "value"), [Row("way", [Cell("3 m")]), Row("time", [Cell("4 s")])])
    assert read(text) == [["", "value"], ["way", "3 m"], ["time", "4 s"]]


words = st.text(st.characters(blacklist_categories=["Cs"], blacklist_characters="\x00\r"), min_size=1)


@given(
    st.lists(st.tuples(words, st.sampled_from(["0.5", "-3", "1,234.25", "x, y", 'a "b"', "two\nlines"])), min_size=1)
)
def test_csv_comes_back_as_it_was_written(pairs) -> None:
    text = to_csv(("name", "value"), [Row(name, [Cell(value)]) for name, value in pairs])
    back = list(csv.reader(io.StringIO(text, newline="")))
    assert back == [["name", "value"], *([name, {"1,234.25": "1234.25"}.get(value, value)] for name, value in pairs)]


def body(text: str) -> list[list[str]]:
    """Cells of a LaTeX table, row by row."""
    rows = text[text.index(r"\toprule") : text.index(r"\bottomrule")].splitlines()
    return [
        [cell.strip() for cell in re.split(r"(?<!\\)&", row.strip().removesuffix(r"\\"))] for row in rows if "&" in row
    ]


def test_latex_is_a_booktabs_table_with_the_points_below_each_other() -> None:
    text = to_latex("Errors & turns", HEADERS, ROWS)
    assert r"\caption{Errors \& turns}" in text
    assert r"\begin{tabular}{lrrrlr}" in text
    assert [text.count(rule) for rule in (r"\toprule", r"\midrule", r"\bottomrule", r"\hline")] == [1, 1, 1, 0]
    head, first, second = body(text)
    assert len({len(row) for row in (head, first, second)}) == 1
    assert head[1:4] == ["mean (m)", r"turn ($^{\circ}$)", r"share (\%)"]
    assert first[1] == r"0.0161 $\pm$ 0.0012"
    assert second[1] == r"\textbf{12.5}\phantom{000} \phantom{$\pm$ 0.0012}"
    assert first[2:5] == ["$-$0.44", "12", r"a \& b"]
    assert second[3] == "--"


def test_a_minus_is_one_in_latex_and_a_number_in_csv() -> None:
    rows = [Row("down", [Cell("-0.5"), Cell("a-b")]), Row("up", [Cell("12"), Cell("–")])]
    assert body(to_latex("", ("", "x", "y"), rows))[1:] == [["down", "$-$0.5", "a-b"], ["up", r"12\phantom{.0}", "--"]]
    assert [float(row[1]) for row in read(to_csv(("", "x", "y"), rows))[1:]] == [-0.5, 12.0]


def test_braces_and_environments_of_latex_are_closed() -> None:
    nasty = "50 % & #1 $x_2^3$ {a} \\b ~ <c>\n"
    text = to_latex(nasty, (nasty, nasty), [Row(nasty, [Cell(nasty, nasty, better=True)])])
    bare = re.sub(r"\\[{}&%$#_]", "", text)
    assert bare.count("{") == bare.count("}")
    assert bare.count("$") % 2 == 0
    assert re.findall(r"\\begin\{(\w+)\}", text) == re.findall(r"\\end\{(\w+)\}", text)[::-1]
    assert len(body(text)) == 2
    assert latex("a_b") == r"a\_b"


class _Buttons(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs) -> None:
        if tag == "button":
            self.texts.append(dict(attrs)["data-text"])


def test_the_page_holds_both_forms_behind_buttons_that_no_script_would_leave_hidden() -> None:
    text = shown()
    assert _Buttons(text).texts == [to_csv(HEADERS, ROWS), to_latex("A <table>", HEADERS, ROWS)]
    assert '<p class="copy" hidden>' in text


@pytest.mark.parametrize("clipboard", ["granted", "refused"])
def test_a_table_is_copied_from_a_file_with_mouse_or_keyboard(browser, tmp_path, clipboard) -> None:
    (tmp_path / "index.html").write_text(shown())
    context = browser.new_context()
    tab = context.new_page()
    errors: list[str] = []
    tab.on("pageerror", lambda error: errors.append(str(error)))
    if clipboard == "granted":
        context.grant_permissions(["clipboard-read", "clipboard-write"])
    else:
        tab.add_init_script("navigator.clipboard.writeText = () => Promise.reject(new Error('no'));")
        # What the older way copies is told by the event, for no one may read the clipboard here.
        tab.add_init_script("addEventListener('copy', () => { window.copied = getSelection().toString(); });")
    tab.goto((tmp_path / "index.html").as_uri())
    read_back = "navigator.clipboard.readText()" if clipboard == "granted" else "window.copied"
    tab.get_by_role("button", name="Copy as CSV").click()
    tab.get_by_text("copied", exact=True).wait_for()
    assert read(tab.evaluate(read_back)) == read(to_csv(HEADERS, ROWS))
    tab.keyboard.press("Tab")
    assert tab.evaluate("document.activeElement.textContent") == "Copy as LaTeX"
    tab.keyboard.press("Enter")
    tab.wait_for_function(f"async () => (await {read_back}).startsWith('% ')")
    assert tab.evaluate(read_back).split() == to_latex("A <table>", HEADERS, ROWS).split()
    tab.emulate_media(media="print")
    assert not tab.get_by_role("button", name="Copy as CSV").is_visible()
    assert errors == []
    context.close()
