"""Reads recordings from folders, and fuses them in the same order as `reconstruct`."""
import sys

from . import _core


class Recording:
    """A recording in a folder: TUM RGB-D, ICL-NUIM, 7-Scenes, Replica, ScanNet or your own PNGs
    (docs/recordings.md).

    path: the folder.
    format: one of recording_formats(); by default guessed from the files.
    K: intrinsics in pixels, 3 x 3 or (fx, fy, cx, cy); by default those of the recording.
    units_per_metre: scale of 16-bit depth; by default that of the recording.
    poses: a file or folder with poses to use instead of the recording's own.
    pose_tolerance_s: maximum difference between the stamps of an image and its pose.
    first, last, step: select depth images by index; last is included.
    pose_convention: "optical", "opengl", "body" or "inverted"; by default that of the poses' format.
    skip_bad: skip and count damaged images instead of raising an error.

    Iterating yields DepthImage objects; colours() yields ColourImage objects. Images without a pose
    are skipped and counted in `skipped`. Raises RuntimeError if a file is missing or malformed; the
    message names file and line.
    """

    def __init__(self, path, format="", K=None, units_per_metre=None, poses=None,
                 pose_tolerance_s=0.02, first=0, last=None, step=1, pose_convention="", skip_bad=False):
        self._options = _core.RecordingOptions(path, format, K, units_per_metre, poses,
                                               pose_tolerance_s, first, last, step,
                                               pose_convention, skip_bad)
        self._size = self._options.open_depth().size
        self.skipped = {}

    @property
    def path(self):
        """The folder."""
        return self._options.path

    def __len__(self):
        """Number of selected depth images, including images without a pose."""
        if self._size is None:
            raise TypeError("the number of images in this recording is unknown")
        return self._size

    def __iter__(self):
        """Yields the selected depth images as DepthImage objects. Each iteration starts over."""
        images = self._options.open_depth()
        for image in images:
            self.skipped = images.skipped
            yield image
        self.skipped = images.skipped

    def colours(self):
        """Yields every step-th colour image of the whole recording as a ColourImage. Yields nothing if
        the recording has no colour images."""
        yield from self._options.open_colour() or ()

    def images(self, colour=True):
        """Yields depth and colour images in the order of their stamps, depth first if stamps are equal.
        Leaves out colour images before the first and after the last depth image."""
        colours = self.colours() if colour else iter(())
        painting = next(colours, None)
        is_first = True
        for image in self:
            while painting is not None and painting.stamp_s < image.stamp_s:
                if not is_first:  # before the first depth image there is no surface to paint
                    yield painting
                painting = next(colours, None)
            is_first = False
            yield image
            while painting is not None and painting.stamp_s == image.stamp_s:
                yield painting
                painting = next(colours, None)


def _print_progress(done, total):
    print(f"\rframes {done}" + (f" of {total}" if total else ""), end="", file=sys.stderr, flush=True)


def fuse(mapper, recording, colour=True, progress=None):
    """Fuses the depth images of a Recording at its poses, and its colour images unless colour is False.
    The resulting map is identical to that of `reconstruct --poses-mode tf`.

    progress: if True, prints progress to standard error; if a function, calls it as progress(done, total)
    after each depth image, where total is None if unknown; the function may raise an exception to stop. Returns the
    number of depth images fused. Ctrl-C stops between images; those fused so far stay in the map.
    """
    show = _print_progress if progress is True else progress
    done = fused = 0
    total = recording._size
    try:
        for image in recording.images(colour):
            if isinstance(image, _core.ColourImage):
                mapper.paint(image.colour, image.K, image.T_W_C, image.encoding)
                continue
            fused += bool(mapper.integrate(image.depth, image.K, image.T_W_C, image.stamp_s,
                                           unit_m=image.unit_m))
            done += 1
            if show:
                show(done, total)
    finally:
        if progress is True:
            print(file=sys.stderr)
    return fused
