"""What browsers are told to hold back: nobody frames the page, no code but this server's runs in it."""

from collections.abc import Iterable

_NOTHING = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
_PAGE = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; "
    "connect-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'self'"
)
_ALWAYS = {
    "x-frame-options": "SAMEORIGIN",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "x-content-type-options": "nosniff",
    "referrer-policy": "same-origin",
    "permissions-policy": "camera=(), display-capture=(), geolocation=(), microphone=(), payment=(), usb=()",
}
_SECURE = ("strict-transport-security", "max-age=31536000")


def protected(path: str, present: Iterable[tuple[bytes, bytes]], public: bool) -> list[tuple[bytes, bytes]]:
    """Headers of an answer and what they lack of the protection. public: whether it has a name of its own, with TLS."""
    headers = list(present)
    names = {name.lower() for name, _ in headers}
    wanted = {**_ALWAYS, "content-security-policy": _NOTHING if path.startswith("/api/") else _PAGE}
    if path.startswith("/api/"):
        wanted["cache-control"] = "private"
    if public:  # a browser would keep what is said of localhost for every server on it
        wanted[_SECURE[0]] = _SECURE[1]
    return headers + [(name.encode(), text.encode()) for name, text in wanted.items() if name.encode() not in names]
