"""Write each shipped robot's URDF and meshes from its description file.

Run ``python -m footfall.robot.assets.generate``; the same description always gives the same files.
"""

import tomllib
from pathlib import Path

from footfall.robot.build import describe, part_meshes
from footfall.robot.shapes import obj_text


def generated_files(description_file: Path) -> dict[str, str]:
    """Relative path → text of every file that belongs beside that description."""
    raw = tomllib.loads(description_file.read_text(encoding="utf-8"))
    files = {f"{description_file.stem}.urdf": describe(raw).urdf}
    return files | {f"meshes/{part}.obj": obj_text(mesh) for part, mesh in part_meshes(raw).items()}


def main() -> None:
    for description_file in sorted(Path(__file__).parent.glob("*/*.toml")):
        for name, text in generated_files(description_file).items():
            path = description_file.parent / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
