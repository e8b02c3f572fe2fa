"""How commands serve the page: its options, and what is said of it."""

import webbrowser
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

import tyro

from contourslam.cli.console import note
from contourslam.cli.options import Flag
from contourslam.errors import ConfigError

if TYPE_CHECKING:
    from contourslam.config import Config
    from contourslam.robot.bring_up import Robot
    from contourslam.robot.witness import MakeWitness, Witness
    from contourslam.view.lag import Lag
    from contourslam.view.show import Show

HOST, PORT = "127.0.0.1", 8642
Host = Annotated[str, tyro.conf.arg(help="Address to serve the page at; 0.0.0.0 for the whole network.")]
PagePort = Annotated[int, tyro.conf.arg(help="Port to serve the page at; 0 for any that is free.")]

Say = Callable[[str], None]


def print_link(url: str) -> None:
    """Print the link, and nothing else, on standard output, where scripts find it."""
    print(url, flush=True)


@dataclass(frozen=True)
class Page:
    """Where the page is served."""

    host: Host = HOST
    port: PagePort = PORT
    browser: Flag = False
    """Open the page in this machine's browser."""

    prefix: ClassVar[str] = "--"
    """Before the names of these options."""

    def check(self) -> None:
        """Refuse what cannot be served.

        Raises
        ------
        ContourslamError
            If the port is none, or the library that serves the page is not installed.
        """
        if not 0 <= self.port < 65536:
            raise ConfigError(f"{self.prefix}port must lie between 0 and 65535, got {self.port}")
        from contourslam.view.serving import check_servable

        check_servable()

    @contextmanager
    def served(self, show: "Show", lag: "Lag", say: Say = note) -> Iterator[None]:
        """Serve the page inside the context.

        Parameters
        ----------
        show : Show
        lag : Lag
        say : callable
            Called with the link.

        Raises
        ------
        ContourslamError
            If it cannot be served there.
        """
        from contourslam.view.access import is_loopback
        from contourslam.view.server import ServeError
        from contourslam.view.serving import page_server

        with ExitStack() as stack:
            try:
                server = stack.enter_context(page_server(show, lag, host=self.host, port=self.port))
            except ServeError as error:
                raise ServeError(
                    f"{error}; choose another {self.prefix}host, or another {self.prefix}port (0 for any that is free)"
                ) from error
            say(server.url)
            others = "" if is_loopback(self.host) else ", others need the whole link"
            note(f"open this page in a browser; Ctrl-C ends it{others}")
            if self.browser:
                webbrowser.open(server.url)
            yield

    def witness(
        self, stack: ExitStack, settings: "Config", title: str, *, driven: bool, say: Say = note
    ) -> "MakeWitness":
        """Serve the page from now on, and give what has a robot watched by it.

        Parameters
        ----------
        stack : ExitStack
            Ends the server.
        settings : Config
            Those of the mapping.
        title : str
            What the page calls the robot.
        driven : bool
            Commands go to the base all the time.
        say : callable
            Called with the link.

        Raises
        ------
        ContourslamError
            If it cannot be served there.
        """
        from contourslam.robot.health import RobotHealth
        from contourslam.robot.witness import Witness
        from contourslam.view.followed import Followed

        robots: list[RobotHealth] = []
        followed = Followed(settings, title=title, health=lambda: [row for health in robots for row in health()])
        stack.enter_context(self.served(followed.show, followed.lag, say))

        def make(robot: "Robot") -> "Witness":
            health = RobotHealth(robot, driven=driven)
            robots.append(health)
            return Witness(health.watch, followed.follow)

        return make


class _BesideOthers(Page):
    """That of a command whose own options have these names."""

    prefix = "--view-"


@dataclass(frozen=True)
class Watched:
    """Whether the work is watched, and where the page is served then."""

    view: Flag = False
    """Serve the live page meanwhile (docs/view.md)."""
    view_host: Host = HOST
    view_port: PagePort = PORT

    @property
    def page(self) -> Page | None:
        """Where it is served; None for nowhere.

        Raises
        ------
        ContourslamError
            As :meth:`Page.check`; also if it says where and not that.
        """
        if not self.view:
            if (self.view_host, self.view_port) != (HOST, PORT):
                raise ConfigError("--view-host and --view-port say where the page is served that --view asks for")
            return None
        page = _BesideOthers(self.view_host, self.view_port)
        page.check()
        return page
