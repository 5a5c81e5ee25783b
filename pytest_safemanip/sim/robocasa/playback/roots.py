"""Where the files of models are on this machine."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from pathlib import Path

from pytest_safemanip.errors import ConfigError
from pytest_safemanip.sim.robocasa.loading import how_to_install


def file_roots(assets_root: Path) -> Mapping[str, Path]:
    """The assets folder of each package; see :mod:`.model_xml`.

    Raises:
        ConfigError: if robosuite is not installed.
    """
    spec = importlib.util.find_spec("robosuite")
    if spec is None or not spec.submodule_search_locations:
        raise ConfigError(f"robosuite is not installed; {how_to_install()}")
    package = Path(next(iter(spec.submodule_search_locations)))
    return {"robosuite": package / "models" / "assets", "robocasa": assets_root}
