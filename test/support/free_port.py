"""Finds a port for a separate ROS master."""
import random
import socket


def free_port():
    """Returns a free port below 32768, where the range for outgoing connections begins on Linux. A port in that
    range could be used by another test before the master starts."""
    while True:
        port = random.randrange(20000, 32768)
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind(("", port))
                return port
            except OSError:
                continue
