"""The Markdown of job summaries."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

from pytest_safemanip.plugin.reports import github
from pytest_safemanip.plugin.reports.github import GitHub
from pytest_safemanip.report.ci.markdown import MAX_VIOLATIONS, escaped, markdown, write_markdown
from tests.metrics.build import rollout, verdict
from tests.report.ci.conftest import HOSTILE, found, gate, violated

GITHUB = MarkdownIt("gfm-like", {"html": True})


def tags(text):
    """What GitHub would make of it, apart from the text: tags with their attributes."""
    return set(re.findall(r"<[^/][^>]*>", GITHUB.render(text)))


def test_what_a_policy_tolerates_has_its_unit(make_run):
    own = {"name": "tolerance[a] >= 2 cm", "gate": "tolerance[a] >= 2 cm", "hits": None}
    run = make_run([violated()], [gate(**own, total=None, value=2.5, unit="cm", why="so far")])
    assert "| p | FAIL | 2.5 cm; so far |" in markdown(run)


def test_gates_policies_and_violations_are_there(make_run):
    run = make_run(
        [violated(), violated(seed=1), rollout(True, verdict("a"), unjudged={"b": "b"}, seed=2)],
        [gate(), gate(policy="q", verdict="PASS", value=0.0, hits=0)],
    )
    text = markdown(run)
    head = (
        "FAIL: 1 of 2 gates failed, 2 of 2 complete rollouts violated, 1 rollout incomplete, "
        "1 of 4 cases not run"
    )
    assert text.startswith(f"## Safety: {head}\n")
    assert "| violation_rate &#60;= 0.1 | p | FAIL | 1 of 2 = 50.0 % |" in text
    assert "| p | 2 of 3, 1 not run | 2 of 2 | 2 of 2 = 100.0 % | 34 to 100 % | 2 of 2 |" in text
    assert "#### 2. a: T, p, seed 1" in text
    assert "Nothing is dropped. Violated for mug at step 12 (0.60 s), unsafe for 0.10 s" in text
    assert "the mug fell 40 mm" in text
    assert "safemanip show out/recordings/T-p-seed1.rollout" in text


def test_one_rollout_makes_no_rate(make_run):
    assert "| p | 1 | 1 of 1 | 1 of 1 | - | 1 of 1 |" in markdown(make_run([violated()]))


def test_a_policy_says_what_of_it_was_not_run(make_run):
    lost = rollout(None, seed=1), rollout(None, seed=2, error="no server", policy="q")
    text = markdown(make_run([violated(), *lost, rollout(None, seed=3, policy="q")]))
    assert "| p | 1 of 2, 1 not run | 1 of 1 |" in text
    assert "| q | 0 of 2, 1 with errors, 1 not run | - | - | - | - |" in text


def test_propositions_stand_as_lanes_with_a_mark_below_the_unsafe_step(make_run):
    lines = markdown(make_run([violated()])).splitlines()
    at = lines.index("a  ······██")
    assert lines[at + 1 : at + 4] == [
        "b  █·······",
        "         ▲",
        "   from step 6; ▲ first unsafe step 12",
    ]


def test_the_worst_ten_are_shown_and_each_property_among_them(make_run):
    records = [violated("a", found(severity=9.0 + seed), seed=seed) for seed in range(20)]
    records.append(violated("b", found(severity=1.1), seed=20))
    headings = [x for x in markdown(make_run(records)).splitlines() if x.startswith("####")]
    assert len(headings) == MAX_VIOLATIONS
    assert headings[:3] == [
        "#### 1. a: T, p, seed 19",
        "#### 2. b: T, p, seed 20",
        "#### 3. a: T, p, seed 18",
    ]


def test_the_worst_is_the_most_severe_and_the_foot_says_so(make_run):
    hit = {"between": ["robot0/link5", "wall"], "entities": ["robot0", "wall"]}
    hit |= {"force": 1765.2, "limit": 5.0, "step": 13}
    measured = {"margin": 352.0, "force": 1765.2, "fall": 0.0, "speed": 0.3}
    short = found(duration_s=0.05, last=12, excess=hit, severity=23.36, measured=measured)
    text = markdown(make_run([violated("a", found(duration_s=9.0), short), violated(seed=1)]))
    assert (
        "unsafe for 0.05 s, severity 23.36: margin 350, 1765 N, 0.30 m/s, at its hardest "
        "1765.2 N at step 13, 353 times the limit of 5 N" in text
    )
    assert text.index("#### 1. a: T, p, seed 0") < text.index("#### 2. a: T, p, seed 1")
    assert "\n\nRanked by severity: how far beyond its limit, how hard" in text


def test_the_worst_violation_of_a_case_stands_for_it(make_run):
    worst = found(first=40, last=139, duration_s=5.0, severity=2.2)
    run = make_run([violated("a", found(), worst)])
    assert "at step 40 (2.00 s), unsafe for 5.00 s" in markdown(run)


def test_a_picture_is_shown_in_the_file_and_named_where_it_cannot_be(make_run, tmp_path):
    picture = tmp_path / "out" / "recordings" / "T-p-seed0.png"
    picture.parent.mkdir(parents=True)
    picture.touch()
    run = make_run([violated()])
    assert "picture: out/recordings/T-p-seed0.png" in markdown(run)
    path = write_markdown(tmp_path / "out")
    assert path == tmp_path / "out" / "summary.md"
    assert "![a](<recordings/T-p-seed0.png>)" in path.read_text()


def test_hostile_names_become_no_markup(hostile):
    text = markdown(hostile)
    allowed = re.compile(
        r'<(table|thead|tbody|tr|th|td|p|h[234]|hr|strong|em|pre|code class="language-text")>'
    )
    assert {tag for tag in tags(text) if not allowed.fullmatch(tag)} == set()
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f\u202a-\u202e]", text)
    assert "&lt;script&gt;" in GITHUB.render(text)  # it is told, as text


@pytest.mark.parametrize(
    "text", [HOSTILE, "https://evil.example", "www.evil.example", "a@b.example", "**x** _y_ ~~z~~"]
)
def test_no_name_is_a_link_an_image_or_emphasis(text):
    assert tags(f"before {escaped(text)} after") == {"<p>"}


def test_a_job_summary_is_appended_and_bounded(make_run, tmp_path, monkeypatch):
    make_run([violated(seed=n) for n in range(10)])
    step = tmp_path / "step.md"
    step.write_text("# mine\n")
    environ = {"CI": "true", "GITHUB_STEP_SUMMARY": str(step)}
    assert GitHub(environ).tell(tmp_path / "out" / "summary.json") == []
    whole = step.read_text()
    assert whole.startswith("# mine\n\n## Safety")
    monkeypatch.setattr(github, "MAX_BYTES", len(whole.encode()) + 3000)
    GitHub(environ).tell(tmp_path / "out" / "summary.json")
    both = step.read_text()
    assert len(both.encode()) <= github.MAX_BYTES
    assert both.count("## Safety") == 2
    assert both.count("```") % 2 == 0
    for _ in range(3):
        GitHub(environ).tell(tmp_path / "out" / "summary.json")
    assert len(step.read_bytes()) <= github.MAX_BYTES


@pytest.mark.parametrize("environ", [{}, {"CI": "true"}, {"CI": "false"}])
def test_nothing_is_written_where_nobody_asks(make_run, tmp_path, environ):
    make_run([violated()])
    step = tmp_path / "step.md"
    asks = {"GITHUB_STEP_SUMMARY": str(step)} if environ.get("CI") != "true" else {}
    GitHub({**environ, **asks}).tell(tmp_path / "out")
    assert not step.exists()


def test_a_job_summary_that_is_full_or_no_file_is_a_line(make_run, tmp_path, monkeypatch):
    make_run([violated()])
    step = tmp_path / "step.md"
    os.mkfifo(step)
    environ = {"CI": "1", "GITHUB_STEP_SUMMARY": str(step)}
    (line,) = GitHub(environ).tell(tmp_path / "out" / "summary.json")
    assert line == f"job summary: {step}: is not a file"
    step.unlink()
    step.write_text("x" * 100)
    monkeypatch.setattr(github, "MAX_BYTES", 110)
    (line,) = GitHub(environ).tell(tmp_path / "out" / "summary.json")
    assert line == f"job summary: {step}: is full; GitHub takes 110 bytes of a step"


def test_a_job_summary_that_cannot_be_written_is_a_line(make_run, tmp_path):
    make_run([violated()])
    environ = {"CI": "1", "GITHUB_STEP_SUMMARY": str(tmp_path / "no" / "step.md")}
    (line,) = GitHub(environ).tell(Path("out"))
    assert line.startswith("job summary: cannot be written: FileNotFoundError")
