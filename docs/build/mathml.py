"""Equations become MathML while the site is built, so that no page needs a script or a font from elsewhere."""

import html
import re

from latex2mathml.converter import convert

_EQUATION = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\(?P<open>[(\[])(?P<tex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)


def with_mathml(page: str) -> str:
    """Put MathML in the place of the equations that arithmatex has marked in a page's HTML."""

    def write(equation: re.Match[str]) -> str:
        tex = html.unescape(equation["tex"]).strip()
        display = "inline" if equation["open"] == "(" else "block"
        mathml = convert(tex, display=display)
        tag = equation["tag"]
        return f'<{tag} class="equation" title="{html.escape(tex, quote=True)}">{mathml}</{tag}>'

    return _EQUATION.sub(write, page)
