"""The studio in a real browser: a machine is drawn, sliders and map move it, numbers agree, nothing is fetched."""

import io
import re
from html import unescape
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import httpx
import numpy as np
import pytest
from browser import browser, needs_chromium, served
from matplotlib import image

from kinetostat.machine.loading import load
from kinetostat.studies.analysis import analyze
from kinetostat.studio.panels.tables import matrix_table

pytestmark = needs_chromium
MACHINE = "zhang-gosselin-4dof"


@pytest.fixture(scope="module")
def address():
    with served(MACHINE) as found:
        yield found


@pytest.fixture(scope="module")
def new_tab():
    with browser() as opening:
        yield opening


@pytest.fixture(scope="module")
def page(address, new_tab):
    watched = new_tab()
    watched.open(address)
    yield watched
    watched.blameless(address)


def coloured(page):
    """How many points of the picture are blue as actuated legs are, and orange as the passive one."""
    picture = image.imread(io.BytesIO(page.tab.locator(".machine-view canvas").screenshot()))
    red, green, blue = (picture[:, :, channel] for channel in range(3))
    return int(((blue > 0.45) & (red < 0.35)).sum()), int(((red > 0.6) & (blue < 0.35) & (green < 0.65)).sum())


def test_the_machine_is_there_to_be_seen(page):
    blue, orange = coloured(page)
    assert blue > 1500
    assert orange > 800
    assert page.text(".pose-status") == "ok"


def test_the_platform_is_pulled_by_its_handle_and_one_undo_takes_it_back(page):
    values, tab = page.tab.locator(".quantity-text"), page.tab
    before = values.nth(0).input_value()
    x, y = tab.evaluate("document.querySelector('.machine-view').handleAt('platform x')")
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x + 12, y, steps=3)
    tab.mouse.move(x + 24, y, steps=3)
    tab.wait_for_function("before => document.querySelector('.quantity-text').value !== before", arg=before)
    tab.mouse.up()
    tab.wait_for_function("parseFloat(document.querySelector('.quantity-text').value) > 1")
    tab.get_by_role("button", name="Undo (Ctrl+Z)").click()
    tab.wait_for_function("before => document.querySelector('.quantity-text').value === before", arg=before)


def test_a_contribution_under_the_pointer_lights_its_leg(page):
    row = page.tab.locator("li[data-leg]").first
    row.hover()
    page.tab.wait_for_function(
        "leg => document.querySelector('.machine-view').dataset.linked === leg", arg=row.get_attribute("data-leg")
    )
    assert "linked" in row.get_attribute("class")


def test_the_view_is_saved_as_a_picture(page):
    with page.tab.expect_download() as download:
        page.tab.get_by_role("button", name="Save the picture as PNG").click()
    assert download.value.suggested_filename == "zhang---gosselin-4-dof.png"
    picture = image.imread(download.value.path())
    view = page.tab.locator(".machine-view").bounding_box()
    assert picture.shape[1] == pytest.approx(2 * view["width"], abs=2)
    assert np.ptp(picture[:, :, 0]) > 0.5


def test_a_finger_scrolls_the_page_over_the_picture(page):
    canvas = page.tab.locator(".machine-view canvas").first
    assert canvas.evaluate("canvas => getComputedStyle(canvas).touchAction") == "pan-y"


def test_a_path_through_kept_poses_is_played(page):
    tab, field = page.tab, page.tab.locator(".quantity-text").first
    tab.get_by_role("button", name="Follow a path of poses").click()
    tab.get_by_role("button", name="Keep this pose").click()
    before, headline = field.input_value(), page.text(".headline")
    field.fill("9 mm")
    field.press("Enter")
    page.until_changed(".headline", headline)
    tab.get_by_role("button", name="Keep this pose").click()
    tab.get_by_text("A path of 25 poses").wait_for()
    tab.get_by_role("button", name="Play or pause").click()
    tab.wait_for_function("parseFloat(document.querySelector('.quantity-text').value) < 9")
    tab.wait_for_function("document.querySelector('.quantity-text').value === '9 mm'")
    tab.get_by_role("button", name="Forget the path").click()
    tab.get_by_role("button", name="Close").click()
    field.fill(before)
    field.press("Enter")
    tab.wait_for_function("before => document.querySelector('.headline').innerText === before", arg=headline)


def test_a_slider_moves_the_machine_by_the_keyboard(page):
    before, drawn = page.text(".headline"), page.tab.locator(".machine-view").get_attribute("data-drawn")
    slider = page.tab.get_by_role("slider", name="z", exact=True)
    slider.focus()
    for _ in range(40):
        page.tab.keyboard.press("ArrowRight")
    page.until_changed(".headline", before)
    page.tab.wait_for_function(
        "before => Number(document.querySelector('.machine-view').dataset.drawn) > before", arg=int(drawn)
    )
    page.tab.wait_for_function("document.querySelectorAll('.quantity-text')[1].value !== '680 mm'")
    assert "poses in" in page.text(".server-time")


def test_a_click_on_the_map_moves_the_machine(page):
    values = page.tab.locator(".quantity-text")
    before = values.nth(0).input_value()
    box = page.tab.locator(".map-card .plot canvas").bounding_box()
    page.tab.mouse.click(box["x"] + 0.3 * box["width"], box["y"] + 0.4 * box["height"])
    page.tab.wait_for_function("before => document.querySelector('.quantity-text').value !== before", arg=before)
    assert float(values.nth(0).input_value().removesuffix(" mm")) < 0.0
    assert page.text(".pose-status") == "ok"


