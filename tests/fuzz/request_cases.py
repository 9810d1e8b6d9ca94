"""Hostile input: cases that a seed determines. A case is a protocol ("h1" or "h2") and a list of pieces that can be left out
one by one: ["headers", stream, flags, [[name, value], ...]], ["frame", kind, flags, stream, payload], ["bytes", what]."""

import base64
import random
import struct

import request_http2 as http2

SERVICE = b"/lpdeform.v1.DeformService/"
METHODS = (b"ListSessions", b"GetSession", b"CreateSession", b"UpdateHandles", b"AckFrames", b"StreamFrames", b"StreamSessions",
           b"Deform", b"Solve", b"SnapshotSession", b"UploadPart", b"Nothing")
TYPES = (b"application/grpc", b"application/grpc+proto", b"application/grpc-web", b"application/grpc-web+proto",
         b"application/grpc-web-text", b"application/grpc-web-text+proto", b"application/grpc+json", b"application/json",
         b"application/grpc-web; charset=utf-8", b"text/plain", b"", b"application/grpc;", b"APPLICATION/GRPC")
BINARY = (b"a-bin", b"-bin", b"grpc-trace-bin", b"grpc-tags-bin", b"grpc-status-details-bin", b"grpc-server-stats-bin",
          b"endpoint-load-metrics-bin", b"lb-cost-bin", b"x-bin-bin", b"lpdeform-bin")
NOT_BASE64 = (b"A", b"A===", b"!!!!", b"=", b"AAAA=AAA", b"AA,A", b",", b"AAA\x7f", b"\xff\xfe", b"AAAAA", b"A A", b" ", b"")
TIMEOUTS = (b"1S", b"0n", b"1", b"S", b"-1S", b"99999999H", b"999999999H", b"1X", b"1.5S", b"\xff", b"1u", b"100m" * 40, b" 1S", b"")
ENCODINGS = (b"gzip", b"deflate", b"identity", b"br", b"identity,gzip", b"snappy", b"", b"\xff", b"gzip" * 500)
AUTHORITIES = (b"", b"localhost", b"evil.example", b"a@b", b"a b", b"[::1", b"x" * 3000, b"\xff", b"127.0.0.1:99999", b"a,b", b"/", b"*")
VERBS = (b"GET", b"PUT", b"CONNECT", b"OPTIONS", b"HEAD", b"PRI", b"post", b"PO ST", b"", b"X" * 2000, b"TRACE")
TES = (b"trailers", b"", b"gzip", b"trailers, deflate;q=0.5", b"x" * 500, b"\xff")
NUMBERS = (b"0", b"1", b"-1", b"5", b"99999999999999999999", b"x", b"\xff", b"", b"1" * 400)
HOP = ((b"connection", b"close"), (b"connection", b"upgrade"), (b"connection", b"te, a-bin"), (b"upgrade", b"h2c"),
       (b"upgrade", b"websocket"), (b"transfer-encoding", b"chunked"), (b"transfer-encoding", b"gzip"), (b"keep-alive", b"timeout=5"),
       (b"proxy-connection", b"keep-alive"), (b"http2-settings", b"AAMAAABkAAQAAP__"), (b"expect", b"100-continue"),
       (b"trailer", b"a-bin"), (b"content-length", b"0"), (b"content-length", b"7"), (b"content-length", b"-1"),
       (b"content-length", b"18446744073709551616"), (b"content-encoding", b"gzip"))
KNOWN = (b"grpc-previous-rpc-attempts", b"grpc-retry-pushback-ms", b"grpc-status", b"x-envoy-max-retries", b"x-envoy-retry-grpc-on",
         b"x-envoy-upstream-rq-timeout-ms", b"x-envoy-upstream-rq-per-try-timeout-ms", b"x-envoy-expected-rq-timeout-ms")
TEXTS = (b"grpc-message", b"user-agent", b"traceparent", b"lpdeform-session", b"authorization", b"x-request-id", b"x-forwarded-for",
         b"x-forwarded-proto", b"x-envoy-retry-on", b"x-envoy-original-path", b"x-envoy-decorator-operation", b"lb-token", b"cookie",
         b"host", b"grpc-internal-encoding-request", b"xds-cluster-name", b"accept", b"origin", b"access-control-request-method")
