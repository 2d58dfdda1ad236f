"""The page bound to all addresses of this machine, in a real browser: its token opens it."""

import json
import socket
import urllib.error
import urllib.request
from urllib.parse import urlsplit

import pytest

pytest.importorskip("nicegui")


def other_address():
    """An address of this machine that others know it by."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        try:
            asked.connect(("192.0.2.1", 9))  # sends nothing
            found = asked.getsockname()[0]
        except OSError:
            found = "127.0.0.1"
    if found.startswith("127."):
        pytest.skip("this machine has no address but its own")
    return found


def test_from_elsewhere_the_token_opens_page_view_and_sockets_and_nothing_else_does(
    teaching, window
):
    lesson = teaching("--host", "0.0.0.0").start()
    printed = urlsplit(lesson.printed)
    assert printed.hostname == socket.gethostname()
    assert len(printed.query) > len("token=") + 24
    elsewhere = f"http://{other_address()}:{lesson.port}/"
    for path in ("", "view/", "?token=guessed"):
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(elsewhere + path, timeout=20)
        assert refused.value.code == 403
    one = window(elsewhere + "?" + printed.query)
    assert one.page.url == elsewhere  # the token is no more in the address
    one.page.frame_locator("iframe").locator("canvas").first.wait_for()
    token = one.asked("token")
    one.press("ArrowRight")
    one.wait_for(
        "() => document.querySelector('[data-teach=question]').dataset.chosen !== undefined"
    )
    one.press("Enter")
    one.wait_for_another(token)
    assert json.loads(lesson.events("answered")[0])["seconds"] > 0
    assert not one.errors
    two = window(elsewhere, known=False)
    assert two.page.inner_text("body").strip() == "the address with the token is in the terminal"
