from __future__ import annotations

import os

import pytest

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.spec import yamlfile
from pytest_safemanip.spec.yamlfile import load

TEXT = """\
id: mug
deadline_s: five
names: [x, y]
nested:
  inner:
    number: 1.5
flag: true
list:
  - {a: b}
  - c: d
yes_no: yes
empty:
quoted: 'yes'
blank: ''
arabic: \u0665
joined: 5_0
"""


@pytest.fixture
def write(tmp_path):
    def write(text, name="file.yaml"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


@pytest.fixture
def section(write):
    return load(write(TEXT))


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('id: a\ntitle: "\\e[31m red"\n', r":2: '\x1b[31m red' has the character '\x1b', which"),
        ('id: "a\\rb"\n', r":1: 'a\rb' has the character '\r', which"),
        ("ti\u202etle: a\n", r":1: 'ti\u202etle' has the character '\u202e', which"),
        ('a: [x, {b: "\\u2028"}]\n', r":1: '\u2028' has the character '\u2028', which"),
    ],
)
def test_text_that_a_terminal_would_obey_is_refused_wherever_it_is(write, text, place):
    with pytest.raises(ConfigError) as caught:
        load(write(text))
    assert place in str(caught.value)
    assert "leave it out" in str(caught.value)
    assert "\x1b" not in str(caught.value)


def test_a_title_of_several_lines_is_shown_in_one(write):
    found = load(write('formula: |\n  G a\n  & G b\ntitle: "caf\u00e9 at 5\u00a0%\\nand\\tmore"\n'))
    assert found.string("formula") == "G a\n& G b\n"
    assert found.one_line("title") == "caf\u00e9 at 5 % and more"


def test_values_are_asked_for_by_type(section):
    assert section.string("id") == "mug"
    assert section.string("quoted") == "yes"
    assert section.strings("names") == ("x", "y")
    assert section.section("nested").section("inner").number("number") == 1.5
    assert section.boolean("flag") is True
    assert "id" in section
    assert "size" not in section
    assert list(section)[:3] == ["id", "deadline_s", "names"]
    assert section.place("flag").endswith("file.yaml:7")


def test_an_atom_may_be_called_on(write):
    assert list(load(write("on: on(f)\noff: true\nyes: 1\nno: 2"))) == ["on", "off", "yes", "no"]


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (
            lambda s: s.number("deadline_s", positive=True),
            ":2: key 'deadline_s': expected a positive number, found 'five'",
        ),
        (lambda s: s.number("arabic"), ":15: key 'arabic': expected a number, found '\u0665'"),
        (lambda s: s.number("joined"), ":16: key 'joined': expected a number, found '5_0'"),
        (lambda s: s.number("names"), ":3: key 'names': expected a number, found a list"),
        (lambda s: s.string("names"), ":3: key 'names': expected text, found a list"),
        (lambda s: s.string("empty"), ":12: key 'empty': expected text, found nothing"),
        (lambda s: s.string("blank"), ":14: key 'blank': expected text, found ''"),
        (lambda s: s.string("yes_no"), ":11: key 'yes_no': expected text (in quotes, if YAML"),
        (lambda s: s.boolean("yes_no"), ":11: key 'yes_no': expected true or false, found 'yes'"),
        (lambda s: s.boolean("quoted"), ":13: key 'quoted': expected true or false"),
        (lambda s: s.strings("id"), ":1: key 'id': expected a list, found 'mug'"),
        (lambda s: s.strings("list"), ":9: key 'list': expected text, found a mapping"),
        (lambda s: s.section("id"), ":1: key 'id': expected a mapping, found 'mug'"),
        (lambda s: s.string("size"), ":1: key 'size' is missing"),
        (
            lambda s: s.section("nested").section("inner").string("number"),
            ":6: key 'nested.inner.number': expected text",
        ),
    ],
)
def test_an_error_says_file_line_key_expected_and_found(section, ask, message):
    with pytest.raises(ConfigError) as caught:
        ask(section)
    assert f"file.yaml{message}" in str(caught.value)


@pytest.mark.parametrize("text", ["0", "-1", "nan", ".inf", "1e999"])
def test_numbers_are_positive_and_finite_where_asked(write, text):
    with pytest.raises(ConfigError, match="expected a positive number"):
        load(write(f"x: {text}")).number("x", positive=True)


@pytest.mark.parametrize(("text", "value"), [("5", 5.0), ("0.5", 0.5), ("1e3", 1000.0)])
def test_numbers(write, text, value):
    assert load(write(f"x: {text}")).number("x", positive=True) == value


def test_unknown_and_missing_keys(section):
    with pytest.raises(ConfigError, match=r":2: unknown key 'deadline_s'; did you mean 'deadline'"):
        section.check_keys(["id"], ["deadline", "names"])
    with pytest.raises(ConfigError, match=r":6: unknown key 'nested.inner.number'"):
        section.section("nested").section("inner").check_keys(["x"])
    with pytest.raises(ConfigError, match=r":1: key 'title' is missing"):
        section.check_keys(["title"], list(section))
    section.check_keys(["id"], list(section))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: 2\na: 3", ":3: key 'a' is given twice, first on line 1"),
        ("o: {a: 1, a: 2}", ":1: key 'a' is given twice"),
        ("a: &x 1\nb: *x", ":1: anchors and aliases are not supported"),
        ("a: *x", ":1: anchors and aliases are not supported"),
        ("a: !!python/object/apply:os.system [ls]", ":1: tag '"),
        ("\n- 1", ":2: expected a mapping of keys to values, found a list"),
        ("", ":1: the file is empty"),
        ("# nothing", ":1: the file is empty"),
        ("a: 1\n---\nb: 1", ":2: a second document"),
        ("a: 1\nb: [", ":3: not valid YAML"),
        ("a: b: c", ":1: not valid YAML: mapping values are not allowed"),
        ("a: " + "[" * 20 + "]" * 20, ":1: nested more than 16 levels deep"),
        ("[" * 300_000, "nest"),  # libyaml 0.2.6 has a limit of its own
        ("? [1]\n: 2", ":1: expected a key as text"),
        ("1: 2", ":1: expected a key as text (in quotes, if YAML reads it otherwise), found '1'"),
        (b"a: 1\nb: \xff", ":2: not UTF-8 text"),
        ("a: \x00", "not valid YAML"),
    ],
)
def test_a_file_that_is_not_plain_yaml_is_refused(write, text, message):
    with pytest.raises(ConfigError) as caught:
        load(write(text))
    assert message in str(caught.value)
    assert str(caught.value).count("\n") == 0


def test_a_file_that_is_too_large_or_missing_is_refused(write, tmp_path):
    with pytest.raises(ConfigError, match="larger than 1000000 bytes"):
        load(write("x" * (yamlfile.MAX_BYTES + 1)))
    os.mkfifo(tmp_path / "pipe.yaml")
    with pytest.raises(ConfigError, match=r"pipe.yaml: cannot be read: not a regular file"):
        load(tmp_path / "pipe.yaml")
    with pytest.raises(ConfigError, match=r"nowhere.yaml: cannot be read: No such file"):
        load(tmp_path / "nowhere.yaml")


def test_the_slow_parser_reads_the_same(section, write, monkeypatch):
    monkeypatch.setattr(yamlfile, "_Loader", yamlfile.yaml.SafeLoader)
    slow = load(write(TEXT))
    assert list(slow) == list(section)
    assert [slow.place(key) for key in slow] == [section.place(key) for key in section]
    with pytest.raises(ConfigError, match=r"file.yaml:\d: not valid YAML"):
        load(write("a: 1\nb: ["))
