"""``contourslam completion``: what makes a shell complete the commands and their options."""

import contextlib
import io
from dataclasses import dataclass
from typing import Literal

import tyro


@dataclass(frozen=True)
class Completion:
    """Print the script that has a shell complete commands, options and their choices at the press of Tab.

    Keep it where the shell looks for such scripts, and open a new shell; print it anew after an update.

    bash: contourslam completion bash > ~/.local/share/bash-completion/completions/contourslam

    zsh: contourslam completion zsh > "${fpath[1]}/_contourslam"

    Example: contourslam completion bash
    """

    shell: tyro.conf.Positional[Literal["bash", "zsh"]] = "bash"
    """For which shell."""

    def execute(self, command: str) -> int:
        """Print the script."""
        print(script(self.shell), end="")
        return 0


def script(shell: str) -> str:
    """Write the script for a shell.

    Parameters
    ----------
    shell : str
        "bash" or "zsh".

    Returns
    -------
    str
    """
    from contourslam.cli.entry import COMMANDS, command_class

    written = io.StringIO()
    with contextlib.redirect_stdout(written), contextlib.suppress(SystemExit):
        tyro.extras.subcommand_cli_from_dict(
            {name: command_class(name) for name in COMMANDS},
            prog="contourslam",
            args=["--tyro-print-completion", shell],
            config=(tyro.conf.OmitArgPrefixes, tyro.conf.DisallowNone),
            sort_subcommands=False,
        )
    # Where tyro knows nothing, as of a recording's name, bash is to complete files as ever.
    return written.getvalue().replace("complete -F", "complete -o default -F")
