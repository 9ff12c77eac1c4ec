"""The keys of a body in a head description: where it stands, what shape it has, what it is made of."""

from typing import Annotated, Any, ClassVar, Final, Literal

from pydantic import Field

from stepdiag.config.key_types import POSITIVE_LENGTH, SHARE, THREE_LENGTHS, PositiveLength, Section, Share, Triple, key

LARGEST_INDEX: Final = 5.0  # no glass has more
MOST_CORNERS: Final = 10_000  # of one body; a head of a thousand faces works, a file of a million is none
Turn = Annotated[float, Field(ge=-360.0, le=360.0)]
Milliradians = Annotated[float, Field(ge=-6300.0, le=6300.0)]
Index = Annotated[float, Field(ge=1.0, le=LARGEST_INDEX)]
Material = Annotated[str, Field(min_length=1)] | Index

_material = 'the name of a glass such as "N-BK7", or a refractive index from 1 to 5'


class Placed(Section):
    """Where a component stands: its own frame is turned, then its origin put to the position."""

    position_mm: Triple = key(THREE_LENGTHS, "Where its origin is in the head's frame.", (0.0, 0.0, 0.0))
    rotation_deg: tuple[Turn, Turn, Turn] | None = key(
        "three angles from -360 to 360",
        "Rotation vector about its own origin: its direction is the axis, its length the angle. By default not turned.",
        None,
        [0.0, 90.0, 0.0],
    )
    rotation_mrad: tuple[Milliradians, Milliradians, Milliradians] | None = key(
        "three angles from -6300 to 6300", "The same in mrad; one of the two.", None, [0.0, 0.5, 0.0]
    )


SHAPES: Final = (
    "plate",
    "wedge",
    "cube_splitter",
    "right_angle_prism",
    "corner_cube",
    "mirror",
    "screen",
    "polyhedron",
)
_shapes = " or ".join(f'"{shape}"' for shape in SHAPES)


def _shape() -> Any:
    return key(f"a shape: {_shapes}", "What it is.")


def _width() -> Any:
    return key(POSITIVE_LENGTH, "Edge along its x.", example=60.0)


def _height() -> Any:
    return key(POSITIVE_LENGTH, "Edge along its y.", example=60.0)


class BodyKeys(Placed):
    """A body where it stands. Its `shape` decides which other keys it has: one of those below."""

    tag: ClassVar[str] = "shape"


class GlassKeys(BodyKeys):
    """A body of glass."""

    material: Material = key(_material, "Glass of the catalogue, or its index.", example="N-BK7")
    reflectance: Share = key(SHARE, "Share of the light that a face sends back: with it there are ghosts.", 0.0)


class PlateKeys(GlassKeys):
    """A plane window: origin in its middle, two faces square to its z."""

    shape: Literal["plate"] = _shape()
    width_mm: PositiveLength = _width()
    height_mm: PositiveLength = _height()
    thickness_mm: PositiveLength = key(POSITIVE_LENGTH, "Along its z.", example=5.0)


class WedgeKeys(GlassKeys):
    """A plate whose face at +z is turned about y, so that it is thicker at +x."""

    shape: Literal["wedge"] = _shape()
    width_mm: PositiveLength = _width()
    height_mm: PositiveLength = _height()
    thickness_mm: PositiveLength = key(POSITIVE_LENGTH, "Along its z, in the middle.", example=5.0)
    angle_deg: Annotated[float, Field(gt=-90.0, lt=90.0)] = key(
        "an angle between -90 and 90", "By which the face at +z is turned.", example=1.0
    )


class CubeSplitterKeys(BodyKeys):
    """Two right-angle prisms with a splitting face between them; origin in its middle."""

    shape: Literal["cube_splitter"] = _shape()
    edge_mm: PositiveLength = key(POSITIVE_LENGTH, "Of the cube.", example=20.0)
    material: Material = key(_material, "Glass of the catalogue, or its index.", example="N-BK7")
    reflectance: Share = key(SHARE, "Share of the light that the splitting face reflects.", 0.5)
    absorptance: Share = key(SHARE, "Share of the light that the splitting face absorbs; the rest goes through.", 0.0)


class RightAnglePrismKeys(GlassKeys):
    """A right-angle prism: the right angle at +z, the hypotenuse at z = 0 with the origin in its middle."""

    shape: Literal["right_angle_prism"] = _shape()
    side_mm: PositiveLength = key(POSITIVE_LENGTH, "Of the two sides that are square to each other.", example=20.0)
    height_mm: PositiveLength = key(POSITIVE_LENGTH, "Along its y.", example=20.0)


class CornerCubeKeys(GlassKeys):
    """Three faces square to each other that meet in the origin; light enters through the face at `depth_mm`."""

    shape: Literal["corner_cube"] = _shape()
    depth_mm: PositiveLength = key(POSITIVE_LENGTH, "From the corner to the face where light enters.", example=20.0)


class MirrorKeys(BodyKeys):
    """A plane mirror in its x-y plane, origin in its middle; both sides reflect."""

    shape: Literal["mirror"] = _shape()
    width_mm: PositiveLength = _width()
    height_mm: PositiveLength = _height()
    reflectance: Share = key(SHARE, "Share of the light that it reflects; the rest is absorbed.", 1.0)


class ScreenKeys(BodyKeys):
    """A black screen in its x-y plane, origin in its middle: a stop, a beam dump."""

    shape: Literal["screen"] = _shape()
    width_mm: PositiveLength = _width()
    height_mm: PositiveLength = _height()


class PolyhedronKeys(GlassKeys):
    """Any convex body of glass, closed, with plane faces."""

    shape: Literal["polyhedron"] = _shape()
    corners_mm: Annotated[tuple[Triple, ...], Field(max_length=MOST_CORNERS)] = key(
        f"a list of up to {MOST_CORNERS} points, each three lengths in mm", "Its corners."
    )
    faces: Annotated[tuple[tuple[int, ...], ...], Field(max_length=MOST_CORNERS)] = key(
        f"a list of up to {MOST_CORNERS} faces, each a list of numbers of corners",
        "The corners of each face by number, from 0, in order around it.",
    )


AnyBody = Annotated[
    PlateKeys
    | WedgeKeys
    | CubeSplitterKeys
    | RightAnglePrismKeys
    | CornerCubeKeys
    | MirrorKeys
    | ScreenKeys
    | PolyhedronKeys,
    Field(discriminator="shape"),
]
