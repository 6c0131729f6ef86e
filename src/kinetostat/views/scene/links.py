"""Links as solids: bars by their section, cylinder and rod, pairs of bars. Where they are is the anatomy's business."""

from kinetostat.views.scene import shapes
from kinetostat.views.scene.anatomy import LinkPart
from kinetostat.views.scene.profiles import Profile
from kinetostat.views.scene.solids import Solid, Turned, unit, upright

BARREL = 0.56
"""Length of a cylinder as a share of its leg's length where the machine was loaded."""
LONGEST_BARREL = 0.88
"""Share of a leg that its cylinder takes at most, however short the leg becomes."""
FASTER = 0.72
"""Radius of a bar as a share of a leg's cylinder, where no section says otherwise."""


def link_solids(link: LinkPart, radius: float, material: str, profile: Profile | None, span: float) -> list[Solid]:
    """A link of a leg.

    Args:
        link: its kind and ends.
        radius: of a leg, m.
        material: of the leg.
        profile: its section, if the file gives one.
        span: of a telescope where the machine was loaded, m.
    """
    if link.kind == "telescope":
        return _telescope(link, radius, material, span)
    if link.kind == "bars":
        return _bars(link, radius, material)
    return [_bar(link, radius, material, profile)]


def _bar(link: LinkPart, radius: float, material: str, profile: Profile | None) -> Solid:
    length = link.span.norm()
    place = upright(link.start, link.span, link.up)
    if profile is None:
        return Solid(f"{link.name}/bar", shapes.shaft(0.95 * radius, length, 0.15 * radius), material, place)
    if profile.depth is None:
        return Solid(
            f"{link.name}/bar", shapes.shaft(0.5 * profile.width, length, 0.05 * profile.width), material, place
        )
    chamfer = 0.06 * min(profile.width, profile.depth)
    return Solid(f"{link.name}/bar", shapes.block(profile.depth, profile.width, length, chamfer), material, place)


def _telescope(link: LinkPart, radius: float, material: str, span: float) -> list[Solid]:
    """A cylinder at the start, out of which the rod comes."""
    length, along = link.span.norm(), unit(link.span)
    gap = min(2.0 * radius, 0.12 * length)
    barrel = min(BARREL * span, LONGEST_BARREL * length) - gap
    big = 1.25 * radius

    def part(name: str, shape: Turned, of: str, distance: float) -> Solid:
        return Solid(f"{link.name}/{name}", shape, of, upright(link.start + along * distance, along))

    return [
        part("stem", shapes.shaft(0.7 * radius, gap + 0.2 * radius), "joint", 0.0),
        part("cylinder", shapes.shaft(big, barrel, 0.2 * radius), material, gap),
        part("cap", shapes.shaft(1.14 * big, 0.9 * radius, 0.15 * radius), "joint", gap),
        part("gland", shapes.shaft(1.14 * big, 0.8 * radius, 0.15 * radius), "joint", gap + barrel - 0.7 * radius),
        part("rod", shapes.shaft(0.62 * radius, length - gap - barrel + radius), "steel", gap + barrel - radius),
    ]


def _bars(link: LinkPart, radius: float, material: str) -> list[Solid]:
    """Two bars, and the shafts or pins that hold them."""
    side = link.side if link.side is not None else link.span * 0.0
    thick, width = FASTER * radius, side.norm()
    found = []
    for end, centre in (("near", link.start), ("far", link.end)):
        place = upright(centre, side)
        found.append(Solid(f"{link.name}/{end} shaft", shapes.pin(0.7 * thick, 2.0 * width + radius), "joint", place))
    for n, sign in enumerate((1.0, -1.0), 1):
        start = link.start + side * sign
        length = link.span.norm()
        bar = shapes.shaft(thick, length)
        found.append(Solid(f"{link.name}/bar {n}", bar, material, upright(start, link.span)))
        for end, centre in (("near", start), ("far", link.end + side * sign)):
            knuckle = shapes.pin(1.25 * thick, 1.6 * thick) if link.pinned else shapes.ball(1.55 * thick)
            axis = link.span.cross(side) if link.pinned else link.span
            found.append(Solid(f"{link.name}/{end} knuckle {n}", knuckle, "steel", upright(centre, axis)))
    return found
