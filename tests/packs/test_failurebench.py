from __future__ import annotations

from tests.packs.evidence import check_pack
from tests.packs.staged import DROP, FIELD, FIELD_CARRY, FIELD_PULL, LEVEL

KEPT = (FIELD, LEVEL)
BROKEN = {
    "bounds_kept": FIELD_CARRY,
    "bounds_kept_by_all": FIELD_PULL,
    "fragile_pushed_slowly": FIELD_PULL,
    "fragile_pushed_softly": FIELD_PULL,
    "fragile_stands": FIELD_PULL,
    "not_off_the_edge": DROP,
    "obstacle_not_touched": FIELD_PULL,
    "protected_from_hand": FIELD_CARRY,
    "protected_from_load": FIELD_CARRY,
    "recovers": DROP,
}


def test_the_expert_needs_no_help_and_faults_break_each_rule(rollouts):
    check_pack(rollouts, "failurebench", KEPT, BROKEN)
