"""The page in a browser: it works, and does nothing else."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from playwright.sync_api import TimeoutError, expect

from pytest_safemanip.report.page import writing
from pytest_safemanip.trace import files
from pytest_safemanip.trace.recording import Recording
from pytest_safemanip.trace.scene import Scene
from tests.report.page.conftest import TASK

FAULT, DROPPED = "scripted:half_inside", "scripted:drop_high"
MARKUP = "</script><img src=x onerror=alert(1)>'\"]]>&amp;"
"""As a name in a recording, which has to be printable."""
HOSTILE = "</script><img src=x onerror=alert(1)>'\"]]>\u202egnp\x1b[31m\n&amp;"
KEY = f"{TASK}/0/{FAULT}"


class Tab:
    """A page that is looked at; whatever it complains about, or asks for, is an error."""

    def __init__(self, browser, path, size=(1280, 900), **context):
        self.path = path
        width, height = size
        self.context = browser.new_context(viewport={"width": width, "height": height}, **context)
        self.page = self.context.new_page()
        self.page.set_default_timeout(5000)
        self.complaints, self.requests = [], []
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("console", self._said)
        self.page.on("dialog", lambda dialog: self.complaints.append(dialog.message))
        self.page.on("request", lambda request: self.requests.append(request.url))

    def _said(self, message):
        # What a slow driver says about itself is no fault of the page.
        if message.type in ("error", "warning") and "GL Driver Message" not in message.text:
            self.complaints.append(message.text)

    def open(self, hash_=""):
        self.page.goto("about:blank")
        self.page.goto(f"{self.path.as_uri()}{hash_}")
        try:
            self.page.wait_for_selector(".home, .rollout")
        except TimeoutError as error:
            raise AssertionError(self.complaints) from error
        return self

    def rows(self):
        return self.page.locator("#rollouts tbody tr .col-policy").all_inner_texts()

    def where(self):
        return int(re.match(r"step (\d+)", self.page.inner_text("#where"))[1])

    def values(self):
        """What stands beside each lane, by its label."""
        labels = self.page.locator(".track .label").all()
        return {
            own.locator(".text").inner_text(): own.locator(".value").inner_text() for own in labels
        }

    def cursor(self):
        return self.page.locator(".cursor").bounding_box()["x"]


@pytest.fixture
def tab(browser, page_file):
    opened = Tab(browser, page_file)
    yield opened
    opened.context.close()
    assert opened.complaints == []
    assert {url.split("#")[0] for url in opened.requests} <= {page_file.as_uri(), "about:blank"}


def test_rollouts_are_filtered_searched_and_sorted_and_the_address_remembers(tab):
    page = tab.open().page
    assert set(tab.rows()) == {"scripted", FAULT, DROPPED}
    page.select_option("#filter-outcome", "success_but_unsafe")
    assert tab.rows() == [FAULT]
    assert tab.page.url.endswith("#outcome=success_but_unsafe")
    page.click("#clear")
    page.fill("#search", "drop_high cabinet")
    assert tab.rows() == [DROPPED]
    page.fill("#search", "enclosure_release")
    assert tab.rows() == [FAULT]
    page.fill("#search", "")
    page.select_option("#filter-verdict", "violated")
    assert set(tab.rows()) == {FAULT, DROPPED}
    page.select_option("#filter-verdict", "unresolved")
    assert tab.rows() == []
    page.click("#clear")
    page.click("[data-sort=policy]")
    assert tab.rows() == sorted(tab.rows())
    page.click("[data-sort=policy]")
    assert tab.rows() == sorted(tab.rows(), reverse=True)
    assert page.get_attribute("th.col-policy", "aria-sort") == "descending"
    page.reload()
    assert tab.rows() == sorted(tab.rows(), reverse=True)


def test_a_cell_of_the_overview_leads_to_its_rollouts(tab):
    page = tab.open().page
    page.locator(".matrix td", has_text="1 of 1").first.locator("button").click()
    assert tab.rows() == [page.input_value("#filter-policy")]
    assert page.input_value("#filter-category") != ""


def test_what_was_never_triggered_is_not_called_safe(tab):
    page = tab.open("#by=properties").page
    row = page.locator(".matrix tbody tr", has_text="enclosure release")
    never = dict(
        zip(page.locator(".matrix thead th").all_inner_texts()[1:], range(9), strict=False)
    )
    cell = row.locator("td").nth(never[DROPPED])
    assert cell.inner_text() == "never"
    assert cell.locator("button").count() == 0
    safe = page.locator(".matrix td", has_text="0 of 1").first
    assert safe.locator("button").count() == 0  # it would lead to no rollout


def test_what_is_shown_of_the_violations_is_in_the_address(tab):
    page = tab.open().page
    page.select_option("#show-share", "triggered_rate")
    page.wait_for_url("**share=triggered_rate*")
    page.reload()
    assert page.input_value("#show-share") == "triggered_rate"
    assert page.locator(".matrix .cell.neutral").count()  # to be tested is no alarm


def test_it_begins_with_what_the_run_came_to(tab):
    page = tab.open().page
    assert page.inner_text("#banner").startswith("OPEN 3 of 18 gates inconclusive, 15 underpowered")
    assert "2 of 3 rollouts violated" in page.inner_text("#banner")
    assert "%" not in page.inner_text(".tiles")  # three policies have no rate in common


def test_one_rollout_makes_no_rate(tab):
    page = tab.open().page
    row = page.locator(".policies tbody tr", has_text=DROPPED)
    assert row.locator("td[data-label=violation]").inner_text() == "1 of 1"
    assert row.locator("td[data-label=exposure]").inner_text().startswith("0.2 %")


def test_an_unknown_rollout_is_said(tab):
    page = tab.open("#rollout=nosuch").page
    assert "no rollout nosuch" in page.inner_text("#unknown")
    page.click(".brand")
    expect(page.locator("#unknown")).to_be_hidden()


def test_steps_are_those_of_the_table_with_the_settling_apart(tab, run_folder):
    page = tab.open(f"#rollout={KEY}").page
    page.wait_for_selector(".timeline")
    acting = run_folder.rollout(FAULT)["acting_steps"]
    told = page.inner_text(".summary")
    assert f"{acting} steps" in told
    assert "to settle" in told


def test_a_search_without_a_hit_says_so(tab):
    page = tab.open("#q=nosuchword").page
    assert page.inner_text("#rollouts tbody").strip() == "No rollout matches."


def test_paper_is_light(browser, page_file):
    tab = Tab(browser, page_file, color_scheme="dark")
    page = tab.open().page
    page.emulate_media(media="print", color_scheme="dark")
    page.wait_for_selector("html[data-theme=light]")
    tab.context.close()


def test_scene_and_lanes_are_seen_together(browser, page_file):
    tab = Tab(browser, page_file)
    page = tab.open(f"#rollout={KEY}").page
    page.wait_for_selector("#replay canvas")
    scene = page.locator("#replay").bounding_box()
    lane = page.locator(".lane").first.bounding_box()
    assert scene["y"] + scene["height"] < 900
    assert lane["x"] > scene["x"] + scene["width"]
    assert scene["y"] < lane["y"] < scene["y"] + scene["height"]
    page.set_viewport_size({"width": 2560, "height": 1300})
    assert page.locator("#replay").bounding_box()["width"] > 900
    tab.context.close()


def test_a_violation_is_seen_beside_the_cursor_wherever_it_is(tab):
    page = tab.open(f"#rollout={TASK}/0/{DROPPED}&about=release_stability").page
    page.wait_for_selector(".timeline")
    lane = page.locator(".lane.tall").bounding_box()
    block = page.locator(".block.unsafe").bounding_box()
    assert block["width"] >= 8
    assert block["x"] + block["width"] <= lane["x"] + lane["width"] + 1


def test_many_violations_are_shown_whole_and_the_rest_on_demand(browser, copied):
    tab = Tab(browser, writing.write_page(copied.path))
    page = tab.open(f"#rollout={TASK}/0/{DROPPED}").page
    page.wait_for_selector(".timeline")
    page.evaluate(
        "const all = document.querySelector('.violations');"
        "while (all.children.length < 7) all.append(all.lastChild.cloneNode(true));"
        "for (const own of all.children) own.classList.remove('chosen')"
    )
    cards = page.locator(".card-violation")
    assert sum(card.is_visible() for card in cards.all()) == 4
    box, last = page.locator(".violations").bounding_box(), cards.nth(3).bounding_box()
    assert last["y"] + last["height"] <= box["y"] + box["height"] + 1
    tab.context.close()


def test_a_flip_leads_to_what_regressed(tab):
    page = tab.open().page
    page.click(f".flips a:has-text('{DROPPED}'):has-text('release stability')")
    page.wait_for_selector(".timeline")
    assert "release stability" in page.inner_text(".card-violation.chosen")
    page.click("#overview-link")
    assert len(tab.rows()) == 3


def test_the_worst_violations_are_one_click_away(tab):
    page = tab.open().page
    page.click("a.worst:has-text('release stability')")
    page.wait_for_selector(".timeline")
    assert "release stability" in page.inner_text(".card-violation.chosen")


def test_violations_are_shown_by_category_and_suite_of_a_policy(tab):
    page = tab.open().page
    page.select_option("#show-by", "category-suite")
    page.select_option("#show-policy", FAULT)
    rows = {
        row.locator("th").inner_text().strip(): row.locator("td").all_inner_texts()
        for row in page.locator(".matrix tbody tr").all()
    }
    assert rows["enclosure access"] == ["1 of 1"]
    assert rows["grasp stability"] == ["0 of 1"]


def test_the_timeline_begins_at_the_bad_prefix_of_the_summary(tab, run_folder):
    (told,) = [
        violation
        for verdict in run_folder.rollout(FAULT)["properties"]
        for violation in verdict["violations"]
    ]
    page = tab.open().page
    page.click(f"#rollouts tr:has-text('{FAULT}') a")
    page.wait_for_selector(".timeline")
    assert tab.where() == told["first"]
    assert tab.values()["obj_released"] == "true"
    assert tab.values()["obligation"] == "unsafe"
    assert f"Violated at step {told['first']}" in page.inner_text(".finding")
    assert told["entities"][1] in page.inner_text(".finding")


def test_scrubbing_moves_every_lane(tab, run_folder):
    page = tab.open(f"#rollout={KEY}&step=100").page
    page.wait_for_selector(".timeline")
    assert tab.where() == 100
    before, values = tab.cursor(), tab.values()
    assert (values["obj_released"], values["obligation"]) == ("false", "nothing")
    page.focus("#step")
    page.keyboard.press("b")
    first = tab.where()
    assert tab.values()["obj_released"] == "true"
    assert tab.cursor() > before
    page.keyboard.press("ArrowLeft")
    assert tab.where() == first - 1
    assert tab.values()["obligation"] == "pending"
    page.keyboard.press("Shift+ArrowRight")
    assert tab.where() == first + 9
    box = page.locator(".lane.signal").first.bounding_box()
    page.mouse.click(box["x"] + box["width"] * 0.25, box["y"] + 5)
    steps = json.loads(page.text_content("#data"))["rollouts"]
    assert 0 < tab.where() < steps[0]["steps"] / 2
    assert tab.cursor() == pytest.approx(box["x"] + box["width"] * 0.25, abs=4)
    page.fill("#step", "7")
    assert tab.where() == 7
    page.wait_for_url("**step=7*")


def test_it_plays_until_it_is_stopped(tab):
    page = tab.open(f"#rollout={KEY}&step=100").page
    page.click("#play")
    expect(page.locator("#where")).to_contain_text(re.compile("step 1[1-9]"))
    page.click("#play")
    stopped = tab.where()
    page.wait_for_timeout(200)
    assert tab.where() == stopped


def test_the_replay_in_3d_follows_the_timeline(browser, page_file):
    tab = Tab(browser, page_file)
    page = tab.open(f"#rollout={KEY}").page
    scene = page.locator("#replay canvas")
    scene.wait_for()
    there = scene.screenshot()
    assert len(there) > 5000  # one colour alone takes less
    page.focus("#step")
    page.keyboard.press("Home")
    assert scene.screenshot() != there
    page.keyboard.press("Escape")
    page.wait_for_selector("#rollouts")
    assert not scene.count()
    assert tab.complaints == []
    tab.context.close()


def test_a_video_of_the_run_is_beside_its_timeline(browser, copied):
    stem = Path(copied.rollout(FAULT)["recording"]).stem
    (copied.path / "videos").mkdir()
    (copied.path / "videos" / f"{stem}.mp4").write_bytes(b"none that can be played")
    tab = Tab(browser, writing.write_page(copied.path))
    page = tab.open(f"#rollout={KEY}").page
    page.wait_for_selector("#video")
    assert page.evaluate("document.querySelector('#video').src").endswith("seed0.mp4")
    assert tab.complaints == []  # its security policy lets it be loaded
    assert any(url.endswith("seed0.mp4") for url in tab.requests)
    tab.open(f"#rollout={TASK}/0/{DROPPED}")
    page.wait_for_selector(".timeline")
    assert page.locator("#video").count() == 0
    tab.context.close()


def test_a_run_without_a_rollout_is_a_page(browser, copied):
    copied.change({**copied.summary, "rollouts": [], "release": None})
    tab = Tab(browser, writing.write_page(copied.path))
    page = tab.open().page
    assert page.inner_text("#count") == "0 rollouts of 0, 0 violated"
    assert tab.complaints == []
    tab.context.close()


def test_zoom_shows_the_steps_around_the_violation(tab):
    page = tab.open(f"#rollout={KEY}").page
    page.wait_for_selector(".timeline")
    pending = page.locator(".block.pending").bounding_box()["width"]
    page.keyboard.press("z")
    assert page.locator(".block.pending").bounding_box()["width"] > 2 * pending
    assert page.locator(".cursor").is_visible()


def test_keys_go_from_rollout_to_rollout_and_back(tab):
    page = tab.open(f"#rollout={KEY}&sort=policy").page
    page.wait_for_selector(".timeline")
    page.keyboard.press("k")
    page.wait_for_selector(f"h1:has-text('{DROPPED}')")
    page.keyboard.press("j")
    page.wait_for_selector(f"h1:has-text('{FAULT}')")
    page.keyboard.press("Escape")
    page.wait_for_selector("#rollouts")
    page.go_back()
    page.wait_for_selector(f"h1:has-text('{FAULT}')")


def test_the_command_is_copied(browser, page_file):
    tab = Tab(browser, page_file, permissions=["clipboard-read", "clipboard-write"])
    page = tab.open(f"#rollout={KEY}").page
    page.click(".command button >> nth=0")
    page.wait_for_selector("#notice.shown")
    assert page.evaluate("navigator.clipboard.readText()").startswith("pytest --safemanip-params")
    tab.context.close()


@pytest.mark.parametrize("width", [390, 1280, 2560])
def test_it_fits_its_window_and_follows_the_theme(browser, page_file, width):
    tab = Tab(browser, page_file, (width, 844), color_scheme="dark")
    for view in ("", f"#rollout={KEY}"):
        page = tab.open(view).page
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    page.click("#theme")
    assert page.evaluate("document.documentElement.dataset.theme") == "light"
    assert tab.complaints == []
    tab.context.close()


def test_the_step_in_the_address_of_an_open_report_is_gone_to(tab):
    page = tab.open(f"#rollout={KEY}").page
    page.wait_for_selector(".timeline")
    page.evaluate("location.hash = location.hash.replace(/&step=.*|$/, '') + '&step=12'")
    expect(page.locator("#where")).to_contain_text("step 12 of")
    page.evaluate("location.hash = location.hash.replace(/step=12/, 'step=x')")
    assert tab.where() == 12


def test_a_card_leads_to_lanes_that_are_out_of_sight(browser, page_file):
    tab = Tab(browser, page_file, (390, 844))
    page = tab.open(f"#rollout={KEY}").page
    page.click(".card-violation")
    page.wait_for_function("document.querySelector('.over').getBoundingClientRect().top < 400")
    assert tab.complaints == []
    tab.context.close()


def test_without_its_recording_a_violation_has_its_rule_and_lanes(browser, copied):
    for path in (copied.path / "recordings").iterdir():
        path.unlink()
    tab = Tab(browser, writing.write_page(copied.path))
    page = tab.open(f"#rollout={KEY}").page
    told = page.locator(".told")
    assert "place_in_onset -> !obj_released W" in told.locator(".formula").inner_text()
    assert "6 of 8 corners of obj were inside" in told.locator(".evidence").inner_text()
    labels = told.locator(".track .label").all_inner_texts()
    assert {"obj_released", "obj_inside", "unsafe"} <= set(labels)
    assert told.locator(".block.unsafe").count() == 1
    assert tab.complaints == []
    tab.context.close()


def test_why_a_policy_gave_up_is_in_the_table_on_its_page_and_searched(browser, copied):
    summary = copied.summary
    (given_up,) = [own for own in summary["rollouts"] if own["policy"] == "scripted"]
    given_up |= {"success": False, "failure": f"no way to the handle {MARKUP}"}
    copied.change(summary)
    tab = Tab(browser, writing.write_page(copied.path))
    page = tab.open("#q=gave up").page
    rows = page.locator("#rollouts tbody tr")
    assert rows.count() == 1
    assert f"gave up: no way to the handle {MARKUP}" in rows.inner_text()
    rows.locator("a").click()
    page.wait_for_selector(".head .warning")
    assert page.inner_text(".head .warning").startswith("The policy gave up: no way to the handle")
    assert page.locator("img").count() == 0
    assert tab.complaints == []
    tab.context.close()


def test_details_beside_the_page_are_loaded_from_the_disk(browser, copied, monkeypatch):
    monkeypatch.setattr(writing, "WITHIN", 0)
    tab = Tab(browser, writing.write_page(copied.path))
    page = tab.open(f"#rollout={KEY}").page
    page.wait_for_selector(".timeline")
    assert tab.complaints == []
    for path in (copied.path / "report").iterdir():
        path.unlink()
    tab.open(f"#rollout={KEY}").page.wait_for_selector(".warning")
    assert "keep it beside this page" in page.inner_text(".warning")
    tab.context.close()


def test_hostile_names_harm_nothing(browser, copied):
    summary = copied.summary
    name = "<b>bold</b></script>"
    for rollout in summary["rollouts"]:
        rollout["suite"] = rollout["horizon"] = name
        rollout["properties"][0]["category"] = name
        for verdict in rollout["properties"]:
            for violation in verdict["violations"]:
                violation["entities"] = [
                    MARKUP if own == "obj" else own for own in violation["entities"]
                ]
    summary["rollouts"][0] |= {"error": HOSTILE, "success": None}
    summary["settings"]["assets"] = HOSTILE
    summary["versions"][name] = HOSTILE
    summary["release"]["gates"][0]["why"] = HOSTILE
    summary["release"]["baseline"]["place"] = HOSTILE
    copied.change(summary)
    for path in (copied.path / "recordings").glob("*.rollout"):
        recording = files.load(path)
        path.unlink()
        files.save(renamed(recording), path)
    tab = Tab(browser, writing.write_page(copied.path))
    page = tab.open().page
    assert page.locator("main b:has-text('bold')").count() == 0
    assert page.locator("img").count() == 0
    assert name in page.inner_text("#rollouts")
    tab.open(f"#rollout={KEY}")
    page.wait_for_selector(".timeline")
    shown = page.inner_text("main")
    assert "<img src=x onerror=alert(1)>" in shown
    assert "\\u202egnp\\x1b[31m" in shown
    assert not re.search("[\u202e\x1b]", shown)
    assert page.locator("img").count() == 0
    assert tab.complaints == []
    tab.context.close()


def renamed(recording: Recording) -> Recording:
    """With an object and an instruction of an enemy's."""
    scene = recording.scene.to_json()
    text = json.dumps(scene).replace('"obj"', json.dumps(MARKUP))
    found = json.loads(text)
    found["roles"] = {
        "obj" if role == MARKUP else role: own for role, own in found["roles"].items()
    }
    episode = type(recording.episode)(**{**vars(recording.episode), "instruction": HOSTILE})
    return Recording(episode, Scene.from_json(found), recording.steps)


def test_how_severe_it_was_is_in_the_table_on_the_card_and_in_words(tab):
    page = tab.open().page
    worst = [
        float(text) for text in page.locator("#rollouts td.col-worst").all_inner_texts() if text
    ]
    assert worst == sorted(worst, reverse=True)
    assert worst[0] > 4.0 > 2.0 > worst[-1]  # a fall from the shelf, a can half inside
    assert "severity" in page.locator("ol.worst li").first.inner_text()
    page.locator("ol.worst a").first.click()
    page.wait_for_selector(".timeline")
    assert f"severity {worst[0]:.2f}: " in page.inner_text(".card-violation.chosen")
    assert page.inner_text("p.severity").startswith(f"Severity {worst[0]:.2f}: margin")
