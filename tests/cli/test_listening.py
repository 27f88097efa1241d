"""The socket that the server listens on."""

import asyncio
import resource
import socket
from typing import cast

import pytest

from footfall.core.errors import Conflict, InvalidInput
from footfall_ui.listening import MOST_FILES, allow_many_files, listen


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
def test_what_the_server_answers_goes_out_at_once(host):
    """By Nagle's algorithm all but the first of the small writes of an answer would wait 40 ms to be acknowledged."""

    async def undelayed() -> int:
        met: asyncio.Future[int] = asyncio.get_running_loop().create_future()

        def on_client(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            accepted = cast(socket.socket, writer.get_extra_info("socket"))
            met.set_result(accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
            writer.close()

        listening = listen(host, 0)
        async with await asyncio.start_server(on_client, sock=listening):
            _, writer = await asyncio.open_connection(*listening.getsockname()[:2])
            writer.close()
            await writer.wait_closed()
            return await asyncio.wait_for(met, 5)

    assert asyncio.run(undelayed()) == 1


def test_as_many_files_as_the_system_gives():
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    try:
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(256, limits[1]), limits[1]))
        allow_many_files()
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        assert hard == limits[1]
        assert soft == (MOST_FILES if hard == resource.RLIM_INFINITY else min(hard, MOST_FILES))
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)


def test_an_address_that_cannot_be_listened_on_is_refused_by_name():
    with listen("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(Conflict, match=rf"port {port} of 127\.0\.0\.1 can't be used"):
            listen("127.0.0.1", port)
    with pytest.raises(InvalidInput, match="0 to 65535"):
        listen("127.0.0.1", 65536)
    with pytest.raises(InvalidInput, match="no name or address"):
        listen("no.such.host.invalid", 0)
