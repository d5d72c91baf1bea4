"""A subscriber made by hand, with a connection of its own: it reads all, or never, or breaks off in
the middle of a message."""
import socket
import struct
import threading
import xmlrpc.client


def publisher_of(topic):
    import rosgraph
    master = rosgraph.Master("/soak_listener")
    for name, nodes in master.getSystemState()[0]:
        if name == topic:
            return master.lookupNode(nodes[0])
    raise ConnectionError(f"nobody publishes {topic}")


class Listener:
    def __init__(self, topic, reads=True):
        uri = publisher_of(topic)
        code, text, protocol = xmlrpc.client.ServerProxy(uri).requestTopic(
            "/soak_listener", topic, [["TCPROS"]])
        if code != 1:
            raise ConnectionError(f"{topic}: {text}")
        self.socket = socket.create_connection((protocol[1], protocol[2]), timeout=30)
        self.shake_hands(topic)
        self.thread = None
        if reads:
            self.socket.settimeout(None)
            self.thread = threading.Thread(target=self.read, daemon=True)
            self.thread.start()

    def shake_hands(self, topic):
        fields = b""
        for field in ("callerid=/soak_listener", f"topic={topic}", "type=*", "md5sum=*"):
            data = field.encode()
            fields += struct.pack("<I", len(data)) + data
        self.socket.sendall(struct.pack("<I", len(fields)) + fields)
        answer = self.receive()
        if b"error=" in answer:
            raise ConnectionError(f"{topic}: {answer}")

    def receive(self):
        return self.receive_bytes(struct.unpack("<I", self.receive_bytes(4))[0])

    def receive_bytes(self, count):
        data = bytearray()
        while len(data) < count:
            part = self.socket.recv(min(count - len(data), 1 << 20))
            if not part:
                raise ConnectionError("ended")
            data += part
        return bytes(data)

    def read(self):
        try:
            while True:
                self.receive()
        except OSError:
            pass  # the nodelet was unloaded, or close() was called

    def break_off(self):
        """Is gone in the middle of a message, if there is one: with a reset, as of a process that was
        killed. One that reads is in the middle of something."""
        try:
            if self.thread is None:
                self.socket.settimeout(5)
                length = struct.unpack("<I", self.receive_bytes(4))[0]
                self.receive_bytes(length // 2)
        except OSError:
            pass
        try:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        except OSError:
            pass
        self.close()

    def close(self):
        try:
            self.socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        self.socket.close()
