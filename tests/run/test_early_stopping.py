"""What the processes of a run tell each other about which rollouts are still needed."""

from __future__ import annotations

from pathlib import Path

from pytest_safemanip.metrics.gates import Gates
from pytest_safemanip.run.cases import Case
from pytest_safemanip.run.early_stopping import EarlyStopping
from pytest_safemanip.run.results import Results, skipped_data


def test_what_a_killed_process_had_half_written_is_passed_over(tmp_path: Path) -> None:
    path, results = tmp_path / "run", Results({}, {})
    others = EarlyStopping(Gates(()), 0.05, results, path)
    before, after = Case("T", "p", "x", 0), Case("T", "p", "x", 1)
    teller = EarlyStopping(Gates(()), 0.05, Results({}, {}), path)
    teller.note(skipped_data(before))
    with path.open("ab") as file:
        file.write(b'{"case": ["T", "p", "x"')
    assert others.undecided(before)
    teller.note(skipped_data(after))
    assert others.undecided(after)
    assert results.skipped == {before.rollout, after.rollout}
