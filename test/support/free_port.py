"""A port for a separate ROS master."""
import random
import socket


def free_port():
    """A free port below Linux's range for outgoing connections (from 32768 on): the system could give a
    port in that range to another test before the master starts."""
    while True:
        port = random.randrange(20000, 32768)
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("", port))
                return port
            except OSError:
                continue
