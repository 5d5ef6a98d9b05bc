"""Who may have the page: this machine's browsers, and its own page only may listen."""

import re
from http import HTTPStatus

import pytest
from websockets.datastructures import Headers
from websockets.http11 import Request

from sim.live.pages import FEED, PAGE, answer, is_loopback


def ask(path, bound="127.0.0.1", **headers):
    named = {name.capitalize(): value for name, value in headers.items()}
    return answer(Request(path, Headers({"Host": "localhost:8080", **named})), bound)


def test_every_file_is_there_and_needs_nobody_else():
    page = ask("/")
    assert page.status_code == HTTPStatus.OK
    assert "script-src 'self'" in page.headers["Content-Security-Policy"]
    texts = {file.name: file.read_text(encoding="utf-8") for file in PAGE.iterdir()}
    for name, text in texts.items():
        assert ask(f"/{name}").body == text.encode()
        # nothing comes from elsewhere, and whatever is imported exists
        assert set(re.findall(r"https?://\S+?(?=[\"'\s])", text)) <= {"http://www.w3.org/2000/svg"}
        for imported in re.findall(r'from "\./(\S+)"', text):
            assert imported in texts
    for named in re.findall(r'(?:src|href)="(\S+)"', texts["index.html"]):
        assert named in texts


@pytest.mark.parametrize("path", ["/other", "/../server.py", "/page/../story.py", "/style.css/"])
def test_there_is_nothing_else(path):
    assert ask(path).status_code == HTTPStatus.NOT_FOUND


def test_only_its_own_page_may_listen():
    assert ask(FEED, origin="http://localhost:8080") is None
    assert ask(FEED) is None  # no browser
    assert ask(FEED, origin="http://elsewhere.example").status_code == HTTPStatus.FORBIDDEN
    assert ask(FEED, origin="http://localhost:9090").status_code == HTTPStatus.FORBIDDEN


def test_other_names_for_this_machine_are_refused_unless_it_was_opened_to_others():
    assert ask("/", host="rebound.example:8080").status_code == HTTPStatus.FORBIDDEN
    assert ask("/", bound="0.0.0.0", host="camera-hall:8080").status_code == HTTPStatus.OK


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "127.8.8.8"])
def test_this_machine_only(host):
    assert is_loopback(host)


@pytest.mark.parametrize("host", ["0.0.0.0", "10.0.0.1", "::", "camera-hall", ""])
def test_not_this_machine_only(host):
    assert not is_loopback(host)
