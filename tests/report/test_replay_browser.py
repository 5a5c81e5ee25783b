"""The replay in a browser, without a GPU."""

from __future__ import annotations

import io

import numpy as np
import pytest

from pytest_safemanip.report.replay import pack, page
from pytest_safemanip.sim.looks import Look
from tests import toy
from tests.report.conftest import finding, verdict
from tests.report.test_replay import HOSTILE, hostile

Image = pytest.importorskip("PIL.Image", reason="Pillow reads the pictures")
MOUNTED_AGAIN = """
    replay.dispose();
    window.told = [];
    const data = JSON.parse(document.getElementById("replay-data").textContent);
    const element = document.getElementById("replay");
    const onStep = step => { told.push(step); replay.seek(step); };  // as a timeline does
    window.replay = SafemanipReplay.mount(element, data, {onStep});
"""


@pytest.fixture(scope="module")
def violated(rollouts, tmp_path_factory):
    """The page of a rollout that violates a rule, and what it was given."""
    found = rollouts.get("PickPlaceCounterToCabinet", "scripted:half_inside")
    data = pack(found.recording, {"enclosure_release": found.verdict("enclosure_release")})
    path = tmp_path_factory.mktemp("replay") / "replay.html"
    path.write_text(page(data), encoding="utf-8")
    return path, data


@pytest.fixture
def opened(browser, violated):
    """The page in a tab, with what it complains about."""
    tab = browser.new_page(viewport={"width": 640, "height": 480})
    said, asked = [], []
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(violated[0].as_uri())
    assert tab.evaluate("replay.webgl")
    yield tab
    assert said == []
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []
    tab.close()


def picture(tab):
    """What is shown (h, w, 3), once it is drawn."""
    tab.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    return np.asarray(Image.open(io.BytesIO(tab.locator(".smr-stage").screenshot())).convert("RGB"))


def shown(tab):
    return tab.locator(".smr-clock").inner_text()


def test_it_draws_the_violation_and_seeking_changes_the_picture(opened, violated):
    first = violated[1]["findings"][0]["first"]
    assert shown(opened).startswith(f"step {first} of ")
    assert "VIOLATED enclosure_release" in opened.locator(".smr-message").inner_text()
    labels = opened.locator(".smr-label").all_inner_texts()
    assert labels[0] == "obj (onion)"
    before = picture(opened)
    assert len(np.unique(before.reshape(-1, 3), axis=0)) > 200
    # Vermilion: the guilty object, wherever its shading makes it darker.
    red, green, blue = (before[..., i].astype(int) for i in range(3))
    assert np.count_nonzero((red > 1.5 * green) & (red > 1.5 * blue) & (red > 60)) > 200
    opened.evaluate("replay.seek(60)")
    assert shown(opened).startswith("step 60 of ")
    changed = (picture(opened) != before).any(axis=-1)
    assert changed.mean() > 0.02


def test_what_is_highlighted_is_what_was_asked_for(opened):
    guilty = picture(opened)
    opened.evaluate("replay.highlight(['distr_counter', 'no such thing'])")
    assert opened.locator(".smr-label").all_inner_texts() == ["distr_counter (banana)"]
    assert (picture(opened) != guilty).any()
    opened.evaluate("replay.highlight(null)")
    assert opened.locator(".smr-label").count() == 2


def test_it_plays_is_moved_by_keys_and_tells_the_step(opened, violated):
    opened.evaluate(MOUNTED_AGAIN)
    opened.evaluate("replay.seek(10)")
    opened.get_by_role("button", name="play").click()
    opened.wait_for_timeout(400)
    opened.get_by_role("button", name="pause").click()
    told = opened.evaluate("told")
    assert told[-1] > 12
    assert told == sorted(set(told))
    opened.locator("canvas").press("Home")
    opened.locator("canvas").press("ArrowRight")
    assert opened.evaluate("told.at(-1)") == 1
    opened.get_by_role("button", name="Violation").click()
    assert opened.evaluate("told.at(-1)") == violated[1]["findings"][0]["first"]


def test_the_mouse_turns_it_and_reset_turns_it_back(opened):
    before = picture(opened)
    opened.mouse.move(300, 200)
    opened.mouse.down()
    opened.mouse.move(400, 220, steps=4)
    opened.mouse.up()
    turned = (picture(opened) != before).any(axis=-1)
    assert turned.mean() > 0.2
    opened.get_by_role("button", name="Reset view").click()
    assert not (picture(opened) != before).any(axis=-1).mean() > 0.01


def test_it_is_as_large_as_its_element_and_as_dark_as_the_page(opened):
    opened.set_viewport_size({"width": 390, "height": 700})
    light = picture(opened)
    box = opened.locator("canvas").bounding_box()
    assert box["width"] == 390
    assert opened.evaluate("document.documentElement.scrollWidth") == 390
    opened.emulate_media(color_scheme="dark")
    assert picture(opened).mean() < light.mean() - 60


def test_a_page_that_has_its_own_controls_leaves_these_out(opened):
    opened.evaluate(MOUNTED_AGAIN.replace("{onStep}", "{onStep, controls: false}"))
    assert opened.evaluate("replay.webgl")
    assert not opened.locator(".smr-bar").is_visible()
    assert not opened.locator(".smr-message").is_visible()
    assert opened.locator(".smr-label").first.is_visible()


def test_it_leaves_nothing_behind(opened):
    opened.evaluate("replay.dispose()")
    assert opened.locator("#replay").inner_html() == ""


def test_meshes_are_drawn(browser, tmp_path):
    recording = toy.recording()
    corners = np.array([(0.0, -1.0, -1.0), (0.0, 1.0, -1.0), (0.0, 0.0, 2.0)])
    poses = np.tile((0.5, -0.5, 1.2, *toy.UPRIGHT), (len(recording.steps), 1))
    sheet = Look("apple", (0.0, 1.0, 0.0), corners, np.array([(0, 1, 2)]), poses)
    path = tmp_path / "replay.html"
    path.write_text(page(pack(recording, {}, [sheet])), encoding="utf-8")
    tab = browser.new_page(viewport={"width": 640, "height": 480})
    tab.goto(path.as_uri())
    red, green, blue = (picture(tab)[..., i].astype(int) for i in range(3))
    assert ((green > red + 10) & (green > blue + 10)).mean() > 0.1
    tab.close()


def test_hostile_names_are_shown_as_text(browser, tmp_path):
    path = tmp_path / "replay.html"
    about = finding(entities=("mug",), evidence=(HOSTILE,))
    path.write_text(page(pack(hostile(), {HOSTILE: verdict("VIOLATED", about)})), encoding="utf-8")
    tab = browser.new_page()
    said: list[str] = []
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.on("dialog", lambda dialog: said.append(dialog.message))
    tab.goto(path.as_uri())
    assert "<img src=x onerror=alert(1)>" in tab.locator(".smr-message").inner_text()
    assert "<img src=x" in tab.locator(".smr-label").inner_text()
    assert "<img src=x" in tab.locator(".smr-readout").inner_text()
    assert tab.locator("img").count() == 0
    assert said == []
    tab.close()


def test_without_webgl_it_says_so(browser, violated):
    tab = browser.new_page()
    tab.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    tab.goto(violated[0].as_uri())
    assert "WebGL is missing" in tab.locator("#replay").inner_text()
    tab.close()
