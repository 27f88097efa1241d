"""How a rover opens the server's door: the token that it shows, and the certificate that it believes."""

import os
import ssl
from pathlib import Path
from ssl import SSLContext
from typing import TypedDict

from footfall.core.errors import InvalidInput
from footfall.telemetry.link import TOKEN_VARIABLE


class DoorOptions(TypedDict, total=False):
    """Options of ``websockets.connect``: the token, where there is one, and which certificates are believed."""

    additional_headers: dict[str, str]
    ssl: SSLContext


def door_options(url: str, certificate: Path | None = None) -> DoorOptions:
    """Options of ``websockets`` for the rover link at ``url``.

    The token is taken from the environment (FOOTFALL_ROVER_TOKEN): arguments of a process can be read by all.
    certificate: PEM file of the server's own certificate, the only one that is believed, whatever name it carries;
    None: those that this computer trusts. Raises InvalidInput where it can't be read.
    """
    token = os.environ.get(TOKEN_VARIABLE)
    options: DoorOptions = {"additional_headers": {"Authorization": f"Bearer {token}"}} if token else {}
    if certificate is None or not url.startswith("wss:"):
        return options
    try:
        believed = ssl.create_default_context(cafile=str(certificate))
    except OSError as err:
        raise InvalidInput(f"{certificate} is no certificate in PEM form: {err}", path=str(certificate)) from err
    believed.check_hostname = False
    believed.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
    return {**options, "ssl": believed}
