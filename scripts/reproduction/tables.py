"""Names that prove_recordings uses."""
from proofs import common
from proofs.common import markdown_table  # noqa: F401


def made_by(_script, device):
    return common.made_by(device)
