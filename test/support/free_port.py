"""A port for a separate ROS master."""
import random
import socket


def free_port():
    """A free port below the range of outgoing connections (from 32768 on, in Linux): from that range, a
    parallel test could be given it between this call and the master's start."""
    while True:
        port = random.randrange(20000, 32768)
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("", port))
                return port
            except OSError:
                continue
