"""Uploads: named files and one JSON member of a multipart form, checked as strictly as a JSON body."""

import json
import shutil
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any, BinaryIO, NamedTuple, TypeVar

from fastapi import Request, UploadFile
from fastapi.concurrency import run_in_threadpool
from fastapi.exceptions import RequestValidationError
from pydantic import ValidationError
from starlette.datastructures import FormData

from footfall.api.bodies.settings_models import Strictly
from footfall.api.door.body_limits import JSON_BYTES, JSON_PARTS
from footfall.api.door.problems import Problem
from footfall.api.routing import BINARY
from footfall.core.errors import InvalidInput
from footfall.core.strict_json import read_json
from footfall.core.surrogates import has_lone_surrogate

_M = TypeVar("_M", bound=Strictly)

MOST_TEXTS = 20
"""Text members of a form that are read before any is judged."""

LONGEST_STEM, LONGEST_ENDING = 100, 20
"""Longest file name [bytes] and ending that are kept of an upload."""


class Uploaded(NamedTuple):
    """A file of a form, which is closed with the form: its name, and where its content is read."""

    name: str
    file: BinaryIO


def is_multipart(request: Request) -> bool:
    """Whether the request carries a form with files."""
    return request.headers.get("content-type", "").startswith("multipart/form-data")


@asynccontextmanager
async def form_of(
    request: Request, files: tuple[str, ...], texts: tuple[str, ...] = (), most: int = 2
) -> AsyncIterator[FormData]:
    """The request's form, of at most ``most`` files; a member that is none of ``files`` and ``texts`` is refused."""
    async with request.form(max_files=most, max_fields=MOST_TEXTS) as form:
        for name, item in form.multi_items():
            # where the form names an odd encoding, bytes can be made into anything
            if has_lone_surrogate(name + (item if isinstance(item, str) else item.filename or "")):
                raise InvalidInput("a text of the form has a lone surrogate, half a character; encode it as UTF-8")
            if not isinstance(item, str) and "\0" in (item.filename or ""):
                raise InvalidInput(
                    f"the file name {item.filename!r:.100} has a NUL character; give the file another name"
                )
        unknown = sorted({name for name in form if name not in (*files, *texts)})
        if unknown:
            known = ", ".join((*files, *texts))
            raise InvalidInput(
                f"the form has a member {unknown[0][:100]!r}; it may have: {known}", unknown=unknown[:10]
            )
        repeated = [name for name in texts if len(form.getlist(name)) > 1]
        if repeated:
            raise InvalidInput(f"the form gives {repeated[0]!r} more than once", member=repeated[0])
        yield form


def upload_of(form: FormData, name: str) -> Uploaded:
    """The form's member ``name``, unread: while requests wait for their turn, what is large stays on the disk."""
    found = uploads_of(form, name, most=1)
    if not found:
        raise InvalidInput(f"the form needs a file called {name!r}", members=sorted(form.keys()))
    return found[0]


def uploads_of(form: FormData, name: str, most: int, largest: int | None = None) -> list[Uploaded]:
    """Each of the form's members ``name``, unread; none of more than ``largest`` bytes."""
    found = form.getlist(name)
    if len(found) > most:
        raise InvalidInput(f"the form may have {most} files called {name!r}, not {len(found)}", limit=most)
    files = []
    for one in found:
        if isinstance(one, str):
            raise InvalidInput(f"the form's member {name!r} is a file, not text")
        upload: UploadFile = one  # type: ignore[assignment]
        file = PurePath((upload.filename or "").replace("\\", "/")).name
        if largest is not None and (upload.size or 0) > largest:
            raise InvalidInput(f"{file} is larger than {largest} bytes", file=file, limit=largest)
        files.append(Uploaded(file, upload.file))
    return files


async def file_of(form: FormData, name: str) -> tuple[str, bytes]:
    """File name and content of the form's member ``name``."""
    name, file = upload_of(form, name)
    return name, await run_in_threadpool(file.read)