def test_the_numbers_are_those_of_analyze(page):
    for place, text in ((0, "12 mm"), (1, "70 cm")):
        box = page.tab.locator(".quantity-text").nth(place)
        before = page.text(".headline")
        box.fill(text)
        box.press("Enter")
        page.until_changed(".headline", before)
    page.tab.get_by_role("tab", name="Matrices").click()
    analysis = analyze(load(MACHINE, ["pose.x=12 mm", "pose.z=70 cm"]))
    expected = [unescape(cell) for cell in re.findall("<td>(.*?)</td>", matrix_table(analysis, "C"))]
    page.tab.wait_for_function(
        "wanted => document.querySelector('.figures.matrix')?.innerText.includes(wanted)", arg=expected[21]
    )
    cells = [cell.strip() for row in page.text(".figures.matrix tbody").splitlines() for cell in row.split("\t")[1:]]
    assert cells == expected


def test_an_impossible_pose_keeps_the_picture(page):
    box = page.tab.locator(".quantity-text").nth(1)
    box.fill("2 m")
    box.press("Enter")
    page.until_changed(".pose-status", "ok")
    assert page.text(".pose-status") == "out of reach"
    assert "at most 1360 mm" in page.text(".pose-message")
    assert coloured(page)[0] > 1000
    page.tab.keyboard.press("Escape")
    page.tab.get_by_role("button", name="Undo (Ctrl+Z)").click()
    page.until_changed(".pose-status", "out of reach")


def test_light_and_dark(page):
    page.tab.get_by_role("button", name="Light or dark").click()
    page.tab.wait_for_function("document.body.classList.contains('body--dark')")
    ground = page.tab.evaluate("getComputedStyle(document.body).backgroundColor")
    assert sum(int(part) for part in ground.removeprefix("rgb(").removesuffix(")").split(",")) < 120


def test_a_machine_chosen_from_the_list_is_drawn(page):
    page.choose("machine", "hexapod")
    page.tab.wait_for_function("document.querySelectorAll('.quantity-name').length > 4")
    page.tab.wait_for_function("document.title.startsWith('6-UPS hexapod')")
    assert page.text(".pose-status") == "ok"


def test_a_pose_out_of_reach_leg_by_leg_says_first_that_the_nearest_is_looked_for(page):
    page.choose("machine", "tripteron")
    page.tab.wait_for_function("document.title.startsWith('Tripteron')")
    page.tab.evaluate("""() => {
        const line = document.querySelector('.pose-message');
        window.messages = [];
        const note = () => window.messages.push(line.innerText);
        new MutationObserver(note).observe(line, { childList: true, characterData: true, subtree: true });
    }""")
    box = page.tab.locator(".quantity-text").nth(0)
    box.fill("3 m")
    box.press("Enter")
    page.tab.wait_for_function("window.messages.at(-1)?.includes('the nearest admissible pose is x')")
    messages = page.tab.evaluate("window.messages")
    assert any("is being looked for" in message for message in messages[:-1])
    page.tab.keyboard.press("Escape")
    page.tab.get_by_role("button", name="Undo (Ctrl+Z)").click()
    page.until_changed(".pose-status", "out of reach")


def test_under_another_name_there_is_no_page(address):
    """A site whose name is made to point to this computer gets nothing from it."""
    assert httpx.get(address).status_code == 200
    assert httpx.get(address, headers={"Host": "evil.example"}).status_code == 400


FOREIGN = """<!doctype html><title>foreign</title><iframe src="{studio}"></iframe><script>
  const socket = new WebSocket("{socket}_nicegui_ws/socket.io/?EIO=4&transport=websocket");
  const said = (text) => {{ document.title += " " + text; }};
  socket.onopen = () => said("socket-open");
  socket.onerror = () => said("socket-refused");
  fetch("{studio}", {{mode: "no-cors"}}).then(() => said("page-read"), () => said("page-refused"));
  document.querySelector("iframe").onload = () => said("frame-ended");
</script>"""


class Elsewhere(BaseHTTPRequestHandler):
    """A page of another site."""

    page = b""

    def do_GET(self):
        self.send_response(200)
        self.send_header("content-type", "text/html")
        self.end_headers()
        self.wfile.write(self.page)

    def log_message(self, *_):
        pass


def test_a_foreign_page_gets_no_socket_no_frame_and_no_answer(address, new_tab):
    """Of another site by its name, and of another port of this computer."""
    Elsewhere.page = FOREIGN.format(studio=address, socket=address.replace("http", "ws")).encode()
    with ThreadingHTTPServer(("127.0.0.1", 0), Elsewhere) as other:
        Thread(target=other.serve_forever, daemon=True).start()
        for name in ("localhost", "127.0.0.1"):
            tab = new_tab().tab
            tab.goto(f"http://{name}:{other.server_port}/")
            tab.wait_for_function("['socket', 'page', 'frame'].every((word) => document.title.includes(word))")
            assert {word for word in tab.title().split() if "-" in word} == {
                "socket-refused", "page-refused", "frame-ended",
            }  # fmt: skip
            assert "kinetostat" not in tab.frames[1].content()
            tab.goto("about:blank")
        # The same page may lead to the studio by a link.
        tab.set_content(f'<a href="{address}">studio</a>')
        tab.click("a")
        tab.wait_for_function("document.querySelector('.machine-view')?.dataset.solids > 10")
        other.shutdown()
