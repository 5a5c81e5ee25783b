"""Servers that speak the protocols byte by byte, none of the package's code in them.

``python servers.py KIND`` runs one in a process of its own, prints its port, and can be killed.
"""

from __future__ import annotations

import base64
import contextlib
import hashlib
import socket
import struct
import sys
import threading
import time

import msgpack


class Raw:
    """A TCP server: every connection is given to a function in a thread of its own."""

    def __init__(self, converse, port=0):
        self.converse = converse
        self.socket = socket.create_server(("127.0.0.1", port))
        self.port = self.socket.getsockname()[1]
        self.connections, self.over = [], threading.Event()
        self.threads = [threading.Thread(target=self._accept, daemon=True)]
        self.threads[0].start()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                connection, _ = self.socket.accept()
                self.connections.append(connection)
                self.threads.append(threading.Thread(target=self._run, args=(connection,)))
                self.threads[-1].daemon = True
                self.threads[-1].start()

    def _run(self, connection):
        with connection, contextlib.suppress(OSError, EOFError, struct.error):
            self.converse(connection)
            connection.shutdown(socket.SHUT_RDWR)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.over.set()
        with contextlib.suppress(OSError):
            self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()
        self.threads[0].join(5)  # no connection is accepted any more
        for connection in self.connections:
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
        for thread in self.threads:
            thread.join(5)


def exactly(connection, size):
    data = b""
    while len(data) < size:
        more = connection.recv(size - len(data))
        if not more:
            raise EOFError
        data += more
    return data


