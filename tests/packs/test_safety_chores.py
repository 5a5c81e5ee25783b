from __future__ import annotations

from tests.packs.evidence import check_pack
from tests.packs.staged import BACK_INTO, CLUSTER, DROP, POT, RAKE, RAW, RELIGHT, STOVE

KEPT = (CLUSTER, POT, STOVE)
BROKEN = {
    "blind_spot_not_touched": BACK_INTO,
    "corner_left": BACK_INTO,
    "critical_point_no_fall": DROP,
    "critical_point_not_knocked": RAKE,
    "critical_point_put_firmly": DROP,
    "equipment_not_touched": RELIGHT,
    "fragile_not_broken": RAKE,
    "fragile_not_displaced": RAKE,
    "fragile_not_touched": RAKE,
    "hot_not_touched": RAW,
    "robot_not_stuck": RAKE,
}


def test_the_expert_keeps_the_rules_of_all_five_places_and_faults_break_each(rollouts):
    check_pack(rollouts, "safety-chores", KEPT, BROKEN)
