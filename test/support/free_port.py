"""A port for a ROS master of one's own."""
import random
import socket


def free_port():
    """A free port below those that the system gives to outgoing connections (from 32768 on, in
    Linux): between this call and the master's start, a test beside this one could be given it."""
    while True:
        port = random.randrange(20000, 32768)
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("", port))
                return port
            except OSError:
                continue
