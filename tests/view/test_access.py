import pytest

from contourslam.view.access import Access, is_loopback, new_token


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.9.1", "::1", "localhost"])
def test_what_only_this_machine_reaches_is_known(host: str) -> None:
    assert is_loopback(host)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.7", "robot.local", "localhost.evil.example"])
def test_what_others_reach_is_known_too(host: str) -> None:
    assert not is_loopback(host)


def test_on_loopback_a_foreign_name_is_refused_so_that_rebinding_fails() -> None:
    access = Access(loopback=True)
    known = ("127.0.0.1:8642", "127.0.0.2:8642", "localhost:1", "[::1]:8642", "localhost")
    assert all(access.knows(host) for host in known)
    others = ("evil.example:8642", "127.0.0.1.evil.example:80", "evil.example", "192.168.1.7:8642", "localhost:1:2")
    for host in (*others, "", None):
        assert not access.knows(host)


def test_a_websocket_is_for_the_page_itself() -> None:
    access = Access(loopback=True)
    assert access.same_origin("http://127.0.0.1:8642", "127.0.0.1:8642")
    assert access.same_origin(None, "127.0.0.1:8642")  # no browser
    for origin in ("http://evil.example", "http://127.0.0.1:9", "null", "http://evil.example#127.0.0.1:8642"):
        assert not access.same_origin(origin, "127.0.0.1:8642")


def test_without_the_token_there_is_nothing() -> None:
    token = new_token()
    access = Access(loopback=False, token=token)
    assert access.path(f"/{token}/main.js") == "/main.js"
    assert access.path(f"/{token}/ws?x=1") == "/ws"
    for target in ("/", "/main.js", "/ws", f"/{token[:-1]}/ws", f"/x{token}/ws", f"/ws?{token}", "/é/ws"):
        assert access.path(target) is None
    assert token != new_token()
    assert len(token) >= 20
