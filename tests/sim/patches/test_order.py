from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from pytest_safemanip.sim.robocasa import loading


def test_places_beside_a_fixture_stay_in_order(assets_root: Path) -> None:
    loading.load(assets_root)
    from robocasa.models.fixtures import counter

    places = [ET.Element("geom") for _ in range(50)]
    assert list(counter.set([*places, *places])) == places
