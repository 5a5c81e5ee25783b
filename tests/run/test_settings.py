from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.plugin.read_settings import read_settings
from pytest_safemanip.policies.remote.endpoint import Deadlines
from pytest_safemanip.run.option_values import (
    parse_checkpoints,
    parse_deadlines,
    parse_inflight,
    parse_jobs,
    parse_params,
    parse_policies,
    parse_seeds,
    told_seeds,
)


@pytest.mark.parametrize(
    ("text", "seeds"),
    [
        ("1", (0,)),
        ("3", (0, 1, 2)),
        ("5:8", (5, 6, 7)),
        ("0:1", (0,)),
        ("4,", None),
        ("7,2,7,5", (7, 2, 5)),
        (" 2 ", (0, 1)),
        ("3, 1", (3, 1)),
    ],
)
def test_seeds_are_a_number_a_range_or_a_list(text, seeds):
    if seeds is None:
        with pytest.raises(ConfigError):
            parse_seeds(text)
    else:
        assert parse_seeds(text) == seeds
        assert parse_seeds(told_seeds(seeds)) == seeds


@pytest.mark.parametrize(
    "text",
    ["", "0", "-1", "a", "1.5", "3:3", "5:2", "-2:2", "1:2:3", ":", ":4", "1:", "0,-1", ",", "0-4"],
)
def test_what_means_no_seed_is_refused_with_what_was_expected(text):
    with pytest.raises(ConfigError) as caught:
        parse_seeds(text)
    assert str(caught.value) == (
        "--safemanip-seeds: expected N (that many), A:B (without B) or A,B,C: one seed or more, "
        f"from 0 up, found {text!r}"
    )


@pytest.mark.parametrize(
    "text", ["1000000000000", "5:100006", "1,4294967296", "4294967296:4294967297"]
)
def test_more_seeds_than_anybody_means_are_refused(text):
    with pytest.raises(ConfigError, match="expected at most 100000 seeds below 2\\*\\*32, found"):
        parse_seeds(text)


@given(st.lists(st.integers(0, 1000), min_size=2, unique=True))
def test_a_list_of_seeds_keeps_its_order(seeds):
    assert parse_seeds(",".join(map(str, seeds))) == tuple(seeds)


def test_parameters_are_names_and_numbers():
    assert parse_params(["settled.speed=0.05", " collision.force = 1e1"]) == {
        "settled.speed": 0.05,
        "collision.force": 10.0,
    }
    assert parse_params([]) == {}


@pytest.mark.parametrize("item", ["settled.speed", "settled.speed=", "settled.speed=fast", "a=1=2"])
def test_a_parameter_without_a_number_is_refused(item):
    with pytest.raises(ConfigError) as caught:
        parse_params([item])
    assert str(caught.value) == (
        f"--safemanip-params: expected NAME=VALUE with a number, found {item!r}"
    )


@pytest.fixture
def read(pytester):
    return lambda *arguments: read_settings(pytester.parseconfig(*arguments))


def test_without_options_everything_is_as_documented(read, pytester):
    found = read()
    assert (found.policies, found.tasks, found.properties) == ((), ("all",), ())
    assert (found.seeds, found.recordings) == (None, None)
    assert (found.backend, found.scenes, found.assets) == ("robocasa", "", "auto")
    assert found.stepping == ""
    assert (found.semantics, found.stop, found.horizon_scale) == ("timed", "success", 1.0)
    assert (found.violations, found.unresolved, found.vacuous) == ("fail", "skip", "skip")
    assert found.out == pytester.path / ".safemanip"


def test_lists_may_be_repeated_and_separated_by_commas(read):
    found = read(
        "--safemanip-policy=hold, random",
        "--safemanip-policy=hold",
        "--safemanip-tasks=OpenDrawer,,quick",
        "--safemanip-params=settled.speed=0.1,collision.force=2",
        "--safemanip-seeds=2:4",
    )
    assert found.policies == ("hold", "random")
    assert found.tasks == ("OpenDrawer", "quick")
    assert found.params == {"settled.speed": 0.1, "collision.force": 2.0}
    assert found.seeds == (2, 3)


def test_the_command_line_wins_over_the_ini_file(read, pytester):
    pytester.makeini(
        "[pytest]\nsafemanip_stop = horizon\nsafemanip_seeds = 2\nsafemanip_semantics = paper\n"
        "safemanip_property_paths = own more\n"
    )
    found = read("--safemanip-seeds=5:6")
    assert (found.seeds, found.stop, found.semantics) == ((5,), "horizon", "paper")
    assert found.property_paths == (pytester.path / "own", pytester.path / "more")


