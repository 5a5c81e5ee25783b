"""RoboCasa's downloads: which archive a model comes from, and whether it was unpacked in full."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path, PurePosixPath
from xml.etree import ElementTree

COMMAND = "python -m robocasa.scripts.download_kitchen_assets"
SIZE = "10 GB"
ARCHIVES = {
    "textures": "tex",
    "generative_textures": "tex_generative",
    "fixtures": "fixtures_lw",
    "objects/objaverse": "objs_objaverse",
    "objects/aigen_objs": "objs_aigen",
    "objects/lightwheel": "objs_lw",
}
"""Value of ``--type`` for the archive with the files below a folder of the assets."""


def fault_of(model: Path) -> str | None:
    """What is wrong with an unpacked model: a file that it names is not there, or it is cut off
    or no XML.

    Only files below the model's folder are looked for: RoboCasa puts others in the place of those
    that lie elsewhere, among them paths of the machine on which its models were made.

    Args:
        model: an XML file.
    """
    content = model.read_bytes()
    if b"</mujoco>" not in content:
        return "is cut off"
    try:
        elements = ElementTree.fromstring(content).iter()  # noqa: S314 -- as robosuite reads it
    except ElementTree.ParseError as error:
        return f"is no XML: {error}"
    for name in dict.fromkeys(filter(None, (element.get("file") for element in elements))):
        path = PurePosixPath(name)
        if not path.is_absolute() and ".." not in path.parts and not (model.parent / name).exists():
            return f"needs {name}, which is not there"
    return None


def incomplete(paths: Iterable[str], roots: Sequence[Path]) -> str | None:
    """One line about the models that were not unpacked in full, or None.

    Args:
        paths: downloaded files, relative to the assets; those that are no models are passed over.
        roots: folders of assets; the first that has a file is meant.
    """
    broken: list[tuple[str, str, Path]] = []
    for path in paths:
        if path.endswith(".xml"):
            root = next(root for root in roots if (root / path).is_file())
            fault = fault_of(root / path)
            if fault is not None:
                broken.append((path, fault, root))
    if not broken:
        return None
    path, fault, root = broken[0]
    more = f" ({len(broken)} models like this)" if len(broken) > 1 else ""
    archives = sorted({_archive(path) for path, _, _ in broken})
    return (
        f"RoboCasa's downloaded assets are incomplete in {root}: {path} {fault}{more}; "
        f"complete them with: {COMMAND} --type {' '.join(archives)}, "
        "or run with --safemanip-assets=primitive"
    )


def _archive(path: str) -> str:
    return next(name for folder, name in ARCHIVES.items() if path.startswith(f"{folder}/"))
