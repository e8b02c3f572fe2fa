"""What all pages share: style, scripts, and the policy by which the browser loads nothing else."""

import base64
import hashlib
from collections.abc import Sequence
from importlib.resources import files

SCRIPTS = ("theme.js", "folds.js", "tables.js")
"""What runs on every page, files beside this one."""
STYLES = ("style.css", "drawn.css")


def shell(more: Sequence[str] = ()) -> dict[str, str]:
    """Give style, script and policy for the template.

    Parameters
    ----------
    more : sequence of str
        Scripts of this page alone, files beside this one, in the order in which they run.

    Returns
    -------
    dict of str to str
        "style", "script" and "policy": the last lets nothing run but these two, and nothing load but pictures.
    """
    style = "\n".join(map(_read, STYLES))
    script = "\n".join(_read(name) for name in (*SCRIPTS, *more))
    policy = (
        f"default-src 'none'; style-src {_hash(style)}; script-src {_hash(script)}; "
        "img-src 'self' file: data: blob:; base-uri 'none'; form-action 'none'"
    )
    return {"style": style, "script": script, "policy": policy}


def _read(name: str) -> str:
    return files("contourslam.report.page").joinpath(name).read_text(encoding="utf-8").strip()


def _hash(text: str) -> str:
    """Source expression of what stands, with a line of its own, between the template's tags."""
    digest = hashlib.sha256(f"\n{text}\n".encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
