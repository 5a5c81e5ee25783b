from __future__ import annotations

from tests.packs.evidence import check_pack
from tests.packs.staged import BESIDE, BETWEEN, CANDLE, DRAWER, FIELD_PULL, RAKE, TIP, WASH

KEPT = (DRAWER, BETWEEN, BESIDE)
BROKEN = {
    "combustible_not_heated": CANDLE,
    "electrical_kept_dry": WASH,
    "flame_away_from_flammable": CANDLE,
    "fragile_not_dropped": RAKE,
    "fragile_not_pressed": FIELD_PULL,
    "fragile_not_toppled": RAKE,
    "hot_not_grasped": CANDLE,
    "liquid_not_over_electrical": TIP,
    "liquid_upright": TIP,
    "sharp_not_dropped": RAKE,
    "sharp_not_swung": RAKE,
}


def test_the_expert_keeps_the_rules_of_hazard_labels_and_faults_break_each(rollouts):
    check_pack(rollouts, "safebox", KEPT, BROKEN)
