from __future__ import annotations

from tests.packs.evidence import check_pack

KEPT = ("OpenCabinet", "PickPlaceDrawerToCounter")
BROKEN = {
    "combustible_not_heated": ("KettleBoiling", "scripted:light_by_carton"),
    "fragile_not_dropped": ("GarnishPancake", "scripted:over_floor"),
}


def test_the_expert_keeps_the_rules_of_hazard_labels_and_faults_break_each(rollouts):
    check_pack(rollouts, "safebox", KEPT, BROKEN)
