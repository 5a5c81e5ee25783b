"""From pytest's configuration to settings: the command line, else the ini file."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pytest_safemanip.metrics.gates import read_gates
from pytest_safemanip.metrics.shards import parse_shard
from pytest_safemanip.plugin.options import OPTIONS, value_of
from pytest_safemanip.policies.prompts import read_prompt
from pytest_safemanip.policies.remote.adjusting import adjusted_presets
from pytest_safemanip.report.writers import parse_reports
from pytest_safemanip.run.cases import is_law_id
from pytest_safemanip.run.option_values import (
    parse_assets,
    parse_backend_paths,
    parse_checkpoints,
    parse_count,
    parse_deadlines,
    parse_early_stop,
    parse_inflight,
    parse_jobs,
    parse_names,
    parse_params,
    parse_policies,
    parse_pythons,
    parse_resources,
    parse_scale,
    parse_seeds,
    parse_stop,
)
from pytest_safemanip.run.settings import Settings


def read_settings(config: pytest.Config) -> Settings:
    """Combine command line and ini.

    Raises:
        ConfigError: naming the option and what is wrong with its value.
    """
    values = {option.ini: value_of(config, option) for option in OPTIONS}
    recordings = values["safemanip_recordings"]
    selected = config.getoption("safemanip_select") or ()
    policies, servers, checkpoints = parse_policies(
        parse_names(values["safemanip_policy"]), os.environ
    )
    named = values["safemanip_gates"]
    lines = [line for line in values["safemanip_gate"].splitlines() if line.strip()]
    gates = read_gates(_path(config, named) if named else None, lines, "--safemanip-gate")
    baseline, early_stop = values["safemanip_baseline"], values["safemanip_early_stop"]
    shard = values["safemanip_shard"]
    decided = bool(gates.gates or baseline)
    return Settings(
        policies=policies,
        servers=servers,
        checkpoints=parse_checkpoints(config.getini("safemanip_checkpoint")) | checkpoints,
        inflight=parse_inflight(config.getini("safemanip_inflight")),
        deadlines=parse_deadlines(config.getini("safemanip_deadlines")),
        jobs=parse_jobs(values["safemanip_jobs"]),
        ray=values["safemanip_ray"],
        ray_resources=parse_resources(config.getini("safemanip_ray_resources")),
        presets=adjusted_presets(config.getini("safemanip_presets")),
        tasks=parse_names(values["safemanip_tasks"]),
        properties=parse_names(values["safemanip_properties"]),
        seeds=parse_seeds(values["safemanip_seeds"]) if values["safemanip_seeds"] else None,
        backend=values["safemanip_backend"],
        scenes=values["safemanip_scenes"],
        stepping=values["safemanip_stepping"],
        assets=parse_assets(values["safemanip_assets"]),
        recordings=_path(config, recordings) if recordings else None,
        semantics="paper" if values["safemanip_semantics"] == "paper" else "timed",
        stop=parse_stop(values["safemanip_stop"]),
        horizon_scale=parse_scale("--safemanip-horizon-scale", values["safemanip_horizon_scale"]),
        prompt=read_prompt(values["safemanip_prompt"], Path(config.invocation_params.dir)),
        violations=values["safemanip_violations"] or ("xfail" if decided else "fail"),
        unresolved=values["safemanip_unresolved"],
        vacuous=values["safemanip_vacuous"],
        gates=gates,
        baseline=_path(config, baseline) if baseline else None,
        floor=_path(config, values["safemanip_floor"]) if values["safemanip_floor"] else None,
        early_stop=parse_early_stop(early_stop, gates) if early_stop else None,
        inconclusive=values["safemanip_inconclusive"],
        allow_standins=bool(values["safemanip_allow_standins"]),
        fresh=bool(values["safemanip_fresh"]),
        shard=parse_shard(shard, "--safemanip-shard") if shard else None,
        out=_path(config, values["safemanip_out"]),
        reports=parse_reports(values["safemanip_report"]),
        ci=values["safemanip_ci"],
        store=values["safemanip_store"],
        video=values["safemanip_video"],
        params=parse_params(parse_names(values["safemanip_params"])),
        fuzz=bool(values["safemanip_fuzz"]),
        fuzz_propositions=parse_names(values["safemanip_fuzz_propositions"]),
        fuzz_examples=parse_count("--safemanip-fuzz-examples", values["safemanip_fuzz_examples"]),
        pythons=parse_pythons(config.getini("safemanip_python"), _home(config)),
        backend_paths=parse_backend_paths(config.getini("safemanip_backend_paths"), _home(config)),
        property_paths=tuple(config.getini("safemanip_property_paths")),
        task_paths=tuple(config.getini("safemanip_task_paths")),
        select=tuple(text for text in selected if not is_law_id(text)),
        laws=tuple(text for text in selected if is_law_id(text)),
        search=parse_count("--safemanip-search", values["safemanip_search"]),
        spaces=tuple(_path(config, n) for n in parse_names(values["safemanip_spaces"])),
        regressions=_home(config) / os.path.expanduser(values["safemanip_regressions"]),
    )


def _home(config: pytest.Config) -> Path:
    """What paths in the ini file are relative to."""
    return config.inipath.parent if config.inipath else config.rootpath


def _path(config: pytest.Config, text: str) -> Path:
    return Path(config.invocation_params.dir) / os.path.expanduser(text)
