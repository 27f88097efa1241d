"""Zip archives made for tests."""

import io
import zipfile


def zipped(**files: bytes) -> bytes:
    """An archive that holds ``files``, by name."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return out.getvalue()