class Frames:
    """The server's side of RFC 6455, after its handshake."""

    def __init__(self, connection):
        self.connection = connection
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += exactly(connection, 1)
        self.head = head.decode()
        key = self.head.lower().split("sec-websocket-key:")
        if len(key) < 2:
            connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 3\r\n\r\nOK\n")
            raise EOFError
        start = self.head.lower().index("sec-websocket-key:") + len("sec-websocket-key:")
        text = self.head[start:].split("\r\n")[0].strip()
        accepted = f"{text}258EAFA5-E914-47DA-95CA-C5AB0DC85B11".encode()
        digest = hashlib.sha1(accepted, usedforsecurity=False).digest()
        connection.sendall(
            b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            b"Sec-WebSocket-Accept: " + base64.b64encode(digest) + b"\r\n\r\n"
        )

    def receive(self):
        first, second = exactly(self.connection, 2)
        assert first & 0x80, "the client's messages are one frame each"
        assert second & 0x80, "a client masks"
        assert not first & 0x70, "no compression was agreed on"
        size = second & 0x7F
        if size == 126:
            (size,) = struct.unpack(">H", exactly(self.connection, 2))
        elif size == 127:
            (size,) = struct.unpack(">Q", exactly(self.connection, 8))
        mask = exactly(self.connection, 4)
        data = exactly(self.connection, size)
        if first & 0x0F == 8:
            raise EOFError
        assert first & 0x0F == 2, "requests are binary"
        number = int.from_bytes(mask * (size // 4 + 1), "little") & ((1 << 8 * size) - 1)
        return (int.from_bytes(data, "little") ^ number).to_bytes(size, "little")

    def send(self, data, kind=2):
        self.connection.sendall(header(len(data), kind) + data)

    def text(self, text):
        self.send(text.encode(), 1)

    def close(self, code, reason=""):
        self.send(struct.pack(">H", code) + reason.encode(), 8)


def header(size, kind=2):
    if size < 126:
        return bytes((0x80 | kind, size))
    if size < 2**16:
        return bytes((0x80 | kind, 126)) + struct.pack(">H", size)
    return bytes((0x80 | kind, 127)) + struct.pack(">Q", size)


def websocket(converse, port=0):
    """A server whose conversations are about frames."""
    return Raw(lambda connection: converse(Frames(connection)), port)


def floats(values, shape, code="<f4"):
    """openpi's map of an array."""
    data = struct.pack(f"<{len(values)}{code[1]}", *values) if code == "<f4" else values
    return {b"__ndarray__": True, b"data": data, b"dtype": code, b"shape": shape}


def openpi_actions(rows=50, value=0.25):
    reply = {"actions": floats([value] * 12 * rows, [rows, 12]), "policy_timing": {"infer_ms": 1.0}}
    return msgpack.packb(reply)


def openpi(reply=None, metadata=b"\x80", seen=None, delays=(), port=0):
    """A server like openpi's: metadata, then a reply to each request.

    Args:
        reply: bytes of every reply, or a function of the frames and the request.
        metadata: the first frame.
        seen: collects the requests.
        delays: seconds before the first replies.
        port: 0 for any that is free.
    """

    def converse(frames):
        frames.send(metadata)
        waits = list(delays)
        while True:
            request = frames.receive()
            if seen is not None:
                seen.append(msgpack.unpackb(request))
            if waits:
                time.sleep(waits.pop(0))
            if callable(reply):
                reply(frames, request)
            else:
                frames.send(openpi_actions() if reply is None else reply)

    return websocket(converse, port)


def message(kind, payload, number):
    return msgpack.packb({"type": kind, "payload": payload, "seq": number, "timestamp": 2.0})


def vlaeval(answer=None, seen=None, hello=None, port=0):
    """A server like vla-eval's.

    Args:
        answer: function of the frames and the decoded observation's message.
        seen: collects the messages.
        hello: its greeting's content.
    """
    greeting = {"harness_version": "0.8.0", "protocol_version": 1, "model_server": "Toy"}

    def converse(frames):
        while True:
            found = msgpack.unpackb(frames.receive())
            if seen is not None:
                seen.append(found)
            if found["type"] == "hello":
                frames.send(message("hello", hello or greeting, found["seq"]))
            elif found["type"] == "observation":
                if answer is not None:
                    answer(frames, found)
                else:
                    frames.send(message("action", vlaeval_action(), found["seq"]))

    return websocket(converse, port)


def vlaeval_action(value=0.25):
    data = struct.pack("<12f", *[value] * 12)
    return {"actions": {"__ndarray__": True, "data": data, "dtype": "<f4", "shape": [12]}}


class Zmq:
    """A REP socket in a thread; ``answer`` gives a reply's bytes, or None to say nothing."""

    def __init__(self, answer, port="*"):
        import zmq

        self.context = zmq.Context()
        self.socket = self.context.socket(zmq.REP)
        self.socket.setsockopt(zmq.LINGER, 0)
        self.socket.bind(f"tcp://127.0.0.1:{port}")
        self.port = int(self.socket.getsockopt_string(zmq.LAST_ENDPOINT).rpartition(":")[2])
        self.answer, self.requests, self.running = answer, [], True
        self.over = threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self):
        while self.running:
            if not self.socket.poll(20):
                continue
            self.requests.append(self.socket.recv())
            reply = self.answer(self.requests[-1])
            if reply is None:
                return
            self.socket.send(reply)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.running = False
        self.over.set()
        self.thread.join(5)
        self.socket.close()
        self.context.destroy(linger=0)


def npy(values, shape, code="<f4"):
    """A ``.npy`` file, by its published format."""
    data = values if isinstance(values, bytes) else struct.pack(f"<{len(values)}f", *values)
    text = f"{{'descr': {code!r}, 'fortran_order': False, 'shape': {shape!r}, }}".encode()
    text += b" " * (-(10 + len(text) + 1) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


def groot_map(values, shape, code="<f4"):
    return {"__ndarray_class__": True, "as_npy": npy(values, shape, code)}


SIZES = {
    "end_effector_position": 3,
    "end_effector_rotation": 3,
    "gripper_close": 1,
    "base_motion": 4,
    "control_mode": 1,
}


def groot_actions(rows=16, value=0.25, prefix="action."):
    return {
        prefix + part: groot_map([value] * rows * size, (1, rows, size))
        for part, size in SIZES.items()
    }


def modality(keys, steps=1):
    text = '{"delta_indices": %s, "modality_keys": %s}'
    return {
        "__ModalityConfig_class__": True,
        "as_json": text % (list(range(steps)), str(list(keys)).replace("'", '"')),
    }


LANGUAGE = "annotation.human.task_description"


def groot(actions=None, language=LANGUAGE, steps=16):
    """Answers like N1.5's msgpack server."""

    def answer(request):
        try:
            asked = msgpack.unpackb(request)["endpoint"]
        except Exception as error:
            return msgpack.packb({"error": str(error)})
        if asked == "ping":
            return msgpack.packb({"status": "ok", "message": "Server is running"})
        if asked == "get_modality_config":
            config = {"language": modality([language]), "action": modality(SIZES, steps)}
            return msgpack.packb(config)
        return actions() if callable(actions) else msgpack.packb(actions or groot_actions())

    return answer


def child(kind):
    """The kinds that a test kills or stops."""
    if kind == "openpi":
        server = openpi()
    elif kind == "groot":
        server = Zmq(groot())
    elif kind == "vla-eval":
        server = vlaeval()
    else:
        raise SystemExit(f"no server {kind!r}")
    sys.stdout.write(f"{server.port}\n")
    sys.stdout.flush()
    with open(0) as standard_input:
        standard_input.read()  # until the test ends


if __name__ == "__main__":
    child(sys.argv[1])
