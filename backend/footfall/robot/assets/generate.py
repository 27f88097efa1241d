"""Write each shipped robot's files: ATHLETE's URDF and meshes from its description file, the Ambler's from its sizes.

Run ``python -m footfall.robot.assets.generate``; the same description always gives the same files.
"""

import tomllib
from pathlib import Path

from footfall.robot.assets.ambler_files import ambler_toml, ambler_urdf
from footfall.robot.assets.ambler_sizes import AmblerSizes
from footfall.robot.build import describe, part_meshes
from footfall.robot.meshes.shapes import obj_text


def generated_files(description_file: Path) -> dict[str, str]:
    """Relative path → text of every file that belongs beside that description."""
    raw = tomllib.loads(description_file.read_text(encoding="utf-8"))
    files = {f"{description_file.stem}.urdf": describe(raw).urdf}
    return files | {f"meshes/{part}.obj": obj_text(mesh) for part, mesh in part_meshes(raw).items()}


def ambler_texts(sizes: AmblerSizes) -> dict[str, str]:
    """Name → text of each file of an Ambler of those sizes."""
    return {"ambler.urdf": ambler_urdf(sizes), "robot.toml": ambler_toml(sizes)}


def main() -> None:
    """Writes the files of ATHLETE and of the Ambler that follow from their sizes, beside this module."""
    here = Path(__file__).parent
    written = {here / "ambler" / name: text for name, text in ambler_texts(AmblerSizes()).items()}
    description_file = here / "athlete" / "athlete.toml"
    written |= {description_file.parent / name: text for name, text in generated_files(description_file).items()}
    for path, text in written.items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
