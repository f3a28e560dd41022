"""A browser's bytes at an encrypted console: console_over_tls.py PORT TOKEN FINGERPRINT. Prints what the daemon says over the WebSocket.

Python's own TLS, none of the library that the daemon is made with beyond OpenSSL itself.
"""

import base64
import hashlib
import os
import socket
import ssl
import struct
import sys

port, token, fingerprint = int(sys.argv[1]), sys.argv[2], sys.argv[3]


def until_closed(connection: socket.socket) -> bytes:
    data = b""
    while block := connection.recv(65536):
        data += block
    return data


def plain() -> bytes:
    with socket.create_connection(("127.0.0.1", port), timeout=20) as connection:
        connection.sendall(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
        return until_closed(connection)


def encrypted(least=ssl.TLSVersion.TLSv1_2, most=ssl.TLSVersion.MAXIMUM_SUPPORTED) -> ssl.SSLSocket:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    context.minimum_version, context.maximum_version = least, most
    return context.wrap_socket(socket.create_connection(("127.0.0.1", port), timeout=20))


def exactly(connection: ssl.SSLSocket, count: int) -> bytes:
    data = b""
    while len(data) < count:
        block = connection.recv(count - len(data))
        assert block, "closed"
        data += block
    return data


answer = plain()
assert answer.startswith(b"HTTP/1.1 400") and b"https://" in answer, answer
assert b"<html" not in answer.lower(), answer

try:
    encrypted(ssl.TLSVersion.TLSv1, ssl.TLSVersion.TLSv1_1).close()
    raise SystemExit("TLS 1.1 was taken")
except (ssl.SSLError, ConnectionError):
    pass

with encrypted() as page:
    digest = hashlib.sha256(page.getpeercert(binary_form=True)).hexdigest().upper()
    shown = ":".join(digest[i : i + 2] for i in range(0, len(digest), 2))
    assert shown == fingerprint, (shown, fingerprint)
    page.sendall(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n".encode())
    answer = until_closed(page)
    assert answer.startswith(b"HTTP/1.1 200") and b"</html>" in answer, answer[:200]

with encrypted() as console:
    key = base64.b64encode(os.urandom(16)).decode()
    console.sendall(
        (
            f"GET /rpc HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\nAuthorization: Bearer {token}\r\n\r\n"
        ).encode()
    )
    head = b""
    while not head.endswith(b"\r\n\r\n"):
        head += exactly(console, 1)
    assert head.startswith(b"HTTP/1.1 101"), head
    message = b'{"jsonrpc":"2.0","id":1,"method":"rig.status"}'
    mask = os.urandom(4)
    console.sendall(
        bytes([0x81, 0x80 | len(message)]) + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(message))
    )
    opcode, length = exactly(console, 2)
    if length == 126:
        (length,) = struct.unpack(">H", exactly(console, 2))
    assert opcode == 0x81, opcode
    print(exactly(console, length).decode())
