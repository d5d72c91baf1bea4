#!/usr/bin/env python3
"""04_found_again.py MAP RECORDING [EACH [FIRST]]: locates every EACH-th image (default: 10),
starting with image FIRST (default: 0), in a saved map, and compares the pose with the recorded one.
Only depth is used.
RECORDING:POSES reads recorded poses from a file."""
import sys
import time

import numpy

import dtsdf_mapping

CLOSE_M, CLOSE_DEGREES = 0.05, 3.0


def main(map_path, recording, each="10", first="0"):
    path, _, poses = recording.partition(":")
    mapper = dtsdf_mapping.Mapper.load(map_path)
    images = dtsdf_mapping.Recording(path, poses=poses or None, first=int(first), step=int(each))
    count = close = wrong = 0
    for image in images:
        begin = time.time()
        found = mapper.locate(image.depth, image.K, image.unit_m)
        count += 1
        text = found["status"]
        if found["T_W_C"] is not None:
            off = numpy.linalg.inv(image.T_W_C) @ found["T_W_C"]
            off_m = numpy.linalg.norm(off[:3, 3])
            degrees = numpy.degrees(numpy.arccos(min(1.0, (numpy.trace(off[:3, :3]) - 1.0) / 2.0)))
            is_close = off_m < CLOSE_M and degrees < CLOSE_DEGREES
            close, wrong = close + is_close, wrong + (not is_close)
            text = f"found, {1000 * off_m:.0f} mm and {degrees:.1f} degrees from the recorded pose"
        print(f"image {image.index}: {text} ({100 * found['explained']:.0f} % explained, "
              f"{time.time() - begin:.1f} s)", flush=True)
    print(f"{close} of {count} found, {wrong} elsewhere, on {mapper.backend}")


if __name__ == "__main__":
    if "--help" in sys.argv:
        print(__doc__)
        sys.exit()
    if not 3 <= len(sys.argv) <= 5:
        sys.exit(__doc__)
    main(*sys.argv[1:])