def test_a_value_of_the_ini_file_that_is_no_choice_is_refused_with_a_near_miss(read, pytester):
    pytester.makeini("[pytest]\nsafemanip_stop = sucess\n")
    with pytest.raises(
        ConfigError, match=r"safemanip_stop in the ini file: .*'sucess'; did you mean 'success'\?"
    ):
        read()


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "x", "1e308", "1001"])
def test_the_factor_on_the_horizon_is_a_number_above_zero(read, text):
    with pytest.raises(ConfigError, match="--safemanip-horizon-scale: expected a number above 0"):
        read(f"--safemanip-horizon-scale={text}")


def test_folders_are_those_of_the_place_where_pytest_was_called(read, pytester, monkeypatch):
    monkeypatch.setenv("HOME", "/somebody")
    assert read("--safemanip-out=runs").out == pytester.path / "runs"
    assert str(read("--safemanip-out=/tmp/x").out) == "/tmp/x"  # noqa: S108
    assert str(read("--safemanip-recordings=~/runs").recordings) == "/somebody/runs"


def test_policies_on_servers_have_their_address_from_the_option_or_the_environment():
    given = (
        "pi05=ws://a:1",
        "hold",
        "groot-to=atomic_seen@b+composite_seen@c:2",
        "groot-pt",
        "pi0",
    )
    environment = {"SAFEMANIP_GROOT_PT": "d:3", "SAFEMANIP_PI05": "e", "SAFEMANIP_GROOT": ""}
    policies, servers, _ = parse_policies(given, environment)
    assert policies == ("pi05", "hold", "groot-to", "groot-pt", "pi0")
    assert servers == {
        "pi05": "ws://a:1",
        "groot-to": "atomic_seen@b+composite_seen@c:2",
        "groot-pt": "d:3",
    }


def test_what_is_served_may_be_claimed_beside_the_address():
    given = ("pi05@my-run/75000=ws://a:1+ws://b:1", "groot@official", "mine:Policy", "hold")
    policies, servers, checkpoints = parse_policies(given, {"SAFEMANIP_GROOT": "c"})
    assert policies == ("pi05", "groot", "mine:Policy", "hold")
    assert servers == {"pi05": "ws://a:1+ws://b:1", "groot": "c"}
    assert checkpoints == {"pi05": "my-run/75000", "groot": "official"}
    for wrong in (("pi05@=ws://a",), ("pi05@one=ws://a", "pi05@two=ws://a")):
        with pytest.raises(ConfigError, match="expected one pi05@CHECKPOINT=ADDRESS"):
            parse_policies(wrong, {})


def test_claims_and_requests_in_flight_are_by_policy():
    assert parse_checkpoints(["pi05 = my run/75000", "groot=official"]) == {
        "pi05": "my run/75000",
        "groot": "official",
    }
    assert parse_inflight(["pi05 = 4", "vla-eval=1"]) == {"pi05": 4, "vla-eval": 1}
    for parse, option in ((parse_checkpoints, "checkpoint"), (parse_inflight, "inflight")):
        with pytest.raises(ConfigError, match=f"safemanip_{option}: expected NAME = "):
            parse(["pi05"])
        with pytest.raises(ConfigError, match=f"safemanip_{option}: 'pi50' is no policy on a ser"):
            parse(["pi50 = 4"])
    for number in ("0", "some", "-1", "1001"):
        with pytest.raises(
            ConfigError, match=f"pi05: expected a number from 1 to 1000, found '{number}'"
        ):
            parse_inflight([f"pi05 = {number}"])


def test_jobs_are_a_number_or_left_to_the_machine():
    assert (parse_jobs("1"), parse_jobs("16"), parse_jobs("auto")) == (1, 16, None)


def test_deadlines_are_named_and_in_seconds():
    assert parse_deadlines(["call = 60", "start=2.5"]) == Deadlines(start=2.5, call=60.0)
    with pytest.raises(ConfigError, match="unknown deadline 'cal'; did you mean 'call'"):
        parse_deadlines(["cal = 1"])
    with pytest.raises(ConfigError, match="expected NAME=SECONDS, found 'call = soon'"):
        parse_deadlines(["call = soon"])
    with pytest.raises(ConfigError, match=r"safemanip_deadlines: deadline 'call': 0\.0 s"):
        parse_deadlines(["call = 0"])
    for endless in ("1e308", "inf"):
        with pytest.raises(ConfigError, match="safemanip_deadlines: expected at most 604800 s"):
            parse_deadlines([f"call = {endless}"])