async def files_of(form: FormData, name: str, most: int, largest: int | None = None) -> list[tuple[str, bytes]]:
    """File name and content of each of the form's members ``name``; none of more than ``largest`` bytes."""
    return [(one, await run_in_threadpool(file.read)) for one, file in uploads_of(form, name, most, largest)]


def json_of(form: FormData, name: str, model: type[_M]) -> _M:
    """The form's JSON member ``name``; absent means all defaults."""
    found = form.get(name, "{}")
    if not isinstance(found, str):
        raise InvalidInput(f"the form's member {name!r} is JSON text, not a file")
    if len(found) > JSON_BYTES:
        text = f"the form's member {name!r} has {len(found)} characters; at most {JSON_BYTES} are read"
        raise Problem("too-large", 413, text, limit=JSON_BYTES)
    return parse(found, model, name)


def parse(text: str | bytes, model: type[_M], where: str = "body") -> _M:
    """JSON text as a request model; raises what FastAPI raises for a body."""
    try:
        read_json(text, most=JSON_PARTS)
        return model.model_validate_json(text)
    except ValidationError as error:
        errors: list[Any] = [{**one, "loc": (where, *one["loc"])} for one in error.errors()]
    except ValueError as error:
        what = error.msg if isinstance(error, json.JSONDecodeError) else str(error)
        errors = [{"type": "json_invalid", "loc": (where,), "msg": "", "input": None, "ctx": {"error": what}}]
    raise RequestValidationError(errors)


@contextmanager
def on_disk(upload: Uploaded, beside: Sequence[Uploaded] = ()) -> Iterator[Path]:
    """The upload as a file of its name in a folder of its own, for readers that want a path.

    A name that no file can have becomes a similar one with the same ending. beside: files to lie there too; their
    names go with that of the first.
    """
    name = upload.name
    ending = PurePath(name).suffix
    stem = name.removesuffix(ending).replace("\0", "").strip(".").encode()[:LONGEST_STEM].decode(errors="ignore")
    with TemporaryDirectory(prefix="footfall-") as folder:
        path = Path(folder) / f"{stem or 'upload'}{ending if len(ending) < LONGEST_ENDING else ''}"
        copied(upload.file, path)
        for other, file in beside:
            stem = name if other.lower().startswith(name.lower()) else name.removesuffix(ending)
            kept = path.name if stem == name else path.stem
            copied(file, Path(folder) / f"{kept}{other[len(stem) :]}")
        yield path


def copied(file: BinaryIO, path: Path) -> None:
    """The rest of an upload as a file of its own."""
    with path.open("wb") as copy:
        shutil.copyfileobj(file, copy)


def multipart_doc(
    files: dict[str, str],
    json_members: dict[str, type[Strictly]],
    also: type[Strictly] | None = None,
    optional: tuple[str, ...] = (),
    several: Mapping[str, int] = MappingProxyType({}),
) -> Any:
    """OpenAPI request body of a form with files and JSON members, or of the JSON model ``also``.

    optional: files that may be left out; several: that may come more than once, with how often
    at most.
    """
    properties: dict[str, Any] = {}
    defs: dict[str, Any] = {}
    for name, text in files.items():
        many = {"type": "array", "items": BINARY, "maxItems": several[name]} if name in several else BINARY
        properties[name] = {**many, "description": text}
    needed = [name for name in files if name not in optional]
    for name, model in json_members.items():
        schema = _schema(model)
        defs |= schema.pop("$defs", {})
        properties[name] = schema
        needed += [name] if schema.get("required") else []
    form: dict[str, Any] = {
        "type": "object",
        "required": needed,
        "properties": properties,
        "additionalProperties": False,
        "$defs": defs,
    }
    encoding = {name: {"contentType": "application/json"} for name in json_members}
    content: dict[str, Any] = {"multipart/form-data": {"schema": form, "encoding": encoding}}
    if also is not None:
        schema = _schema(also)
        content["application/json"] = {"schema": schema, "example": schema.get("examples", [{}])[0]}
    return {"requestBody": {"required": True, "content": content}}


def _schema(model: type[Strictly]) -> dict[str, Any]:
    return model.model_json_schema(ref_template="#/components/schemas/{model}")
