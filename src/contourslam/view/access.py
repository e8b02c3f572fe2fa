"""Who may see the page: this machine by default, and from others only those who were given the link."""

import hmac
import ipaddress
import secrets
from dataclasses import dataclass
from urllib.parse import urlsplit


def is_loopback(host: str) -> bool:
    """Whether what listens there can be reached from this machine alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def new_token() -> str:
    """Give a token that nobody guesses."""
    return secrets.token_urlsafe(16)


@dataclass(frozen=True, slots=True)
class Access:
    """What is asked of each request.

    A page of another site that a browser on this machine has open can send requests to a loopback address too, and can
    give its own name that address (DNS rebinding). Its requests carry that name as ``Host``, and its own as ``Origin``.

    Attributes
    ----------
    loopback : bool
        Only this machine can reach the server: then the names of this machine are the only ones that are answered.
    token : str
        First part of every path; empty for none.
    """

    loopback: bool
    token: str = ""

    def path(self, target: str) -> str | None:
        """Give the path that a request wants below the token; None where the token is wrong."""
        path = urlsplit(target).path
        if not self.token:
            return path
        first, _, rest = path.removeprefix("/").partition("/")
        if not hmac.compare_digest(first.encode(), self.token.encode()):
            return None
        return "/" + rest

    def knows(self, host: str | None) -> bool:
        """Whether a request came under a name that is this server's; with a token, any is."""
        if host is None:
            return False
        return not self.loopback or any(is_loopback(name.strip("[]")) for name in (host.rpartition(":")[0], host))

    def same_origin(self, origin: str | None, host: str | None) -> bool:
        """Whether a websocket is asked for by the page itself; what is no browser sends no origin."""
        return origin is None or (host is not None and urlsplit(origin).netloc == host)
