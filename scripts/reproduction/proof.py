"""Names that prove_recordings uses."""
from proofs.common import MAPS, make_parser, reconstruct, run  # noqa: F401
from proofs import common


def fill_page(path, _script, **parts):
    common.fill_page(path, **parts)
