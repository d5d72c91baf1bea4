"""Names that prove_recordings uses."""
from proofs import common


def find_programs(_root):
    return common.find_programs()
