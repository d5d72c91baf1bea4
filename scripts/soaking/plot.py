"""Draws what was recorded as an SVG: a panel for each quantity, time to the right."""
from xml.sax.saxutils import escape

WIDTH, PANEL, LEFT, RIGHT, TOP, GAP = 960, 120, 70, 170, 30, 34
MOST_POINTS = 500
COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#8c564b", "#17becf", "#7f7f7f",
           "#bcbd22", "#e377c2")


def thin(points, merge=max):
    """Not more points than can be told apart: of those side by side the greatest, or as told."""
    size = max(1, -(-len(points) // MOST_POINTS))
    groups = (points[i:i + size] for i in range(0, len(points), size))
    return [(group[0][0], merge(value for _, value in group)) for group in groups]


def samples(records):
    return [record for record in records if record["kind"] == "sample"]


def over_time(records, value_of):
    """(seconds, value) of each sample that has one."""
    found = ((sample["t"], value_of(sample)) for sample in samples(records))
    return [(t, value) for t, value in found if value is not None]


def latency_of(sample):
    return max(sample["latency_s"]) if sample["latency_s"] else None


def memory_of(name):
    return lambda sample: sample.get("memory_mb", {}).get(name)


def dropped_so_far(records):
    """Per reason the sum since the beginning, over all streams and lives of the node."""
    sums, before, lines = {}, {}, {}
    for sample in samples(records):
        for stream, counts in sample.get("streams", {}).items():
            for reason, number in counts["dropped"].items():
                last = before.get((stream, reason), 0)
                sums[reason] = sums.get(reason, 0) + (number - last if number >= last else number)
                before[stream, reason] = number
            for key in [key for key in before if key[0] == stream and
                        key[1] not in counts["dropped"]]:
                del before[key]  # the node began anew
        for reason, number in sums.items():
            lines.setdefault(reason, []).append((sample["t"], number))
    return lines


def panels_of(name, records):
    memory = {"resident": over_time(records, lambda sample: sample["rss_mb"]),
              "of it map": over_time(records, memory_of("map")),
              "mesh": over_time(records, memory_of("mesh")),
              "queues": over_time(records, memory_of("queues"))}
    gpu = over_time(records, lambda sample: sample.get("gpu_mb"))
    if gpu:
        memory["GPU"] = gpu
    return [(f"{name}: memory, MB", memory),
            (f"{name}: image to mesh_blocks, s", {"slowest": over_time(records, latency_of)}),
            (f"{name}: images dropped so far, by reason", dropped_so_far(records))]


def polyline(points, to_x, to_y, colour):
    text = " ".join(f"{to_x(t):.1f},{to_y(value):.1f}" for t, value in thin(points))
    return f'<polyline points="{text}" fill="none" stroke="{colour}" stroke-width="1.2"/>'


def label(x, y, text, anchor="start", colour="#222"):
    return (f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">'
            f'{escape(text)}</text>')


def draw_panel(title, lines, top, end_s):
    lines = {name: points for name, points in lines.items() if points}
    most = max((value for points in lines.values() for _, value in points), default=1.0) or 1.0

    def to_x(t):
        return LEFT + (WIDTH - LEFT - RIGHT) * t / end_s

    def to_y(value):
        return top + PANEL * (1.0 - value / most)

    parts = [f'<rect x="{LEFT}" y="{top}" width="{WIDTH - LEFT - RIGHT}" height="{PANEL}" '
             'fill="none" stroke="#999"/>',
             label(LEFT, top - 6, title), label(LEFT - 6, top + 10, f"{most:.3g}", "end"),
             label(LEFT - 6, top + PANEL, "0", "end"),
             label(WIDTH - RIGHT, top + PANEL + 14, f"{end_s / 60:.1f} min", "end")]
    for number, (name, points) in enumerate(lines.items()):
        colour = COLOURS[number % len(COLOURS)]
        parts.append(polyline(points, to_x, to_y, colour))
        parts.append(label(WIDTH - RIGHT + 8, top + 12 + 13 * number, name, colour=colour))
    return parts


def draw(all_records):
    panels = [panel for name, records in all_records.items() for panel in panels_of(name, records)]
    end_s = max((records[-1]["t"] for records in all_records.values() if records), default=1.0)
    height = TOP + len(panels) * (PANEL + GAP)
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" '
             'font-family="sans-serif" font-size="11">',
             f'<rect width="{WIDTH}" height="{height}" fill="white"/>']
    for number, (title, lines) in enumerate(panels):
        parts += draw_panel(title, lines, TOP + number * (PANEL + GAP), end_s)
    return "\n".join(parts + ["</svg>"]) + "\n"
