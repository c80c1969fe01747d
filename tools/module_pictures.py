"""The pictures of floors and modules for docs/architecture.md, as SVG (tools/modules)."""

STYLE = ("<style>.line{fill:none;stroke:#3b6ea5;stroke-width:1.4}rect{fill:#eef3f9;stroke:#3b6ea5}.floor{fill:#dfe8f2}"
         ".outside{fill:none;stroke-dasharray:4 3}text{fill:#16202c;text-anchor:middle}.small{font-size:12px;fill:#4a5a6c}"
         "@media(prefers-color-scheme:dark){rect{fill:#1c2733}.floor{fill:#243447}.outside{fill:none}text{fill:#e6edf3}"
         ".small{fill:#9fb0c3}}</style>")


def svg(width, height, title, body):
    return "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" font-family="sans-serif" font-size="14">',
                      STYLE, f"<title>{title}</title>", *body, "</svg>"]) + "\n"


def box(x, y, width, height, kind=""):
    return f'<rect class="{kind}" x="{x:.0f}" y="{y:.0f}" width="{width:.0f}" height="{height:.0f}" rx="6"/>'


def text(x, y, words, kind=""):
    return f'<text class="{kind}" x="{x:.0f}" y="{y:.0f}">{words}</text>'


def curve(x1, y1, x2, y2):
    bend = (y2 - y1) * 0.5
    return f'<path class="line" d="M{x1:.0f} {y1:.0f}C{x1:.0f} {y1 + bend:.0f} {x2:.0f} {y2 - bend:.0f} {x2:.0f} {y2:.0f}"/>'


def wrapped(words, most):
    lines = [""]
    for word in words.split():
        if lines[-1] and len(lines[-1]) + len(word) + 1 > most:
            lines.append("")
        lines[-1] = (lines[-1] + " " + word).strip()
    return lines


# The plan in rows from the top, each floor with its column (0 left, 1 middle, 2 right), so that no line passes behind a box.
ROWS = [{"session": 1}, {"validation": 1}, {"lab": 0, "review": 2}, {"twin": 0}, {"scenario": 0, "devices": 2}, {"sensors": 0, "control": 2},
        {"physics": 0, "ros": 2}, {"robot": 0}, {"description": 0}, {"base": 1}]


def needed(floors):
    """The edges between floors that are not also reached over another floor."""
    uses = {floor: set(below.split()) for floor, (_, below) in floors.items()}
    return {(floor, lower) for floor, lowers in uses.items() for lower in lowers
            if not any(lower in uses[other] for other in lowers if other != lower)}


def plan_picture(floors, modules):
    width, rise, tall, wide = 780, 84, 58, 362
    place = {name: (wide / 2 + 8 + column * (width - wide - 16) / 2, 40 + row * rise)
             for row, names in enumerate(ROWS) for name, column in names.items()}
    body = []
    for floor, lower in sorted(needed(floors)):
        (x1, y1), (x2, y2) = place[floor], place[lower]
        shift = max(-178, min(178, (x2 - x1) / 2))  # towards each other, so that the line passes between boxes
        body.append(curve(x1 + shift, y1 + tall / 2, x2 - shift, y2 - tall / 2))
    for floor, (x, y) in place.items():
        body.append(box(x - wide / 2, y - tall / 2, wide, tall, "floor"))
        body.append(text(x, y - 6, floor))
        inside = ", ".join(path.split("/")[-1] for path in modules if path.startswith(floor + "/"))
        body.append(text(x, y + 15, inside, "small"))
    return svg(width, 40 + len(ROWS) * rise - 10, "The floors of doppel: a line goes down from a floor to what it stands on", body)


def levels_within(floor, modules):
    """Modules of a floor -> level: the longest chain of dependencies within the floor."""
    level = {}

    def of(path):
        if path not in level:
            level[path] = 1 + max((of(lower) for lower in modules[path].uses if lower.startswith(floor + "/")), default=-1)
        return level[path]

    for path in modules:
        if path.startswith(floor + "/"):
            of(path)
    return level


def direct(modules, path, floor):
    """The modules of its floor that a module uses and does not reach over another one of them."""
    uses = [lower for lower in modules[path].uses if lower.startswith(floor + "/")]

    def reaches(a, b):
        return any(lower == b or reaches(lower, b) for lower in modules[a].uses if lower.startswith(floor + "/"))

    return [lower for lower in uses if not any(other != lower and reaches(other, lower) for other in uses)]


def floor_picture(floor, floors, modules):
    level = levels_within(floor, modules)
    rows = [sorted(path for path in level if level[path] == row) for row in range(max(level.values()) + 1)]
    rise, tall, wide = 78, 36, 150
    width = max(420, 170 * max(len(row) for row in rows))
    below = sorted({lower.split("/")[0] for path in level for lower in modules[path].uses} - {floor}, key=list(floors).index)
    height = rise * (len(rows) + bool(below)) + 10
    place = {}
    for row, names in enumerate(rows):
        for i, path in enumerate(names):
            place[path] = (width * (i + 0.5) / len(names), rise * (len(rows) - row - 0.5))
    body = []
    for path in sorted(level):
        for lower in sorted(direct(modules, path, floor)):
            body.append(curve(place[path][0], place[path][1] + tall / 2, place[lower][0], place[lower][1] - tall / 2))
    for path, (x, y) in sorted(place.items()):
        body.append(box(x - wide / 2, y - tall / 2, wide, tall))
        body.append(text(x, y + 5, path.split("/", 1)[1]))
    if below:
        y = rise * len(rows) + 30
        body.append(box(12, y - tall / 2, width - 24, tall, "outside"))
        body.append(text(width / 2, y + 5, "stands on: " + ", ".join(below), "small"))
    return svg(width, height, f"The modules of the floor {floor}", body)
