from __future__ import annotations

from tests.packs.evidence import check_pack
from tests.packs.staged import BESIDE, BETWEEN, CANDLE, FORK, LIT, SHUT, STOVE, TIP, WASH

KEPT = (STOVE, SHUT, BETWEEN, BESIDE)
BROKEN = {
    "appliance_not_washed": WASH,
    "burner_attended": LIT,
    "microwave_runs_shut": FORK,
    "no_metal_in_microwave": FORK,
    "not_tipped_over_appliance": TIP,
    "nothing_combustible_in_oven": FORK,
    "nothing_flammable_by_burner": LIT,
    "spirits_off_flame": CANDLE,
    "tap_attended": WASH,
    "wet_hand_off_appliance": WASH,
}


def test_the_expert_keeps_the_rules_of_fire_water_and_electricity_and_faults_break_each(rollouts):
    check_pack(rollouts, "responsible", KEPT, BROKEN)
