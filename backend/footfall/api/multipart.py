"""Uploads: one named file and one JSON member of a multipart form, checked as strictly as a JSON body."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from fastapi import Request, UploadFile
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError
from starlette.datastructures import FormData

from footfall.api.schemas import Strictly
from footfall.core.errors import InvalidInput

_M = TypeVar("_M", bound=Strictly)

LONGEST_STEM, LONGEST_ENDING = 100, 20
"""Longest file name [bytes] and ending that are kept of an upload."""


def is_multipart(request: Request) -> bool:
    """Whether the request carries a form with files."""
    return request.headers.get("content-type", "").startswith("multipart/form-data")


async def file_of(form: FormData, name: str) -> tuple[str, bytes]:
    """File name and content of the form's member ``name``."""
    found = form.get(name)
    if found is None or isinstance(found, str):
        raise InvalidInput(f"the form needs a file called {name!r}", members=sorted(form.keys()))
    upload: UploadFile = found  # type: ignore[assignment]
    return PurePath((upload.filename or "").replace("\\", "/")).name, await upload.read()


def json_of(form: FormData, name: str, model: type[_M]) -> _M:
    """The form's JSON member ``name``; absent means all defaults."""
    found = form.get(name, "{}")
    if not isinstance(found, str):
        raise InvalidInput(f"the form's member {name!r} is JSON text, not a file")
    return parse(found, model, name)


def parse(text: str | bytes, model: type[_M], where: str = "body") -> _M:
    """JSON text as a request model; raises what FastAPI raises for a body."""
    try:
        return model.model_validate_json(text)
    except ValidationError as error:
        errors: list[Any] = [{**one, "loc": (where, *one["loc"])} for one in error.errors()]
        raise RequestValidationError(errors) from None


@contextmanager
def on_disk(name: str, content: bytes) -> Iterator[Path]:
    """The content as a file of that name in a folder of its own, for readers that want a path.

    A name that no file can have becomes a similar one with the same ending.
    """
    ending = PurePath(name).suffix
    stem = name.removesuffix(ending).replace("\0", "").strip(".").encode()[:LONGEST_STEM].decode(errors="ignore")
    with TemporaryDirectory(prefix="footfall-") as folder:
        path = Path(folder) / f"{stem or 'upload'}{ending if len(ending) < LONGEST_ENDING else ''}"
        path.write_bytes(content)
        yield path


def multipart_doc(
    files: dict[str, str], json_members: dict[str, type[Strictly]], also: type[Strictly] | None = None
) -> Any:
    """OpenAPI request body of a form with files and JSON members, or of the JSON model ``also``."""
    properties: dict[str, Any] = {
        name: {"type": "string", "format": "binary", "description": text} for name, text in files.items()
    }
    for name, model in json_members.items():
        schema = model.model_json_schema()
        properties[name] = {"type": "string", "description": "JSON", "examples": [str(schema.get("examples", [{}])[0])]}
    content: dict[str, Any] = {
        "multipart/form-data": {
            "schema": {"type": "object", "required": list(files), "properties": properties},
        }
    }
    if also is not None:
        schema = also.model_json_schema()
        content["application/json"] = {"schema": schema, "example": schema.get("examples", [{}])[0]}
    return {"requestBody": {"required": True, "content": content}}