TOKEN = b"@TOKEN@"  # in place of one, which is another in each run
VALUES = (b"", b"x", b"\xff\xfe", b"a\tb", b"%", b"%ff", b"%zz", b"retriable-status-codes,5xx,reset", b"Bearer x", b"Bearer " + b"x" * 9000,
          b"trailers", b"1,2", "\u00e4\u4e2d".encode(), b" x ", b"x" * 200)


def stretched(chance, most):
    """A size that is small as often as it is large."""
    return int(2 ** chance.uniform(0, most))


def varint(value):
    """Of Protobuf."""
    return bytes([value]) if value < 128 else bytes([value % 128 + 128]) + varint(value // 128)


def message(chance):
    """What looks like one, or not: flags, a size and bytes that keep to it, or not."""
    body = chance.randbytes(stretched(chance, 12)) if chance.random() < 0.7 else b""
    if chance.random() < 0.3:  # a text, where most requests have a name; answers may repeat it
        text = chance.choice((b"sessions/", b"", b"\xff")) + b"n" * stretched(chance, 17)
        body = b"\x0a" + varint(len(text)) + text
    size = len(body) if chance.random() < 0.6 else chance.choice((0, 1, len(body) + 1, 4 << 20, 5 << 20, 0x7FFFFFFF, 0xFFFFFFFF))
    flags = 0 if chance.random() < 0.6 else chance.choice((1, 2, 0x40, 0x80, 0x81, 0xFF))
    if flags & 0x80:
        body = chance.choice((b"a-bin: A\r\n", b"grpc-status: 0\r\n", b":path: /\r\n", b"\r\n\r\n", body))
    return struct.pack(">BI", flags, size) + body


def body_of(chance, kind):
    body = b"".join(message(chance) for _ in range(chance.choice((0, 1, 1, 1, 2, 5))))
    if b"-text" in kind and chance.random() < 0.8:
        body = base64.b64encode(body)
    if chance.random() < 0.1:
        body = body[:chance.randrange(len(body) + 1)]
    return body


def path(chance):
    if chance.random() < 0.7:
        return SERVICE + chance.choice(METHODS)
    return chance.choice((b"/", b"", b"*", b"//", b"/healthz", SERVICE, SERVICE + b"x" * stretched(chance, 16), SERVICE + b"%00", b"/%2e%2e/",
                          SERVICE + b"ListSessions?a=" + b"b" * stretched(chance, 15), SERVICE + b"\xff", b"http://evil.example/",
                          SERVICE + b"../x", SERVICE + b"List Sessions", SERVICE + b"ListSessions#x", b"/grpc.health.v1.Health/Watch",
                          SERVICE.lower() + b"listsessions", b"/" + b"a/" * 2000))


def odd_headers(chance):
    """A few that do not belong there, of one kind."""
    kind = chance.randrange(9)
    if kind == 0:
        return [[chance.choice(BINARY), chance.choice(NOT_BASE64)] for _ in range(chance.choice((1, 1, 2)))]
    if kind == 1:
        return [[chance.choice(BINARY), base64.b64encode(chance.randbytes(stretched(chance, 14)))]]
    if kind == 2:
        return [[b"x-large", b"x" * stretched(chance, 17)]]
    if kind == 3:
        size = stretched(chance, 9)
        return [[b"x-%d" % k, b"v" * size] for k in range(stretched(chance, 8))]
    if kind == 4:
        return [[b"grpc-timeout", chance.choice(TIMEOUTS)]]
    if kind == 5:
        return [[chance.choice((b"grpc-encoding", b"grpc-accept-encoding", b"accept-encoding")), chance.choice(ENCODINGS)]]
    if kind == 6:
        return [list(chance.choice(HOP))]
    if kind == 7:
        return [[chance.choice(KNOWN), chance.choice(NUMBERS)]]
    return [[chance.choice(TEXTS), chance.choice(VALUES)] for _ in range(chance.choice((1, 2)))]


def request_headers(chance):
    verb = b"POST" if chance.random() < 0.85 else chance.choice(VERBS)
    authority = b"localhost" if chance.random() < 0.85 else chance.choice(AUTHORITIES)
    scheme = b"http" if chance.random() < 0.93 else chance.choice((b"https", b"", b"x://", b"\xff"))
    kind = chance.choice(TYPES[:6]) if chance.random() < 0.85 else chance.choice(TYPES)
    pairs = [[b":method", verb], [b":scheme", scheme], [b":path", path(chance)], [b":authority", authority], [b"content-type", kind]]
    if chance.random() < 0.25:
        pairs.append([b"authorization", b"Bearer " + TOKEN])
    if chance.random() < 0.8:
        pairs.append([b"te", b"trailers" if chance.random() < 0.8 else chance.choice(TES)])
    for _ in range(chance.choice((0, 1, 1, 1, 2, 3))):
        pairs += odd_headers(chance)
    if chance.random() < 0.03:
        pairs.insert(chance.randrange(len(pairs)), list(chance.choice(pairs)))  # twice
    if chance.random() < 0.03:
        del pairs[chance.randrange(5)]
    if chance.random() < 0.03:
        pairs.append([chance.choice((b"A-Upper", b"a b", b"", b":path", b":x", b"a\0b", b"a_b", b"\xff", b"a" * 5000)), b"x"])
    return pairs, kind


def trailers(chance):
    pairs = [pair for _ in range(chance.choice((1, 1, 2))) for pair in odd_headers(chance)]
    if chance.random() < 0.1:
        pairs.append([chance.choice((b":path", b":status", b"content-type", b"te")), b"x"])
    return pairs


def odd_frame(chance, stream):
    word = struct.pack(">I", chance.choice((0, 1, 7, 8, 0x7FFFFFFF, 0xFFFFFFFF, 65536)))
    where = chance.choice((stream, stream, 0, stream + 1, stream + 2, 1, 0x7FFFFFFF, 0x80000001))
    return ["frame", *chance.choice((
        (http2.RST_STREAM, 0, stream, struct.pack(">I", chance.choice((0, 2, 5, 8, 11, 13, 99)))),
        (http2.RST_STREAM, 0, where, word), (http2.WINDOW_UPDATE, 0, where, word), (http2.PING, chance.choice((0, 1)), 0, bytes(8)),
        (http2.PING, 0, where, bytes(chance.choice((7, 8, 9)))), (http2.GOAWAY, 0, 0, word + word), (http2.PRIORITY, 0, where, word + b"\1"),
        (http2.SETTINGS, 0, 0, struct.pack(">H", chance.choice((1, 2, 3, 4, 5, 6, 8, 99))) + word), (http2.SETTINGS, 1, 0, b""),
        (http2.SETTINGS, 0, where, chance.randbytes(5)), (http2.PUSH_PROMISE, 4, where, word + b"\x82"),
        (http2.CONTINUATION, 4, where, b"\x82"), (http2.DATA, chance.choice((0, 1, 8)), where, chance.randbytes(chance.choice((0, 1, 9, 500)))),
        (http2.HEADERS, chance.choice((4, 5, 0x2D, 0x0D)), where, chance.randbytes(chance.choice((0, 1, 30)))),
        (http2.HEADERS, 5, stream, b"\x3f\xff\xff\x7f"), (http2.HEADERS, 5, stream, b"\xbe" * 9), (chance.randrange(10, 256), 255, where, b"x" * 20)))]


def over_http2(chance):
    pieces = []
    for k in range(chance.choice((1, 1, 1, 2, 4))):
        stream = 2 * k + 1
        pairs, kind = request_headers(chance)
        body = body_of(chance, kind)
        last = trailers(chance) if chance.random() < 0.35 else None
        ends = chance.random() < 0.9
        flags = http2.END_STREAM if not body and last is None and ends else 0
        pieces.append(["headers", stream, flags, pairs])
        for at in range(0, len(body), 8192):
            is_last = at + 8192 >= len(body) and last is None and ends
            pieces.append(["frame", http2.DATA, http2.END_STREAM if is_last else 0, stream, body[at:at + 8192]])
        if last is not None:
            pieces.append(["headers", stream, http2.END_STREAM if ends else 0, last])
        while chance.random() < 0.25:
            pieces.insert(chance.randrange(len(pieces) + 1), odd_frame(chance, stream))
    if chance.random() < 0.03:
        pieces.insert(chance.randrange(len(pieces) + 1), ["bytes", chance.randbytes(stretched(chance, 8))])
    return ["h2", pieces]


def chunked(chance, body):
    pieces, size = [], stretched(chance, 10)
    for at in range(0, len(body), size):
        part = body[at:at + size]
        told = b"%x" % len(part) if chance.random() < 0.95 else chance.choice((b"-1", b"g", b"", b"fffffffffffffffff", b"5;a=b", b"0x5"))
        pieces.append(["bytes", told + b"\r\n" + part + b"\r\n"])
    end = b"0\r\n"
    if chance.random() < 0.4:
        end += b"".join(name + b": " + value + b"\r\n" for name, value in trailers(chance))
    return [*pieces, ["bytes", end + b"\r\n"]]


def over_http1(chance):
    pieces = []
    for _ in range(chance.choice((1, 1, 1, 2))):
        pairs, kind = request_headers(chance)
        told = dict((name, value) for name, value in pairs if name.startswith(b":"))
        version = b"HTTP/1.1" if chance.random() < 0.95 else chance.choice((b"HTTP/1.0", b"HTTP/0.9", b"HTTP/2.0", b"HTTP/1.2", b"x"))
        body = body_of(chance, kind)
        pieces.append(["bytes", told.get(b":method", b"") + b" " + told.get(b":path", b"") + b" " + version + b"\r\n"])
        lines = [[b"host", told.get(b":authority", b"")]] + [pair for pair in pairs if not pair[0].startswith(b":")]
        is_chunked = chance.random() < 0.3
        if chance.random() < 0.95:
            lines.append([b"transfer-encoding", b"chunked"] if is_chunked else [b"content-length", b"%d" % len(body)])
        end = b"\r\n" if chance.random() < 0.97 else chance.choice((b"\n", b"\r", b"\r\n x\r\n", b"\0\r\n"))
        pieces += [["bytes", name + b": " + value + end] for name, value in lines]
        pieces.append(["bytes", b"\r\n"])
        pieces += chunked(chance, body) if is_chunked else [["bytes", body]]
    return ["h1", pieces]


def make(seed, number):
    """The same for the same seed and number."""
    chance = random.Random(f"{seed}.{number}")
    return over_http2(chance) if chance.random() < 0.65 else over_http1(chance)


def bytes_of(case, token):
    way, pieces = case
    out = b"" if way == "h1" else http2.PREFACE + http2.frame(http2.SETTINGS, 0, 0)
    for kind, *rest in pieces:
        if kind == "headers":
            rest[2] = [[name, value.replace(TOKEN, token.encode())] for name, value in rest[2]]
        elif kind == "bytes":
            rest[0] = rest[0].replace(TOKEN, token.encode())
        out += {"headers": http2.headers, "frame": http2.frame, "bytes": lambda what: what}[kind](*rest)
    return out


def smaller(case):
    """Cases with less in them, those first that lack most."""
    way, pieces = case
    size = len(pieces)
    while (size := size // 2) >= 1:
        yield from ([way, pieces[:at] + pieces[at + size:]] for at in range(0, len(pieces), size))
    for at, piece in enumerate(pieces):
        for less in less_of(piece):
            yield [way, pieces[:at] + [less] + pieces[at + 1:]]


def less_of(piece):
    *what, last = piece
    if isinstance(last, bytes):
        if len(last) > 16:
            yield from ([*what, last[:len(last) // 2]], [*what, last[len(last) // 2:]])
        return
    yield from ([*what, last[:k] + last[k + 1:]] for k in range(len(last)))
    for k, (name, value) in enumerate(last):
        if len(value) > 8:
            yield [*what, last[:k] + [[name, value[:len(value) * 3 // 4]]] + last[k + 1:]]
