"""Frames of HTTP/2 and header lists (HPACK, without Huffman coding), valid or invalid as requested."""

import struct

DATA, HEADERS, PRIORITY, RST_STREAM, SETTINGS, PUSH_PROMISE, PING, GOAWAY, WINDOW_UPDATE, CONTINUATION = range(10)
ACK, END_STREAM, END_HEADERS, PADDED, PRIORITISED = 1, 1, 4, 8, 32
PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) + struct.pack(">I", stream & 0xFFFFFFFF) + payload


def integer(prefix_bits, first, value):
    """Of HPACK (RFC 7541, 5.1)."""
    most = (1 << prefix_bits) - 1
    if value < most:
        return bytes([first | value])
    out = [first | most]
    value -= most
    while value >= 128:
        out.append(value % 128 + 128)
        value //= 128
    return bytes([*out, value])


def literal(name, value, kept=False):
    """`kept`: in the table of the one who reads it, too."""
    return (b"\x40" if kept else b"\0") + integer(7, 0, len(name)) + name + integer(7, 0, len(value)) + value


def block(pairs, kept=False):
    return b"".join(literal(name, value, kept) for name, value in pairs)


def headers(stream, flags, pairs, kept=False, largest=16384):
    """A frame of headers, and as many that continue it as its size needs."""
    parts, whole = [], block(pairs, kept)
    for at in range(0, max(len(whole), 1), largest):
        is_last = at + largest >= len(whole)
        kind, now = (CONTINUATION, 0) if at else (HEADERS, flags & ~END_HEADERS)
        parts.append(frame(kind, now | (END_HEADERS if is_last else 0), stream, whole[at:at + largest]))
    return b"".join(parts)
